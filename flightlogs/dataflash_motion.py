"""Motion channels of an ArduCopter log: velocity, what was commanded, sticks, thrust, altitude."""

from collections.abc import Mapping, Sequence

import numpy as np

from flightlogs.ardupilot import MANUAL_THROTTLE, sticks_from_pulses
from flightlogs.channels import above_start, channel, during, held
from flightlogs.log import Channel, FloatArray, ModeSpan
from flightlogs.stamps import increasing
from flightlogs.table import Table

CM = 0.01
PERMILLE = 1e-3
FILTERS = ("XKF1", "NKF1", "EKF1")  # AHRS_EKF_TYPE 3, 2 and the filter before them
FIX_3D = 3
RADIO_CHANNELS = 8
PULSE_US = (1000.0, 2000.0)
MOTORS = 4

Timed = Mapping[str, tuple[Table, FloatArray]]


def _columns(table: Table, labels: Sequence[str]) -> FloatArray | None:
    if not all(label in table.numbers for label in labels):
        return None
    return np.column_stack([table.numbers[label] for label in labels])


def _first(table: Table, labels: Sequence[str]) -> tuple[FloatArray, str] | None:
    """The first of several names of one quantity that the table has."""
    found = next((label for label in labels if label in table.numbers), None)
    return (table.numbers[found], found) if found is not None else None


def _column_at(
    timed: Timed, name: str, labels: Sequence[str], at_s: FloatArray
) -> tuple[FloatArray, str] | None:
    """A column of another table, held to `at_s`, and its source; None if it is not logged."""
    if name not in timed:
        return None
    found = _first(timed[name][0], labels)
    if found is None:
        return None
    return held(timed[name][1], found[0], at_s), f"{name}.{found[1]}"


def velocity(timed: Timed, parameters: Mapping[str, float]) -> Channel | None:
    """North, east, down [m/s]: the navigation filter's, else of GPS, else the climb rate alone."""
    second = parameters.get("AHRS_EKF_TYPE") == 2
    for name in ("NKF1", "XKF1", "EKF1") if second else FILTERS:
        if name in timed:
            table, time_s = timed[name]
            core = table.numbers.get("C", np.zeros(len(table)))
            rows = core == np.min(core, initial=np.inf)  # one of several running side by side
            values = _columns(table, ("VN", "VE", "VD"))
            if values is not None:
                found = channel(time_s[rows], values[rows], f"{name}.VN,VE,VD")
                if found is not None:
                    return found
    return _gps_velocity(timed) or _climb_only(timed)


def _gps_velocity(timed: Timed) -> Channel | None:
    if "GPS" not in timed:
        return None
    table, time_s = timed["GPS"]
    polar = _columns(table, ("Spd", "GCrs", "Status"))
    if polar is None:
        return None
    speed, course, status = polar.T
    course = np.deg2rad(course)
    down = table.numbers.get("VZ")
    source = "GPS.Spd,GCrs,VZ"
    if down is None:
        climb = _column_at(timed, "CTUN", ("CRt", "CRate"), time_s)
        down = np.full(len(table), np.nan) if climb is None else -climb[0] * CM
        source = f"GPS.Spd,GCrs; {climb[1]}" if climb else "GPS.Spd,GCrs"
    values = np.column_stack([speed * np.cos(course), speed * np.sin(course), down])
    fixed = status >= FIX_3D
    values[~fixed] = np.nan
    return channel(time_s, values, source)


def _climb_only(timed: Timed) -> Channel | None:
    """(nan, nan, down): without GPS only the climb rate of the barometer is known."""
    if "CTUN" not in timed:
        return None
    table, time_s = timed["CTUN"]
    climb = _first(table, ("CRt", "CRate"))
    if climb is None:
        return None
    unknown = np.full(len(table), np.nan)
    return channel(time_s, np.column_stack([unknown, unknown, -climb[0] * CM]), f"CTUN.{climb[1]}")


