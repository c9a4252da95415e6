"""Noise of a recording, and residuals freed of it."""

import numpy as np
import pytest

from twin.correlation import correlation_time
from twin.mismatch.noise import (
    HUBER,
    Noise,
    Unseen,
    tamed,
    whitener,
)
from twin.mismatch.wander import Wander

N = 20_000


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(3)


@pytest.mark.parametrize("together_s", [0.0, 1.0])
def test_whitened_residuals_of_the_expected_noise_are_independent_of_unit_variance(
    random: np.random.Generator, together_s: float
) -> None:
    """The slow part is drawn by its exact recursion."""
    noise = Noise(white_V=8e-3, slow_V=5e-3, slow_s=20.0, together_s=together_s)
    keep = np.exp(-0.1 / noise.slow_s)
    slow = np.zeros(N)
    slow[0] = noise.slow_V * random.standard_normal()
    for k in range(1, N):
        slow[k] = (
            keep * slow[k - 1] + noise.slow_V * np.sqrt(1 - keep**2) * random.standard_normal()
        )
    residual = (slow + noise.white_V * random.standard_normal(N)).astype(np.float64)
    time_s = 0.1 * np.arange(float(N))
    white = whitener(time_s, np.ones(N, dtype=bool), noise)(residual[:, None])[:, 0]
    assert white.size == (N if not together_s else N // 10)
    assert np.var(white) == pytest.approx(1.0, rel=0.12 if together_s else 0.03)
    assert correlation_time(white) < 1.3
    assert correlation_time(residual) > 20  # and it was not before


def test_samples_that_are_few_in_a_period_each_count_by_themselves() -> None:
    noise = Noise(white_V=1.0, slow_V=1.0, slow_s=20.0, together_s=1.0)
    for period_s, size in ((0.4, 40), (0.6, 100)):
        own = whitener(period_s * np.arange(100.0), np.ones(100, dtype=bool), noise)
        assert own(np.ones((100, 1))).shape == (size, 1)
        assert own.samples[1] == (3 if size < 100 else 1)


def test_a_long_gap_begins_anew_and_a_short_one_does_not(random: np.random.Generator) -> None:
    noise = Noise(white_V=1.0, slow_V=1.0, slow_s=20.0)
    time_s = 0.1 * np.arange(200)
    judged = np.ones(200, dtype=bool)
    judged[100:150] = False
    values = random.standard_normal((200, 1))
    for gap_s, anew in ((1000.0, True), (0.0, False)):
        there_s = time_s + gap_s * (np.arange(200) >= 150)
        both = whitener(there_s, judged, noise)(values)
        late = whitener(there_s[150:], judged[150:], noise)(values[150:])
        assert both.shape == (150, 1)
        assert (np.abs(both[100:] - late).max() < 1e-9) == anew


@pytest.mark.parametrize(("along_V", "walks"), [(0.0, 0.0), (30e-3, 0.0), (0.0, 1.0), (30e-3, 1.0)])
def test_uneven_samples_are_freed_as_even_ones(
    random: np.random.Generator, along_V: float, walks: float
) -> None:
    """Covariance of the process at any times and currents, by its Cholesky factor: exact."""
    noise = Noise(white_V=2e-3, slow_V=20e-3, slow_s=200.0, along_V=along_V, along_s=500.0)
    time_s = np.cumsum(random.choice([0.5, 5.0, 60.0, 600.0], 70)).astype(np.float64)
    judged = np.arange(70) >= 10  # the charge is off by what was drawn before, too
    current_A = random.normal(10.0, 20.0, 70)
    rested = np.cumsum(random.choice([0.0, 0.0, 100.0], 70))  # pauses: far walks, all forgotten
    between = Unseen(
        walk_V=walks * random.normal(0.0, 1e-3, 70),
        walk_s=time_s - time_s[0] + rested,
        quick_V=walks * random.uniform(0.0, 20e-3, 70),
        quick=(Wander(size_V=0.6, forgets_s=3.0), Wander(size_V=0.8, forgets_s=90.0)),
        paused_V=walks * random.uniform(0.0, 20e-3, 70),
        paused_s=time_s / 40.0 + rested,
        begun_V=walks * random.normal(0.0, 20e-3, (70, 2)),
    )
    t, current = time_s[judged], current_A[judged]
    walk, quick = between.walk_V[judged], between.quick_V[judged]
    drive = current / np.sqrt(np.mean(current**2))
    apart_s = np.abs(t[:, None] - t)
    covariance = noise.slow_V**2 * np.exp(-apart_s / noise.slow_s)
    covariance += along_V**2 * drive[:, None] * drive * np.exp(-apart_s / noise.along_s)
    walk_s, paused_s = between.walk_s[judged], between.paused_s[judged]
    covariance += walk[:, None] * walk * np.minimum(walk_s[:, None], walk_s)
    paused = between.paused_V[judged]
    covariance += paused[:, None] * paused * np.exp(-np.abs(paused_s[:, None] - paused_s))
    follows = sum(w.size_V**2 * np.exp(-apart_s / w.forgets_s) for w in between.quick)
    covariance += quick[:, None] * quick * follows
    covariance += between.begun_V[judged] @ between.begun_V[judged].T
    covariance += noise.white_V**2 * np.eye(t.size)
    root = np.zeros((70, t.size))
    root[judged] = np.linalg.cholesky(covariance).astype(np.float64)
    freed = whitener(time_s, judged, noise, current_A, between)(root)
    assert np.abs(freed @ freed.T - np.eye(60)).max() < 1e-9


def test_residuals_beyond_huber_s_bound_count_by_their_size(random: np.random.Generator) -> None:
    r = 4.0 * random.standard_normal(N)
    loss = np.where(np.abs(r) < HUBER, r**2 / 2, HUBER * np.abs(r) - HUBER**2 / 2)
    there = tamed(np.column_stack([r, np.ones(N), -2.0 * np.ones(N)]))
    assert there[:, 0] ** 2 / 2 == pytest.approx(loss)
    assert np.array_equal(np.sign(there[:, 0]), np.sign(r))
    step = 1e-6
    far = (tamed(r[:, None] + step) - tamed(r[:, None] - step))[:, 0] / (2 * step)
    smooth = np.abs(np.abs(r) - HUBER) > 10 * step
    assert there[smooth, 1] == pytest.approx(far[smooth], rel=1e-6)
    assert there[:, 2] == pytest.approx(-2.0 * there[:, 1])


def test_bad_samples_move_a_mean_little_where_tails_are_heavy(random: np.random.Generator) -> None:
    """Gauss-Newton on what a whitener gives, 2 % of the samples ten deviations off."""
    x = random.standard_normal(N) + 10.0 * (np.arange(N) < N // 50)
    found = []
    for heavy in (False, True):
        noise = Noise(white_V=1.0, slow_V=0.0, slow_s=1.0, heavy_tailed=heavy)
        whiten, mean = whitener(np.arange(float(N)), np.ones(N, dtype=bool), noise), 0.0
        for _ in range(40):
            white = whiten(np.column_stack([x - mean, -np.ones(N)]))
            mean -= float(white[:, 1] @ white[:, 0]) / float(white[:, 1] @ white[:, 1])
        found.append(mean)
    assert found[0] == pytest.approx(0.2, abs=0.03)
    assert found[1] == pytest.approx(0.0, abs=0.05)


def test_of_no_samples_nothing_is_made() -> None:
    noise = Noise(white_V=1.0, slow_V=1.0, slow_s=20.0, along_V=1.0)
    none = whitener(np.arange(9.0), np.zeros(9, dtype=bool), noise, np.ones(9))
    assert none(np.ones((9, 2))).shape == (0, 2)


@pytest.mark.parametrize("forgets_s", [0.06, 0.3, 1.3])
def test_means_of_noise_that_follows_itself_vary_by_less_than_it(forgets_s: float) -> None:
    """Of 10 samples each; taken to vary as one sample does, they told 0.13, 0.50 and 0.77."""
    wander = Wander(size_V=8e-3, forgets_s=forgets_s, damping=0.8)
    random, time_s = np.random.default_rng(2), 0.1 * np.arange(6000.0)
    wandered_V = wander.drawn(np.diff(time_s), random)
    residual_V = wandered_V + 3e-3 * random.standard_normal(time_s.size)
    noise = Noise(white_V=3e-3, slow_V=0.0, slow_s=1.0, left=wander, together_s=1.0)
    white = whitener(time_s, np.ones(time_s.size, dtype=bool), noise)(residual_V[:, None])
    assert np.mean(white**2) == pytest.approx(1.0, abs=0.2)
