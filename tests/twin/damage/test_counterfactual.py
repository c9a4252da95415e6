"""Each counterfactual takes its feature away and leaves what it promises to leave."""

import numpy as np
import pytest

from twin.damage import FEATURES, Waveform
from twin.damage.baselines import currents_A
from twin.damage.counterfactual import course, even_duty, slow_ramps, without_peaks, without_ripple
from twin.damage.spread import Piece, relative_std
from twin.damage.waveform import limited

T = np.arange(0.0, 40.0, 0.1)
RNG = np.random.default_rng(3)
PEAKS = np.where((T % 20 > 5) & (T % 20 < 9), 12.0, 0.0)
WAVE = Waveform(current_A=15 + PEAKS + RNG.standard_normal(T.size), sample_s=0.1)


def spread_A(values: np.ndarray) -> float:
    return float(values.std())


@pytest.mark.parametrize("feature", FEATURES)
def test_the_mean_and_the_period_stay(feature: str) -> None:
    other = FEATURES[feature](WAVE)
    assert other.mean_A == pytest.approx(WAVE.mean_A, abs=1e-12)
    assert other.period_s == WAVE.period_s


@pytest.mark.parametrize("feature", FEATURES)
@pytest.mark.parametrize("samples", [1, 2, 3, 30])
def test_a_constant_current_has_no_feature_to_lose(feature: str, samples: int) -> None:
    steady = Waveform(current_A=np.full(samples, 16.0), sample_s=0.1)
    np.testing.assert_allclose(FEATURES[feature](steady).current_A, 16.0, rtol=1e-14)


def test_course_and_ripple_are_taken_apart() -> None:
    np.testing.assert_allclose(
        without_peaks(WAVE).current_A - WAVE.mean_A + without_ripple(WAVE).current_A,
        WAVE.current_A,
        atol=1e-12,
    )
    assert spread_A(without_peaks(WAVE).current_A) < 2.0 < spread_A(without_ripple(WAVE).current_A)


def test_slow_ramps_keep_every_value_of_the_course() -> None:
    slow = course(WAVE)
    ripple = WAVE.current_A - slow
    arranged = slow_ramps(WAVE).current_A - ripple
    np.testing.assert_allclose(np.sort(arranged), np.sort(slow), atol=1e-12)
    assert np.abs(np.diff(arranged)).max() < np.abs(np.diff(slow)).max()


def test_an_even_duty_keeps_the_mean_square_of_the_course_and_lowers_its_peak() -> None:
    slow = course(WAVE)
    even = even_duty(WAVE).current_A - (WAVE.current_A - slow)
    assert spread_A(even) == pytest.approx(spread_A(slow))
    assert even.max() < slow.max()


def test_a_limit_keeps_the_charge() -> None:
    weights = RNG.random(T.size)
    gentle = limited(WAVE.current_A, 20.0, weights)
    assert gentle.max() <= 20.0
    assert weights @ gentle == pytest.approx(weights @ WAVE.current_A)
    with pytest.raises(ValueError, match="mean"):
        limited(WAVE.current_A, 10.0)


@pytest.mark.parametrize(
    ("means_A", "expected"),
    [
        ((16.9, 19.0, 21.6), (16, 18, 20, 22)),  # the paper's
        ((8.4, 8.9, 9.1), (8.0, 8.5, 9.0, 9.5)),
        ((52.0,), (50, 55, 60, 65)),
        ((0.5, 0.51), (0.5, 0.55, 0.6, 0.65)),
    ],
)
def test_baselines_are_round_and_around_all_means(
    means_A: tuple[float, ...], expected: tuple[float, ...]
) -> None:
    assert currents_A(means_A) == pytest.approx(expected)


def test_baselines_are_around_means_far_apart() -> None:
    got = currents_A((1.0, 60.0))
    assert got[0] < 1.0 < 60.0 < got[-1]
    assert got[0] > 0


def test_the_spread_of_damage_is_that_of_segments_drawn_again() -> None:
    """Damage that follows mean and mean square; the error over draws of other segments."""
    slope, per_swing, n = 1.3, 0.4, 12

    def damage(segments: list[np.ndarray]) -> float:
        whole = np.concatenate(segments)
        swing = np.mean(whole**2) / np.mean(whole) ** 2 - 1
        return float(whole.mean() ** slope * (1 + per_swing * swing))

    def segment() -> np.ndarray:
        return 16 + RNG.standard_normal() + (3 + RNG.random()) * np.tile([-1.0, 1.0], 50)

    draws = [[segment() for _ in range(n)] for _ in range(300)]
    values = np.array([damage(d) for d in draws])
    told = []
    for d in draws[:60]:
        whole = np.concatenate(d)
        held = Waveform(current_A=np.repeat(whole, 50), sample_s=0.1)  # steps, as `damage` has it
        pieces = [Piece(duration_s=9.0, mean_A=s.mean(), rms_A=np.sqrt(np.mean(s**2))) for s in d]
        told.append(relative_std(held, pieces, (0.0, 0.0), slope, per_swing * held.swing))
    assert np.mean(told) == pytest.approx(values.std() / values.mean(), rel=0.12)


def test_what_the_profile_misses_of_its_segments_counts() -> None:
    pieces = [Piece(duration_s=5.0, mean_A=WAVE.mean_A, rms_A=WAVE.square_A2**0.5)] * 2
    off = relative_std(WAVE, pieces, (0.01 * WAVE.mean_A, 0.0), 2.0, 0.0)
    assert off == pytest.approx(0.02)
    assert relative_std(WAVE, pieces, (0.0, 0.0), 2.0, 0.1) == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(relative_std(WAVE, pieces[:1], (0.0, 0.0), 2.0, 0.1))
