"""The estimator's parts on plain arrays: exact where theory is exact, bounded where it is not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs.correlate import (
    masked_mean,
    overlap_correlation,
    peaks,
    regrid,
    significance,
    spikes,
)
from flightlogs.krige import Variogram, cross_pairs, fit_variogram, krige, own_pairs, structure
from flightlogs.polish import long_run, polish
from flightlogs.refine import ClockMap, Pair, refine, smooth


def test_the_correlation_at_every_lag_is_that_of_the_common_samples() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=30), rng.normal(size=41)
    a[7] = b[20] = np.nan
    lags, r, n = overlap_correlation(a, b, 5)
    for lag, got, count in zip(lags, r, n, strict=True):
        i = np.arange(len(a))
        j = i + int(lag)
        ok = (j >= 0) & (j < len(b))
        x, y = a[i[ok]], b[j[ok]]
        both = np.isfinite(x) & np.isfinite(y)
        assert count == both.sum()
        if count >= 5:
            assert got == pytest.approx(np.corrcoef(x[both], y[both])[0, 1], abs=1e-9)
        else:
            assert np.isnan(got)


@settings(max_examples=25, deadline=None)
@given(st.integers(-90, 150), st.floats(0.1, 10), st.floats(-50, 50))
def test_the_peak_finds_a_shift_whatever_scale_and_zero(shift, gain, bias) -> None:
    x = np.cumsum(np.random.default_rng(2).normal(size=600))
    x -= masked_mean(x, 50)
    a, b = x[200:400], gain * x[200 - shift : 500 - shift] + bias
    lags, r, n = overlap_correlation(a, b, 100)
    assert peaks(lags, significance(r, n), apart=10, count=3)[0] == shift


def test_peaks_keep_their_distance() -> None:
    lags = np.arange(100.0)
    found = peaks(lags, np.exp(-0.001 * (lags - 40) ** 2), apart=15, count=3)
    assert found[0] == 40
    assert np.min(np.abs(np.subtract.outer(found, found))[np.triu_indices(3, 1)]) > 15


def test_a_spike_is_told_from_a_take_off() -> None:
    x = np.random.default_rng(9).normal(size=500) * 0.1
    x[200:] += 15
    x[300] = 90
    assert np.flatnonzero(spikes(x)).tolist() == [300]


def test_holes_are_not_bridged() -> None:
    t = np.concatenate([np.arange(0, 5, 0.1), np.arange(8, 12, 0.1)])
    grid = regrid(t, np.ones_like(t))
    at = 0.1 * np.arange(len(grid))
    assert np.all(np.isnan(grid[(at > 5) & (at < 7.95)]))
    assert np.all(grid[(at < 4.85) | ((at > 8.05) & (at < 11.85))] == 1)


@settings(max_examples=25, deadline=None)
@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3))
def test_smoothing_is_exact_for_a_quadratic_on_uneven_stamps(a, b, c) -> None:
    t = np.cumsum(np.random.default_rng(3).uniform(0.05, 0.15, 100))
    at = np.linspace(1, t[-1] - 1, 37)
    value, slope = smooth(at, t, a + b * t + c * t**2, 0.3)
    assert value == pytest.approx(a + b * at + c * at**2, abs=1e-8)
    assert slope == pytest.approx(b + 2 * c * at, abs=1e-7)


def test_kriging_returns_noiseless_samples_and_grows_less_sure_between_them() -> None:
    power = np.zeros(len(structure(np.zeros(1))))
    power[1] = 4.0
    lags = np.arange(0, 6, 0.001)
    variogram = Variogram(table=power @ structure(lags), noise=0.0, reference_noise=0.0)
    t = 0.1 * np.arange(50)
    x = np.random.default_rng(4).normal(size=50)
    at = t[10] + np.array([0.0, 0.02, 0.05])
    value, variance = krige(at, t, x, variogram)
    assert value[0] == pytest.approx(x[10], abs=1e-3)
    assert variance[0] < 0.01 * variance[1] < 0.01 * variance[2]


def test_fine_lags_tell_the_noise_of_two_instruments_from_their_signal() -> None:
    rng = np.random.default_rng(5)
    t, r = 0.1 * np.arange(20000), np.sort(rng.uniform(1, 1990, 20000))
    x, y = (np.sin(0.3 * at) + sd * rng.normal(size=len(at)) for at, sd in ((t, 0.3), (r, 0.2)))
    near = np.searchsorted(t, r)[:, None] + np.arange(-6, 6)
    cross = cross_pairs(
        (t[near] - r[:, None]).ravel(), (x[near] - y[:, None]).ravel(), np.arange(0, 0.61, 0.01)
    )
    variogram = fit_variogram(own_pairs(t, x, 20), cross)
    assert variogram.noise == pytest.approx(0.09, rel=0.15)
    assert variogram.reference_noise == pytest.approx(0.04, rel=0.3)


def test_the_long_run_variance_of_white_scores_is_their_variance() -> None:
    s = np.random.default_rng(6).normal(size=(20000, 2))
    assert long_run(s, 10) / len(s) == pytest.approx(np.eye(2), abs=0.15)


def test_a_moved_map_moves_the_sensor_times_by_what_was_asked() -> None:
    t = np.linspace(100, 400, 50)
    pair = Pair(sensor_s=t, sensor=t, reference_s=t, reference=t)
    clock = ClockMap(12.3, 1e-4)
    moved = pair.moved(clock, np.array([0.01, 0.002]))
    shift = moved.to_sensor(t) - clock.to_sensor(t)
    assert shift == pytest.approx(0.01 + 0.002 * np.linspace(-1, 1, 50), abs=1e-9)
    assert moved.to_sensor(moved.to_reference(t)) == pytest.approx(t, abs=1e-9)


def broad(t: np.ndarray, seed: int, highest_hz: float = 1.5) -> np.ndarray:
    """A sum of sines up to highest_hz: known at any instant."""
    rng = np.random.default_rng(seed)
    f, phase = rng.uniform(0.02, highest_hz, 60), rng.uniform(0, 2 * np.pi, 60)
    return np.sin(2 * np.pi * f * t[:, None] + phase).sum(axis=1)


def test_noise_free_clocks_are_recovered_to_a_millisecond() -> None:
    true = ClockMap(3.217, 150e-6)
    s, r = 0.1 * np.arange(2000), np.sort(np.random.default_rng(7).uniform(10, 195, 900))
    pair = Pair(
        sensor_s=s, sensor=broad(s, 8), reference_s=r, reference=2 * broad(true.to_sensor(r), 8) - 5
    )
    rough, _ = refine(pair, ClockMap(3.25, 0.0), width_s=0.2)
    fine = polish(pair, rough).clock
    at = np.array([20.0, 180.0])
    assert rough.to_reference(at) == pytest.approx(true.to_reference(at), abs=5e-3)
    assert fine.to_reference(at) == pytest.approx(true.to_reference(at), abs=1e-3)


def test_stated_uncertainties_hold_the_errors() -> None:
    z = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        true = ClockMap(float(rng.uniform(-5, 5)), float(rng.uniform(-2e-4, 2e-4)))
        s, r = 0.1 * np.arange(1500), np.sort(rng.uniform(10, 140, 650))
        pair = Pair(
            sensor_s=s,
            sensor=broad(s, seed) + 0.5 * rng.normal(size=len(s)),
            reference_s=r,
            reference=broad(true.to_sensor(r), seed) + 0.8 * rng.normal(size=len(r)),
        )
        got = polish(pair, true)
        middle = pair.middle_s
        error = got.clock.to_sensor(np.array([middle])) - true.to_sensor(np.array([middle]))
        z += [float(error[0]) / got.middle_std_s, (got.clock.drift - true.drift) / got.drift_std]
    assert 0.3 < np.sqrt(np.mean(np.square(z))) < 1.5  # 24 values, inflated by 1.5