# horizontal velocity commanded: (table, labels, factor to m/s); desired (the pilot's or the
# mission's) before target (which holds the position controller's correction as well)
NORTH = (("PSCN", ("DVN", "TVN"), 1.0), ("PSC", ("DVX", "TVX"), 1.0), ("NTUN", ("DVelX",), CM))
EAST = (("PSCE", ("DVE", "TVE"), 1.0), ("PSC", ("DVY", "TVY"), 1.0), ("NTUN", ("DVelY",), CM))
DOWN = (("PSCD", ("DVD", "TVD"), 1.0), ("CTUN", ("DCRt", "DCRate"), -CM))


def velocity_setpoint(timed: Timed, modes: Sequence[ModeSpan]) -> Channel | None:
    """Commanded north, east, down [m/s]; NaN where an axis is not controlled."""
    base = next((n for n in ("CTUN", "PSCD", "PSCN", "PSC", "NTUN") if n in timed), None)
    if base is None:
        return None
    at_s = timed[base][1]
    at_s = at_s[increasing(at_s)]
    axes, sources = [], []
    for choices in (NORTH, EAST, DOWN):
        values, source = _commanded(timed, choices, at_s)
        axes.append(values)
        sources += [source] if source else []
    axes[2] = np.where(during(at_s, modes, MANUAL_THROTTLE), np.nan, axes[2])
    return channel(at_s, np.column_stack(axes), ", ".join(sources))


def _commanded(
    timed: Timed, choices: Sequence[tuple[str, tuple[str, ...], float]], at_s: FloatArray
) -> tuple[FloatArray, str]:
    for name, labels, factor in choices:
        found = _column_at(timed, name, labels, at_s)
        if found is not None:
            return found[0] * factor, found[1]
    return np.full(at_s.shape, np.nan), ""


def sticks(timed: Timed, parameters: Mapping[str, float]) -> Channel | None:
    """Roll, pitch, yaw in -1..1 and throttle in 0..1 from RCIN."""
    if "RCIN" not in timed:
        return None
    table, time_s = timed["RCIN"]
    for prefix in ("C", "Chan", "Ch"):
        pulses = _columns(table, [f"{prefix}{i + 1}" for i in range(RADIO_CHANNELS)])
        if pulses is not None:
            return channel(time_s, sticks_from_pulses(pulses, parameters), "RCIN")
    return None


# 0..1000 under its old name, 0..1 under the new one; MOTB came later
THROTTLE = (("CTUN", "ThO", 1.0), ("CTUN", "ThrOut", PERMILLE), ("MOTB", "ThrOut", 1.0))


def thrust(timed: Timed) -> Channel | None:
    """Collective throttle after mixing, 0..1: CTUN, MOTB, else the mean of the motor outputs."""
    for name, label, factor in THROTTLE:
        if name in timed and label in timed[name][0].numbers:
            table, time_s = timed[name]
            return channel(time_s, table.numbers[label] * factor, f"{name}.{label}")
    return _motor_outputs(timed)


def _motor_outputs(timed: Timed) -> Channel | None:
    if "RCOU" not in timed:
        return None
    table, time_s = timed["RCOU"]
    for prefix in ("C", "Chan", "Ch"):
        pulses = _columns(table, [f"{prefix}{i + 1}" for i in range(MOTORS)])
        if pulses is not None:
            low, high = PULSE_US
            level = np.clip((np.mean(pulses, axis=1) - low) / (high - low), 0.0, 1.0)
            return channel(time_s, level, f"RCOU.{prefix}1-{MOTORS}")
    return None


def altitude(timed: Timed) -> Channel | None:
    """Above the first sample, up positive [m]."""
    for name, labels in (("CTUN", ("Alt", "BAlt", "BarAlt")), ("BARO", ("Alt",))):
        if name in timed:
            table, time_s = timed[name]
            found = _first(table, labels)
            if found is not None:
                return above_start(channel(time_s, found[0], f"{name}.{found[1]}"))
    return None
