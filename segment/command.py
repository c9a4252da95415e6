"""What motion was commanded at each sample: setpoint, else position, else sticks, else measured."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flightlogs.recording import Recording
from segment.runs import BoolArray, FloatArray
from segment.segment import Basis

BASES = (Basis.SETPOINT, Basis.POSITION_SETPOINT, Basis.STICKS, Basis.VELOCITY, Basis.NONE)
"""From the best to the worst: `Command.basis` holds indices into this."""

NONE = BASES.index(Basis.NONE)

CLIMB_BY_STICK = ("ALTCTL", "POSCTL", "ALT_HOLD", "ALTHOLD", "POSHOLD", "LOITER")
"""Modes in which the throttle stick commands a climb rate (PX4; ArduCopter)."""

SPEED_BY_STICK = ("POSCTL", "LOITER")
"""Modes in which roll and pitch command a speed; elsewhere they command a tilt."""

STEP_m_s = 30.0  # no multirotor's trajectory runs faster: such a step is a jump of the command


AHEAD_m, AHEAD_m_s2 = 3.0, 5.0
"""By what a trajectory goes further than the vehicle from one sample to the next, at most: the
second where samples are far apart, and it speeds up meanwhile. A waypoint goes as far at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sticks:
    """How stick deflections map to commanded speed.

    Attributes:
        dead: deflection without effect (PX4 MPC_HOLD_DZ 0.1, ArduCopter THR_DZ 0.1).
        climb_m_s: at full throttle (PX4 MPC_Z_VEL_MAX_UP 3, ArduCopter PILOT_SPEED_UP 2.5).
        speed_m_s: at full roll or pitch (PX4 MPC_VEL_MANUAL 10, ArduCopter LOIT_SPEED 12.5).
    """

    dead: float = 0.1
    climb_m_s: float = 3.0
    speed_m_s: float = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Command:
    """Velocity commanded (or measured, where no command is known) at each sample.

    Attributes:
        velocity_m_s: (n, 3) north, east, down; with Basis.STICKS north and east are forward and
            right; NaN where nothing is known.
        vertical_basis: (n,) indices into BASES.
        horizontal_basis: (n,) indices into BASES.
    """

    velocity_m_s: FloatArray
    vertical_basis: npt.NDArray[np.int64]
    horizontal_basis: npt.NDArray[np.int64]

    def basis(self) -> npt.NDArray[np.int64]:
        """(n,) the worse of the two axes' bases: what a motion, which needs both, rests on."""
        return np.maximum(self.vertical_basis, self.horizontal_basis)


def commanded(recording: Recording, sticks: Sticks) -> Command:
    """The best known command of each axis at each sample, and what it is.

    Vertical and horizontal are decided apart: in altitude mode the first is commanded, the second
    is not, and only the measured velocity tells it.
    """
    shape = (recording.time_s.size, 3)
    unknown = np.full(shape, np.nan)
    stick = _by_stick(recording, sticks)
    setpoint, measured = recording.velocity_setpoint_m_s, recording.velocity_m_s
    sources = (
        unknown if setpoint is None else setpoint,
        _position_rate(recording),
        unknown if stick is None else stick,
        unknown if measured is None else measured,
    )
    horizontal = np.full(shape[0], NONE, dtype=np.int64)
    vertical = horizontal.copy()
    velocity = unknown.copy()
    for rank, source in reversed(list(enumerate(sources))):
        both = np.isfinite(source[:, :2]).all(axis=1)
        down = np.isfinite(source[:, 2])
        velocity[both, :2], velocity[down, 2] = source[both, :2], source[down, 2]
        horizontal[both], vertical[down] = rank, rank
    return Command(velocity_m_s=velocity, vertical_basis=vertical, horizontal_basis=horizontal)


def _position_rate(recording: Recording) -> FloatArray:
    """(n, 3) central difference of the commanded position, NaN where it is not a trajectory.

    Older firmware commands waypoints in jumps: the vehicle flies while the command stands still.
    An axis whose command ever jumps is not used at all.
    """
    time_s, position = recording.time_s, recording.position_setpoint_m
    out = np.full((time_s.size, 3), np.nan)
    if position is None or time_s.size < 3:
        return out
    dt = np.diff(time_s)[:, None]
    step = np.diff(position, axis=0) / dt
    out[1:-1] = (position[2:] - position[:-2]) / (dt[1:] + dt[:-1])
    out[0], out[-1] = step[0], step[-1]
    jumps = np.abs(np.nan_to_num(step)) > STEP_m_s
    if recording.velocity_m_s is not None:
        flown = (recording.velocity_m_s[1:] + recording.velocity_m_s[:-1]) / 2
        ahead = np.nan_to_num(np.abs(step) - np.abs(flown)) * dt
        jumps |= ahead > np.maximum(AHEAD_m, AHEAD_m_s2 * dt**2)
    out[:, jumps.any(axis=0)] = np.nan
    return out


def _by_stick(recording: Recording, sticks: Sticks) -> FloatArray | None:
    """(n, 3) forward, right, down speed that the sticks ask for in the modes that map them so."""
    if recording.sticks is None:
        return None
    time_s, channel = recording.time_s, recording.sticks
    known = np.isfinite(channel.values).all(axis=1)
    if not known.any():
        return None
    at, values = channel.time_s[known], channel.values[known]
    held = values[np.clip(np.searchsorted(at, time_s, side="right") - 1, 0, None)]
    roll, pitch = _beyond(held[:, 0], sticks.dead), _beyond(held[:, 1], sticks.dead)
    throttle = _beyond(2 * held[:, 3] - 1, sticks.dead)
    speed, climb = (_in_mode(recording, modes) for modes in (SPEED_BY_STICK, CLIMB_BY_STICK))
    out = np.column_stack(
        [pitch * sticks.speed_m_s, roll * sticks.speed_m_s, -throttle * sticks.climb_m_s]
    )
    out[~speed, :2] = np.nan
    out[~climb, 2] = np.nan
    return out


def _beyond(deflection: FloatArray, dead: float) -> FloatArray:
    past = np.maximum(np.abs(deflection) - dead, 0.0) / (1 - dead)
    return np.asarray(np.sign(deflection) * np.minimum(past, 1.0))


def _in_mode(recording: Recording, names: tuple[str, ...]) -> BoolArray:
    out = np.zeros(recording.time_s.size, dtype=bool)
    for span in recording.modes:
        if span.name.upper() in names:
            out |= (recording.time_s >= span.start_s) & (recording.time_s < span.stop_s)
    return out
