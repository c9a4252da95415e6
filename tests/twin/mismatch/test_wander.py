"""Processes that wander: their correlation, and a filter that frees samples of them."""

import numpy as np
import pytest

from twin.mismatch.noise import Noise, whitener
from twin.mismatch.wander import Wander

N, STEP_S, WHITE_V = 6000, 0.1, 2e-3
KINDS = [None, 0.3, 0.7071, 1.0, 4.0]


@pytest.mark.parametrize("damping", KINDS)
def test_it_forgets_over_the_time_it_says(damping: float | None) -> None:
    wander = Wander(size_V=1.0, forgets_s=1.5, damping=damping)
    at_s = np.linspace(0.0, 60.0, 60_001)
    follows = wander.follows(at_s)
    assert follows[0] == pytest.approx(1.0)
    assert np.trapezoid(follows, at_s) == pytest.approx(1.5, rel=1e-3)


@pytest.mark.parametrize("damping", KINDS)
def test_two_steps_are_one_twice_as_long(damping: float | None) -> None:
    keep = Wander(size_V=1.0, forgets_s=0.7, damping=damping).keep(np.array([0.2, 0.4]))
    assert keep[0] @ keep[0] == pytest.approx(keep[1], abs=1e-7)


@pytest.mark.parametrize("damping", KINDS)
def test_what_is_left_beside_it_is_white(damping: float | None) -> None:
    random = np.random.default_rng(11)
    wander = Wander(size_V=4e-3, forgets_s=0.6, damping=damping)
    wandered_V = wander.drawn(np.full(N - 1, STEP_S), random)
    residual_V = wandered_V + WHITE_V * random.standard_normal(N)
    noise = Noise(white_V=WHITE_V, slow_V=0.0, slow_s=20.0, left=wander)
    whiten = whitener(STEP_S * np.arange(N), np.ones(N, dtype=bool), noise)
    white = whiten(residual_V[:, None])[:, 0]
    assert np.var(white) == pytest.approx(1.0, abs=0.06)
    follows = [float(np.corrcoef(white[:-k], white[k:])[0, 1]) for k in range(1, 8)]
    assert np.abs(follows).max() < 4.0 / np.sqrt(N)
