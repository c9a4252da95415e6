import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs.recording import Recording
from sample_logs.airframe import LIGHT, S500
from sample_logs.plan import Leg, hover, steady_hover
from sample_logs.recorded import to_recording
from sample_logs.synthetic import fly
from segment import Basis, Motion, MotionDetector, cut
from segment.statistics import load_statistics
from tests.segment.judged import judge

SEEDS = range(10)  # with both airframes, 20 flights for each row below


@pytest.mark.parametrize(
    ("logged", "altitude_mode"),
    [
        pytest.param(("setpoint",), False, id="velocity setpoints"),
        pytest.param(("position",), False, id="position setpoints"),
        pytest.param(("setpoint",), True, id="altitude mode"),
        pytest.param((), False, id="measured velocity only"),
    ],
)
def test_cut_agrees_with_the_truth_of_twenty_flights(logged, altitude_mode):
    right, boundaries = [], []
    for airframe in (S500, LIGHT):
        for seed in SEEDS:
            flight = fly(airframe, seed=seed, altitude_mode=altitude_mode)
            found = judge(flight.truth, cut(to_recording(flight, seed=seed, logged=logged)))
            right.append(found.right)
            boundaries += found.boundaries_s
    assert min(right) >= 0.95
    assert np.median(boundaries) <= 0.5


def still(n=200, **changes):
    """A recording at 10 Hz that hovers from its first to its last sample."""
    base = Recording(
        name="still",
        battery="b",
        other_batteries=(),
        time_s=np.arange(n) * 0.1,
        current_A=np.full(n, 10.0),
        current_source="autopilot",
        voltage_V=np.full(n, 15.0),
        temperature_K=None,
        cell_voltage_V=None,
        velocity_m_s=np.zeros((n, 3)),
        velocity_setpoint_m_s=None,
        setpoint_source="",
        in_air=np.ones(n, dtype=bool),
        flight=None,
        series=4,
        series_inferred=False,
        capacity_C=None,
    )
    return dataclasses.replace(base, **changes)


def motions(recording, **settings):
    return [s.motion for s in cut(recording, MotionDetector(**settings))]


def test_a_log_that_begins_and_ends_in_the_air_has_neither_take_off_nor_landing():
    assert motions(still()) == [Motion.HOVER]


def test_without_a_velocity_the_motion_is_mixed_and_says_that_it_rests_on_nothing():
    air = np.arange(200) >= 50
    segments = cut(still(velocity_m_s=None, in_air=air))
    assert [(s.motion, s.basis) for s in segments] == [
        (Motion.GROUND, Basis.NONE),
        (Motion.MIXED, Basis.NONE),
    ]


def test_a_climb_rate_alone_does_not_tell_the_motion():
    velocity = np.zeros((200, 3))
    velocity[:, :2] = np.nan
    assert [s.basis for s in cut(still(velocity_m_s=velocity))] == [Basis.NONE]


def test_the_command_counts_where_it_and_the_velocity_differ():
    setpoint = np.zeros((200, 3))
    setpoint[100:, 2] = -1.0
    recording = still(velocity_setpoint_m_s=setpoint)
    assert [(s.motion, s.basis) for s in cut(recording)] == [
        (Motion.HOVER, Basis.SETPOINT),
        (Motion.VERTICAL, Basis.SETPOINT),
    ]


def test_an_axis_without_a_setpoint_falls_back_on_the_velocity_and_the_segment_says_so():
    setpoint, velocity = np.zeros((200, 3)), np.zeros((200, 3))
    setpoint[100:, :2] = np.nan
    velocity[100:, 0] = 3.0
    recording = still(velocity_setpoint_m_s=setpoint, velocity_m_s=velocity)
    assert [(s.motion, s.basis) for s in cut(recording)] == [
        (Motion.HOVER, Basis.SETPOINT),
        (Motion.HORIZONTAL, Basis.VELOCITY),
    ]


def test_a_turning_point_does_not_end_a_motion_and_a_correction_does_not_begin_one():
    velocity = np.zeros((200, 3))
    velocity[40:80, 2] = -1.0  # a rest of 1.5 s, then down again
    velocity[95:140, 2] = 1.0
    velocity[170:174, 0] = 2.0
    recording = still(velocity_m_s=velocity)
    assert motions(recording) == [Motion.HOVER, Motion.VERTICAL, Motion.HOVER]
    assert motions(recording, pause_s=0.5, shortest_s=0.0)[1:4] == [
        Motion.VERTICAL,
        Motion.HOVER,
        Motion.VERTICAL,
    ]


def test_a_slight_climb_does_not_make_a_fast_flight_mixed():
    velocity = np.zeros((200, 3))
    velocity[:, 0], velocity[:, 2] = 9.0, -0.6
    assert motions(still(velocity_m_s=velocity)) == [Motion.HORIZONTAL]
    assert motions(still(velocity_m_s=velocity), share=0.0) == [Motion.MIXED]


def test_a_long_climb_after_take_off_is_a_vertical_motion():
    velocity = np.zeros((400, 3))
    velocity[50:, 2] = -1.0
    recording = still(n=400, velocity_m_s=velocity, in_air=np.arange(400) >= 50)
    segments = cut(recording)
    assert [s.motion for s in segments] == [Motion.GROUND, Motion.TAKEOFF, Motion.VERTICAL]
    assert segments[1].duration_s == pytest.approx(MotionDetector().takeoff_max_s, abs=0.11)


