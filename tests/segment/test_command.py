import numpy as np
import pytest

from flightlogs.log import Channel, ModeSpan
from segment.command import BASES, Sticks, commanded
from segment.segment import Basis
from tests.segment.test_cut import still

SETPOINT, POSITION, STICKS, VELOCITY, NONE = range(5)


def sticks_of(n, **axes):
    values = np.tile([0.0, 0.0, 0.0, 0.5], (n, 1))
    for k, name in enumerate(("roll", "pitch", "yaw", "throttle")):
        values[:, k] = axes.get(name, values[:, k])
    return Channel(time_s=np.arange(n) * 0.1, values=values, source="sticks")


def test_bases_are_ranked_from_setpoint_to_none():
    expected = ["setpoint", "position_setpoint", "sticks", "velocity", "none"]
    assert [b.value for b in BASES] == expected
    assert set(BASES) == set(Basis)


def test_the_rate_of_the_commanded_position_is_a_command():
    position = np.zeros((200, 3))
    position[:, 0] = 2.5 * np.arange(200) * 0.1
    command = commanded(still(position_setpoint_m=position), Sticks())
    assert command.velocity_m_s[:, 0] == pytest.approx(2.5)
    assert set(command.basis().tolist()) == {POSITION}


def test_a_position_command_in_jumps_is_no_trajectory():
    position = np.zeros((200, 3))
    position[100:, 0] = 20.0
    velocity = np.full((200, 3), 3.0)
    command = commanded(still(position_setpoint_m=position, velocity_m_s=velocity), Sticks())
    assert set(command.horizontal_basis.tolist()) == {VELOCITY}
    assert set(command.vertical_basis[:-1].tolist()) == {POSITION}


@pytest.mark.parametrize(
    ("step_s", "jump_m", "every_s"), [(0.2, 5.0, 4.0), (0.5, 14.0, 5.0), (1.0, 20.0, 6.0)]
)
def test_waypoints_are_jumps_however_far_apart_samples_are(
    step_s: float, jump_m: float, every_s: float
) -> None:
    """None is faster than a vehicle may be from sample to sample; no vehicle was there at once."""
    time_s = np.arange(200) * step_s
    position, velocity = np.zeros((200, 3)), np.zeros((200, 3))
    position[:, 0] = jump_m * (time_s // every_s)
    after_s = time_s % every_s
    velocity[:, 0] = np.where(
        (after_s < every_s / 2) & (time_s >= every_s), jump_m / every_s * 2, 0
    )
    velocity[after_s == 0, 0] = 0.0
    slow = still(time_s=time_s, position_setpoint_m=position, velocity_m_s=velocity)
    assert set(commanded(slow, Sticks()).horizontal_basis.tolist()) == {VELOCITY}


@pytest.mark.parametrize("step_s", [0.1, 1.0, 2.0])
def test_a_trajectory_that_speeds_up_is_one_though_the_vehicle_lags(step_s: float) -> None:
    time_s = np.arange(200) * step_s
    speed = 6.0 * np.clip(np.sin(time_s / 4.0), 0.0, None)
    position, velocity = np.zeros((200, 3)), np.zeros((200, 3))
    position[:, 0] = np.cumsum(speed) * step_s
    velocity[:, 0] = np.interp(time_s - 0.5, time_s, speed)
    flown = still(time_s=time_s, position_setpoint_m=position, velocity_m_s=velocity)
    assert set(commanded(flown, Sticks()).basis().tolist()) == {POSITION}


def test_a_held_position_stands_in_where_no_velocity_is_commanded():
    setpoint = np.full((200, 3), np.nan)
    setpoint[:100] = 1.0
    recording = still(velocity_setpoint_m_s=setpoint, position_setpoint_m=np.zeros((200, 3)))
    command = commanded(recording, Sticks())
    assert command.velocity_m_s[50].tolist() == [1.0, 1.0, 1.0]
    assert command.velocity_m_s[150].tolist() == [0.0, 0.0, 0.0]
    assert command.basis()[[50, 150]].tolist() == [SETPOINT, POSITION]


def test_sticks_command_speeds_in_position_mode_climbs_in_altitude_mode_and_tilts_elsewhere():
    modes = (
        ModeSpan(0.0, 5.0, "POSCTL"),
        ModeSpan(5.0, 10.0, "ALTCTL"),
        ModeSpan(10.0, 20.0, "STABILIZED"),
    )
    recording = still(modes=modes, sticks=sticks_of(200, pitch=1.0, throttle=1.0))
    command = commanded(recording, Sticks(climb_m_s=3.0, speed_m_s=10.0))
    assert command.velocity_m_s[20].tolist() == [10.0, 0.0, -3.0]
    assert command.velocity_m_s[70].tolist() == [0.0, 0.0, -3.0]
    assert command.horizontal_basis[[20, 70, 150]].tolist() == [STICKS, VELOCITY, VELOCITY]
    assert command.vertical_basis[[20, 70, 150]].tolist() == [STICKS, STICKS, VELOCITY]


def test_sticks_inside_the_dead_band_command_nothing():
    modes = (ModeSpan(0.0, 20.0, "LOITER"),)
    recording = still(modes=modes, sticks=sticks_of(200, roll=0.09, throttle=0.54))
    assert not commanded(recording, Sticks()).velocity_m_s.any()


def test_sticks_that_were_never_measured_command_nothing():
    modes = (ModeSpan(0.0, 20.0, "LOITER"),)
    nothing = sticks_of(200, roll=np.full(200, np.nan))
    command = commanded(still(modes=modes, sticks=nothing), Sticks())
    assert set(command.basis().tolist()) == {VELOCITY}
