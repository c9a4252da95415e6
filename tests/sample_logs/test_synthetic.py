from itertools import pairwise

import numpy as np
import pytest

from sample_logs.airframe import LIGHT, S500
from sample_logs.instruments import (
    AutopilotFlaws,
    SensorFlaws,
    autopilot,
    sensor,
    to_flight_log,
)
from sample_logs.plan import Leg, leg_velocity, random_plan, steady_hover
from sample_logs.synthetic import STEP_s, fly
from segment.segment import Motion

AIRFRAMES = pytest.mark.parametrize("airframe", [S500, LIGHT], ids=lambda a: a.name)


def part(flight, span):
    return (flight.time_s >= span.start_s) & (flight.time_s < span.stop_s)


def test_equal_arguments_give_equal_flights_and_seeds_make_them_differ():
    one, same, other = fly(S500, seed=4), fly(S500, seed=4), fly(S500, seed=5)
    assert np.array_equal(one.current_A, same.current_A)
    assert one.truth == same.truth
    assert one.truth != other.truth


def test_two_hundred_flights_are_two_hundred_plans():
    plans = {random_plan(np.random.default_rng(k), LIGHT, 270.0) for k in range(200)}
    assert len(plans) == 200
    assert all(plan[0].motion is plan[-1].motion is Motion.HOVER for plan in plans)
    assert {round(sum(leg.duration_s for leg in plan)) for plan in plans} <= set(range(260, 281))


@AIRFRAMES
@pytest.mark.parametrize("seed", range(5))
def test_the_truth_adjoins_and_is_what_was_flown(airframe, seed):
    flight = fly(airframe, seed=seed)
    truth = flight.truth
    assert truth[0].start_s == 0
    assert truth[-1].stop_s == pytest.approx(flight.time_s[-1] + STEP_s)
    assert all(a.stop_s == b.start_s and a.motion is not b.motion for a, b in pairwise(truth))
    first, last = (Motion.GROUND, Motion.TAKEOFF, Motion.HOVER), (Motion.LANDING, Motion.GROUND)
    assert tuple(s.motion for s in truth[:3]) == first
    assert tuple(s.motion for s in truth[-2:]) == last
    for span in truth:
        speed = np.abs(flight.velocity_m_s[part(flight, span)])
        if span.motion is Motion.GROUND:
            assert speed.max() < 0.05  # a step or two around lift-off and touch-down
        if span.motion is Motion.VERTICAL:
            assert speed[:, 2].mean() > 0.5 > speed[:, :2].mean()
        if span.motion is Motion.HORIZONTAL:
            assert np.hypot(*speed[:, :2].T).mean() > 1.0 > speed[:, 2].mean()


@AIRFRAMES
def test_currents_are_those_of_the_paper(airframe):
    flight = fly(airframe, seed=1)
    air = flight.current_A[flight.in_air]
    if airframe is S500:  # arXiv:2603.12791: means of 16 A to 22 A
        assert 16 < air.mean() < 22
    assert air.max() > 2 * air.mean()
    assert flight.current_A.min() > 0.1
    assert flight.current_A[~flight.armed].max() < 1.0


def test_the_flight_lands_where_it_took_off_and_disarms():
    flight = fly(S500, seed=9)
    assert abs(flight.position_m[-1, 2]) < 1e-9
    assert not flight.armed[-1]
    assert not flight.in_air[-1]
    up = flight.position_m[:, 2] <= 1e-12
    assert up.all()  # down positive: never below ground


def test_a_stroke_begins_and_ends_at_rest_and_returns():
    leg = Leg(motion=Motion.VERTICAL, strokes=2, stroke_s=4.0, speed_m_s=2.0)
    velocity = leg_velocity(leg, STEP_s, 4.0)
    assert np.abs(velocity[[0, 199, 200, 399]]).max() < 0.1
    assert np.abs(velocity).max() == pytest.approx(2.0)
    assert velocity.sum(axis=0) == pytest.approx(0.0, abs=1e-9)


def test_a_square_comes_back_to_its_corner():
    leg = Leg(motion=Motion.HORIZONTAL, strokes=4, stroke_s=4.0, speed_m_s=5.0, turn_rad=np.pi / 2)
    assert leg_velocity(leg, STEP_s, 4.0).sum(axis=0) == pytest.approx(0.0, abs=1e-9)


def test_altitude_mode_commands_no_horizontal_velocity():
    flight = fly(S500, seed=2, altitude_mode=True)
    legs = part(flight, flight.truth[3])
    assert np.isnan(flight.velocity_setpoint_m_s[legs, :2]).all()
    assert np.isfinite(flight.velocity_setpoint_m_s[legs, 2]).all()
    assert flight.modes[1].name == "ALTCTL"


def test_the_sensor_sees_the_current_through_its_clock_and_converter():
    flight = fly(LIGHT, seed=3, plan=steady_hover(60.0))
    flaws = SensorFlaws(offset_s=-5.0, drift_ppm=150.0, noise_A=0.0, gain=1.1, bias_A=0.3)
    samples = sensor(flight, flaws, seed=0)
    at = samples.time_s * (1 + 150e-6) - 5.0
    inside = at >= 0
    true_A = np.interp(at[inside], flight.time_s, flight.current_A)
    error = samples.current_A[inside] - (1.1 * true_A + 0.3)
    assert np.abs(error).max() <= flaws.step_A / 2 + 1e-9
    assert at[-1] > flight.time_s[-1]


def test_the_share_of_missing_sensor_samples_is_the_one_asked_for():
    flight = fly(LIGHT, seed=3, plan=steady_hover(200.0))
    steps = np.diff(sensor(flight, SensorFlaws(missing=0.05), seed=1).time_s)
    assert np.mean(steps > 0.15) == pytest.approx(0.05, abs=0.015)


def test_the_autopilot_logs_at_its_rates_with_its_errors():
    flight = fly(S500, seed=6)
    flaws = AutopilotFlaws(gain=0.9, bias_A=0.5)
    seen = autopilot(flight, flaws, seed=0)
    assert np.median(np.diff(seen.battery_time_s)) == pytest.approx(0.2, abs=0.001)
    assert np.diff(seen.motion_time_s) == pytest.approx(0.1)
    expected = 0.9 * np.interp(seen.battery_time_s, flight.time_s, flight.current_A) + 0.5
    assert np.mean(seen.current_A - expected) == pytest.approx(0.0, abs=0.05)
    landed_s = seen.in_air[0].stop_s - flight.truth[-1].start_s
    assert landed_s == pytest.approx(flaws.landing_delay_s, abs=STEP_s)


def test_a_flight_log_without_a_file_holds_all_channels():
    flight = fly(LIGHT, seed=8)
    log = to_flight_log(flight, seed=8)
    (battery,) = log.batteries
    assert battery.series == 4
    drawn = np.trapezoid(battery.current_A, battery.time_s)
    assert battery.charge_C[-1] - battery.charge_C[0] == pytest.approx(drawn, rel=0.01)
    channels = (log.velocity_m_s, log.velocity_setpoint_m_s, log.position_setpoint_m, log.sticks)
    assert all(c.time_s.size == log.thrust.time_s.size for c in channels)
    assert len(log.in_air) == len(log.armed) == 1
