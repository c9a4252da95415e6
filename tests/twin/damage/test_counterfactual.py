"""Each counterfactual takes its feature away and leaves what it promises to leave."""

import numpy as np
import pytest

from twin.damage import FEATURES, Waveform
from twin.damage.baselines import currents_A
from twin.damage.counterfactual import course, even_duty, slow_ramps, without_peaks, without_ripple
from twin.damage.error import Error, together
from twin.damage.spread import Piece, error_of, grouped
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


def test_a_value_has_the_error_of_few_segments() -> None:
    """Means of three drawn segments: their interval holds the mean of all as often as it says."""
    random = np.random.default_rng(3)
    drawn = random.normal(1.3, 0.2, (2000, 3))
    means = drawn.mean(axis=1)
    errors = [error_of(m, row, (1.0, 1.0, 1.0)) for m, row in zip(means, drawn, strict=True)]
    for share in (0.68, 0.95):
        held = [abs(m - 1.3) < e.half(share) for m, e in zip(means, errors, strict=True)]
        assert np.mean(held) == pytest.approx(share, abs=0.02)  # two deviations of 2000 cases


def test_what_the_waveform_misses_of_its_segments_counts() -> None:
    assert error_of(1.1, [1.0, 1.0], [9.0, 9.0]).std == pytest.approx(0.1, rel=1e-3)
    assert error_of(1.0, [1.0, 1.0], [9.0, 9.0]).std == pytest.approx(1e-3)
    assert np.isnan(error_of(1.0, [1.0], [9.0]).half_95)


def test_many_segments_are_flown_in_groups_and_each_once() -> None:
    pieces = [Piece(current_A=np.full(10 + k, 5.0 + k), sample_s=0.1) for k in range(14)]
    idle = Piece(current_A=np.zeros(10), sample_s=0.1)
    waves = grouped([*pieces, idle])
    assert len(waves) == 6
    assert sum(w.current_A.sum() for w in waves) == sum(p.current_A.sum() for p in pieces)
    assert grouped([idle]) == ()


def test_errors_that_add_up_are_known_as_well_as_the_worst_of_them() -> None:
    three, exact = Error(std=3.0, freedom=2.0), Error(std=4.0)
    both = together(three, exact)
    assert both.std == 5.0
    assert both.freedom == pytest.approx(2 * (25 / 9) ** 2)
    assert together(three, Error(std=0.0)).half_95 == pytest.approx(4.3027 * 3, rel=1e-4)
    assert exact.half_95 == pytest.approx(1.95996 * 4, rel=1e-4)
    assert np.isnan(together(three, Error(std=float("nan"))).half_95)


def test_a_flight_of_a_motion_draws_what_it_is_asked_to() -> None:
    for charge_C in (20.0, 500.0, 1234.5):
        flown = WAVE.drawing(charge_C, 298.15)
        assert flown.charge_C() == pytest.approx(charge_C, abs=0.02)  # of one step
        np.testing.assert_array_equal(flown.current_A[:10], WAVE.current_A[:10])
