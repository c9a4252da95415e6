"""The colour of noise that was filtered before it was logged."""

import numpy as np
import pytest
from scipy.signal import lfilter

from twin.mismatch.coloured import smooth_noise
from twin.mismatch.wander import Wander

N, STEP_S, NOISE_V = 4000, 0.1, 5e-3


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(3)


def current_A(random: np.random.Generator) -> np.ndarray:
    return np.asarray(10.0 + lfilter([0.5], [1.0, -0.9], random.normal(0.0, 1.0, N)))


def filtered(random: np.random.Generator, time_constant_s: float) -> np.ndarray:
    keep = np.exp(-STEP_S / time_constant_s)
    own = lfilter([1.0 - keep], [1.0, -keep], random.normal(0.0, 1.0, N + 1000))[1000:]
    return np.asarray(NOISE_V * own / own.std())


@pytest.mark.parametrize("time_constant_s", [0.2, 0.5, 1.0])
def test_the_filter_of_a_logger_is_found(
    random: np.random.Generator, time_constant_s: float
) -> None:
    slow_V = 0.01 * np.sin(np.arange(N) / 400)
    told = smooth_noise(filtered(random, time_constant_s) + slow_V, current_A(random), STEP_S)
    assert told is not None
    assert told[1].size_V == pytest.approx(NOISE_V, rel=0.15)
    assert told[1].forgets_s == pytest.approx(time_constant_s, rel=0.3)


def test_white_noise_has_no_colour_whatever_follows_the_current(
    random: np.random.Generator,
) -> None:
    drawn_A = current_A(random)
    residual_V = NOISE_V * random.normal(0.0, 1.0, N) + 2e-3 * drawn_A
    assert smooth_noise(residual_V, drawn_A, STEP_S) is None


def test_what_is_known_to_wander_is_no_colour(random: np.random.Generator) -> None:
    smooth_V = filtered(random, 0.5)
    residual_V = smooth_V + NOISE_V * random.normal(0.0, 1.0, N)
    left = Wander(size_V=NOISE_V, forgets_s=0.5)
    assert smooth_noise(residual_V, current_A(random), STEP_S) is not None
    assert smooth_noise(residual_V, current_A(random), STEP_S, left) is None


@pytest.mark.parametrize(("samples", "step_s"), [(100, 0.1), (4000, 1.0)])
def test_few_samples_and_slow_ones_tell_none(
    random: np.random.Generator, samples: int, step_s: float
) -> None:
    smooth_V = filtered(random, 0.5)[:samples]
    assert smooth_noise(smooth_V, current_A(random)[:samples], step_s) is None


def test_what_is_slower_than_a_filter_is_none(random: np.random.Generator) -> None:
    """As what a voltage is off by after the logger paused, which was one and hid a resistance."""
    smooth_V = filtered(random, 8.0) + NOISE_V * random.normal(0.0, 1.0, N)
    assert smooth_noise(smooth_V, current_A(random), STEP_S) is None


def test_a_short_recording_at_a_high_rate_is_long_enough(random: np.random.Generator) -> None:
    """Fewer samples than there are in the mean that is taken out: it was a fault of the program."""
    white_V = NOISE_V * random.normal(0.0, 1.0, 400)
    assert smooth_noise(white_V, current_A(random)[:400], 0.02) is None


@pytest.mark.parametrize("stays_s", [2.0, 3.0])
def test_a_contact_that_comes_and_goes_is_no_filter(
    random: np.random.Generator, stays_s: float
) -> None:
    """At 2 Hz it follows itself as a filter's noise does, but most samples do not move by it."""
    flips = random.random(N) < 0.5 / stays_s
    drawn_A = current_A(random)
    contact_V = -6e-3 * drawn_A * (np.cumsum(flips) % 2)
    residual_V = contact_V + NOISE_V * random.normal(0.0, 1.0, N)
    assert smooth_noise(residual_V, drawn_A, 0.5) is None


def test_what_is_steady_to_the_bit_has_no_colour() -> None:
    """A voltage that stands, and no current: the logarithm of nothing ended `twin explain`."""
    assert smooth_noise(np.zeros(300), np.zeros(300), 0.5) is None