def test_a_landing_begins_where_the_sideways_flight_ends():
    velocity = np.zeros((400, 3))
    velocity[100:300, 2] = 0.7
    velocity[60:200, 0] = 4.0
    recording = still(n=400, velocity_m_s=velocity, in_air=np.arange(400) < 300)
    found = [(s.motion, round(s.start_s, 1)) for s in cut(recording)]
    assert [motion for motion, _ in found] == [
        Motion.HOVER,
        Motion.HORIZONTAL,
        Motion.MIXED,
        Motion.LANDING,
        Motion.GROUND,
    ]
    assert found[3][1] == pytest.approx(20.0, abs=0.6)


def test_a_command_unknown_for_a_moment_is_followed_and_one_unknown_for_long_is_not():
    velocity = np.zeros((200, 3))
    velocity[100:115] = np.nan
    assert motions(still(velocity_m_s=velocity)) == [Motion.HOVER]
    velocity[100:130] = np.nan
    assert motions(still(velocity_m_s=velocity)) == [Motion.HOVER, Motion.MIXED, Motion.HOVER]


def test_take_off_ends_where_it_flies_away():
    velocity = np.zeros((400, 3))
    velocity[50:150, 2] = -1.5
    velocity[100:, 0] = 4.0
    recording = still(n=400, velocity_m_s=velocity, in_air=np.arange(400) >= 50)
    found = [(s.motion, round(s.start_s, 1)) for s in cut(recording)]
    assert found[1][0] is Motion.TAKEOFF
    assert found[2] == (Motion.MIXED, pytest.approx(10.0, abs=0.5))
    assert found[3] == (Motion.HORIZONTAL, pytest.approx(15.0, abs=0.5))


def test_no_segment_reaches_across_a_gap():
    time_s = np.arange(200) * 0.1
    time_s[100:] += 5.0
    first, second = cut(still(time_s=time_s))
    assert (first.start_s, first.stop_s) == pytest.approx((0.0, 9.9))
    assert (second.start_s, second.stop_s) == pytest.approx((15.0, 24.9))


def covers(recording, segments):
    assert segments[0].start_s == recording.time_s[0]
    assert segments[-1].stop_s == recording.time_s[-1]
    assert all(a.stop_s == b.start_s for a, b in pairwise(segments))
    assert all(s.duration_s > 0 for s in segments)


def test_segments_adjoin_cover_the_flight_and_share_out_its_whole_charge():
    recording = to_recording(fly(S500, seed=3), seed=3)
    segments = cut(recording)
    covers(recording, segments)
    whole = load_statistics(recording.time_s, recording.current_A, recording.voltage_V)
    assert sum(s.load.charge_C for s in segments) == pytest.approx(whole.charge_C, rel=1e-12)


PLAN = (
    hover(12.0),
    Leg(motion=Motion.VERTICAL, strokes=4, stroke_s=4.0, speed_m_s=2.0),
    hover(8.0),
    Leg(motion=Motion.HORIZONTAL, strokes=4, stroke_s=4.0, speed_m_s=4.0),
    hover(6.0),
)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 1000), st.floats(-1e4, 1e6))
def test_shifting_all_times_shifts_the_segments(seed, shift_s):
    recording = to_recording(fly(LIGHT, seed=seed, plan=PLAN), seed=seed)
    later = dataclasses.replace(recording, time_s=recording.time_s + shift_s)
    before, after = cut(recording), cut(later)
    assert [s.motion for s in after] == [s.motion for s in before]
    starts = np.array([s.start_s for s in before])
    assert [s.start_s for s in after] == pytest.approx(starts + shift_s, abs=1e-6)


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_any_recording_is_cut_into_adjoining_segments(data):
    n = data.draw(st.integers(2, 60))
    rng = np.random.default_rng(data.draw(st.integers(0, 9999)))
    velocity = rng.normal(0, data.draw(st.sampled_from([0.1, 1.0, 5.0])), (n, 3))
    velocity[rng.random((n, 3)) < data.draw(st.sampled_from([0.0, 0.3]))] = np.nan
    air = np.repeat(rng.random(n) < 0.7, 7)[:n]
    step = data.draw(st.sampled_from([0.1, 0.2, 1.0]))
    recording = still(n, time_s=np.arange(n) * step, velocity_m_s=velocity, in_air=air)
    covers(recording, cut(recording))


def test_a_steady_hover_flight_is_one_hover_between_take_off_and_landing():
    flight = fly(S500, seed=5, plan=steady_hover(60.0))
    names = [s.motion for s in cut(to_recording(flight, seed=5))]
    ground = Motion.GROUND
    assert names == [ground, Motion.TAKEOFF, Motion.HOVER, Motion.LANDING, ground]


def test_the_energy_runs_straight_between_the_voltages_that_were_measured() -> None:
    ramp_V = 16.0 - 0.01 * np.arange(201)
    place = np.arange(ramp_V.size)
    (whole,) = cut(still(ramp_V.size, voltage_V=ramp_V))
    (sparse,) = cut(still(ramp_V.size, voltage_V=np.where(place % 2, np.nan, ramp_V)))
    assert sparse.load.energy_J == pytest.approx(whole.load.energy_J, rel=1e-12)
    hole_V = np.where(np.abs(place - 100) < 20, np.nan, ramp_V)
    assert np.isnan(cut(still(ramp_V.size, voltage_V=hole_V))[0].load.energy_J)
