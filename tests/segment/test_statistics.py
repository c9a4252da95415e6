import numpy as np
import pytest

from segment.statistics import load_statistics, weighted_percentile


def test_a_ramp_has_its_exact_charge_energy_and_rms():
    t = np.linspace(0, 10, 11)
    i, v = 2 * t, 16 - 0.1 * t
    got = load_statistics(t, i, v)
    assert got.charge_C == pytest.approx(100.0, rel=1e-12)
    assert got.mean_A == pytest.approx(10.0, rel=1e-12)
    assert got.rms_A == pytest.approx(np.sqrt(400 / 3), rel=1e-12)
    assert got.energy_J == pytest.approx(2 * (16 * 50 - 0.1 * 1000 / 3), rel=1e-12)


def test_uneven_steps_weigh_by_time():
    t = np.array([0.0, 0.1, 0.2, 10.0])
    i = np.array([50.0, 50.0, 10.0, 10.0])
    got = load_statistics(t, i, np.full(4, 15.0))
    assert got.mean_A == pytest.approx((5 + 3 + 98) / 10)
    assert weighted_percentile(t, i, 50) == pytest.approx(10.0)


def test_energy_is_unknown_where_the_voltage_is():
    got = load_statistics(np.arange(3.0), np.ones(3), np.array([15.0, np.nan, 15.0]))
    assert np.isnan(got.energy_J)
    assert got.charge_C == 2.0


def test_ripple_is_what_a_moving_average_leaves():
    t = np.arange(0, 30, 0.1)
    slow = 15 + 0.1 * t
    quick = 0.8 * np.sqrt(2) * np.sin(2 * np.pi * 3.0 * t)
    got = load_statistics(t, slow + quick, np.full(t.size, 15.0))
    assert got.ripple_A == pytest.approx(0.8, rel=0.05)  # 2 s hold six waves, edges hold fewer
