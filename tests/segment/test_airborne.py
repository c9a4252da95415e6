import numpy as np
import pytest

from segment.airborne import Airborne
from tests.segment.test_cut import still

N = 400
T = np.arange(N) * 0.1


def flight(*, climb_at=10.0, drift_m_s=0.0, current_A=None, flag=(5.0, 35.0)):
    """On the ground until `climb_at`, 1 m/s up for 3 s, down again 27 s to 30 s."""
    velocity = np.zeros((N, 3))
    velocity[(climb_at <= T) & (climb_at + 3 > T), 2] = -1.0
    velocity[(T >= 27) & (T < 30), 2] = 1.0
    velocity[:, 2] -= drift_m_s
    if current_A is None:
        current_A = np.where((climb_at <= T) & (T < 30), 20.0, 2.0)
    air = (flag[0] <= T) & (flag[1] > T)
    return still(N, velocity_m_s=velocity, current_A=current_A, in_air=air)


def span(mask):
    at = T[mask]
    return at[0], at[-1]


def test_a_flag_that_is_early_and_late_is_trimmed_to_climb_and_touch_down():
    start, stop = span(Airborne().find(flight()))
    assert start == pytest.approx(10.0, abs=0.3)  # 0.15 m at 1 m/s
    assert stop == pytest.approx(30.0, abs=0.3)


def test_a_hover_right_after_the_flag_is_no_standing_because_it_draws_the_current_of_flight():
    start, _ = span(Airborne().find(flight(current_A=np.full(N, 20.0))))
    assert start == 5.0


def test_a_drifting_estimator_does_not_lift_a_vehicle_that_draws_next_to_nothing():
    start, stop = span(Airborne().find(flight(drift_m_s=0.3)))
    assert start == pytest.approx(10.0, abs=1.0)  # the current's average is 2 s wide
    assert stop == pytest.approx(30.0, abs=1.0)


def test_a_hover_before_and_after_a_fast_flight_is_no_standing():
    """It draws 10 A, the climb 11.5, the flight between them 25: the median of all."""
    current = np.select(
        [T < 10, T < 12, T < 14, T < 28, T < 30], [0.5, 11.5, 10.0, 25.0, 10.0], 0.5
    )
    start, stop = span(Airborne().find(flight(current_A=current, flag=(8.0, 32.0))))
    assert start == pytest.approx(10.0, abs=0.3)
    assert stop == pytest.approx(30.0, abs=0.3)


def test_a_short_peak_of_motors_that_spin_up_is_no_lift_off():
    current = np.where((T >= 10) & (T < 30), 20.0, 2.0)
    current[(T >= 7) & (T < 7.3)] = 40.0
    start, _ = span(Airborne().find(flight(current_A=current)))
    assert start == pytest.approx(10.0, abs=0.3)


def test_a_blink_of_the_flag_is_bridged_and_a_landing_is_not():
    recording = flight(flag=(5.0, 35.0))
    blink, landing = recording.in_air.copy(), recording.in_air.copy()
    blink[200:205], landing[200:225] = False, False
    found = [Airborne().find(still(N, in_air=air)) for air in (blink, landing)]
    assert [bool(mask[200:205].any()) for mask in found] == [True, False]


def test_without_a_velocity_the_flag_stands():
    recording = still(N, velocity_m_s=None, in_air=T >= 5, current_A=np.where(T > 20, 20.0, 1.0))
    assert np.array_equal(Airborne().find(recording), T >= 5)


def test_a_log_that_begins_in_the_air_is_in_the_air_from_its_first_sample():
    recording = still(N, in_air=np.ones(N, dtype=bool), current_A=np.linspace(1, 30, N))
    assert Airborne().find(recording).all()
