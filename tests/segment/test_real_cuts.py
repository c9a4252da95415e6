"""Cuts of real logs, where a person can say from the velocities what they have to be."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from flightlogs.assemble import assemble
from flightlogs.read import read_log
from segment import Basis, Motion, cut

FLIGHTS = Path(__file__).parents[2] / ".." / "shared" / "flights"
PX4 = "AscendEngineering__UpgradeEnergy/test.ulg"
PX4_MANUAL = "FSYR-H__PX4_Ulog_Tools/log_123_2024-3-1-14-47-02.ulg"
PX4_MISSION = "dronecrew__px4tools/01_07_59.px4log"
LOITER = "dronekit__dronekit-la-testdata/log171.bin"
HAND_HELD = "BeastAyyG__ardupilot-log-diagnosis/log_0039_mechanical_failure.bin"
NO_VELOCITY = "1002victor__ardupilot/underpowered.log"


def segments(name):
    path = FLIGHTS / name
    if not path.exists():
        pytest.skip(f"needs the log {name} beside the project, in shared/flights")
    with path.open("rb") as stream:
        return cut(assemble(read_log(stream, name=path.name)))


def seconds(found, motion):
    return sum(s.duration_s for s in found if s.motion is motion)


def at(found, time_s):
    return next(s.motion for s in found if s.start_s <= time_s < s.stop_s)


def test_up_hover_and_down_again():
    found = segments(PX4)
    ground = Motion.GROUND
    assert [s.motion for s in found] == [
        ground,
        Motion.TAKEOFF,
        Motion.HOVER,
        Motion.LANDING,
        ground,
    ]
    assert {s.basis for s in found[1:4]} == {Basis.SETPOINT}
    starts = [s.start_s for s in found[1:]]
    assert starts == pytest.approx([3.2, 12.0, 16.6, 29.0], abs=0.7)


def test_motors_that_turn_on_the_ground_for_seconds_are_no_hover():
    found = segments(PX4_MANUAL)  # the flag rises at 1.8 s, the climb begins at 6.8 s
    assert [s.motion for s in found[:2]] == [Motion.GROUND, Motion.TAKEOFF]
    assert found[1].start_s == pytest.approx(6.5, abs=0.8)
    assert seconds(found, Motion.HOVER) == 0


def test_without_horizontal_setpoints_the_velocity_decides_and_says_so():
    found = segments(PX4_MANUAL)
    assert {s.basis for s in found if s.motion is not Motion.GROUND} == {Basis.VELOCITY}


def test_a_mission_with_waits_is_told_by_its_setpoints():
    found = segments(PX4_MISSION)
    assert [s.motion for s in found[:2]] == [Motion.GROUND, Motion.TAKEOFF]
    assert [s.motion for s in found[-2:]] == [Motion.LANDING, Motion.GROUND]
    assert [at(found, t) for t in (10.5, 19.0, 50.0)] == [
        Motion.HORIZONTAL,
        Motion.HOVER,
        Motion.HOVER,
    ]


def test_a_flight_to_and_fro_is_horizontal_with_its_steep_descent_vertical():
    found = segments(LOITER)
    assert [at(found, t) for t in (80, 105, 121, 135, 151, 165, 195)] == [
        Motion.HORIZONTAL,
        Motion.HORIZONTAL,
        Motion.HOVER,
        Motion.HORIZONTAL,
        Motion.VERTICAL,
        Motion.HORIZONTAL,
        Motion.HOVER,
    ]
    gaps = [b.start_s - a.stop_s for a, b in itertools.pairwise(found)]
    assert np.max(gaps) > 1.9  # the log lost 2.1 s: no segment reaches across


def test_the_drift_of_a_hover_by_hand_is_no_flight():
    found = segments(HAND_HELD)
    assert seconds(found, Motion.HOVER) > 2 * seconds(found, Motion.HORIZONTAL)
    assert at(found, 66.0) is Motion.HORIZONTAL  # 2 m/s


def test_a_log_without_horizontal_velocity_says_that_the_motion_is_not_known():
    found = segments(NO_VELOCITY)
    flown = [s for s in found if s.motion is not Motion.GROUND]
    assert {s.basis for s in flown} == {Basis.NONE}
    assert seconds(found, Motion.HOVER) == seconds(found, Motion.HORIZONTAL) == 0
