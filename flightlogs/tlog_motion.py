"""Motion channels in MAVLink telemetry: velocity, what was commanded, sticks, thrust, altitude.

POSITION_TARGET_LOCAL_NED.type_mask ignores, by bit: 1, 2, 4 position, 8, 16, 32 velocity.
"""

from collections.abc import Mapping

import numpy as np

from flightlogs.ardupilot import sticks_from_pulses
from flightlogs.channels import above_start, channel
from flightlogs.log import Channel, FloatArray
from flightlogs.table import Table

CM, MILLI, PERCENT = 0.01, 1e-3, 0.01
STICK_FULL = 1000.0  # MANUAL_CONTROL; 32767 is an axis that does not exist
NO_AXIS = 32767
RADIO_CHANNELS = 8
UINT16_MAX = 65535
IGNORE = {"x": 1, "y": 2, "z": 4, "vx": 8, "vy": 16, "vz": 32}

Timed = Mapping[str, tuple[Table, FloatArray]]


def _columns(table: Table, *labels: str) -> FloatArray:
    return np.column_stack([table.numbers[label] for label in labels])


def velocity(timed: Timed) -> Channel | None:
    """North, east, down [m/s] from LOCAL_POSITION_NED, else GLOBAL_POSITION_INT."""
    found = None
    if "LOCAL_POSITION_NED" in timed:
        table, time_s = timed["LOCAL_POSITION_NED"]
        values = _columns(table, "vx", "vy", "vz")
        found = channel(time_s, values, "LOCAL_POSITION_NED.vx,vy,vz")
    if found is None and "GLOBAL_POSITION_INT" in timed:
        table, time_s = timed["GLOBAL_POSITION_INT"]
        values = _columns(table, "vx", "vy", "vz") * CM
        found = channel(time_s, values, "GLOBAL_POSITION_INT.vx,vy,vz")
    return found


def velocity_setpoint(timed: Timed) -> Channel | None:
    """Commanded north, east, down [m/s], NaN where the mask ignores it."""
    return _target(timed, "POSITION_TARGET_LOCAL_NED", ("vx", "vy", "vz")) or _target(
        timed, "POSITION_TARGET_GLOBAL_INT", ("vx", "vy", "vz")
    )


def position_setpoint(timed: Timed) -> Channel | None:
    """Commanded north, east, down of the local origin [m], NaN where the mask ignores it."""
    return _target(timed, "POSITION_TARGET_LOCAL_NED", ("x", "y", "z"))


def _target(timed: Timed, name: str, labels: tuple[str, ...]) -> Channel | None:
    if name not in timed:
        return None
    table, time_s = timed[name]
    mask = table.numbers["type_mask"].astype(int)
    ignored = np.column_stack([mask & IGNORE[label] for label in labels]) > 0
    values = np.where(ignored, np.nan, _columns(table, *labels))
    return channel(time_s, values, f"{name}.{','.join(labels)}")


def sticks(timed: Timed, parameters: Mapping[str, float]) -> Channel | None:
    """Roll, pitch (forward), yaw in -1..1, throttle in 0..1; MANUAL_CONTROL, else the radio."""
    if "MANUAL_CONTROL" in timed:
        table, time_s = timed["MANUAL_CONTROL"]
        raw = _columns(table, "y", "x", "r", "z")
        values = np.where(raw == NO_AXIS, np.nan, raw / STICK_FULL)
        return channel(time_s, values, "MANUAL_CONTROL.y,x,r,z")
    for name in ("RC_CHANNELS", "RC_CHANNELS_RAW"):
        if name in timed:
            table, time_s = timed[name]
            pulses = _columns(table, *(f"chan{i + 1}_raw" for i in range(RADIO_CHANNELS)))
            pulses = np.where(pulses == UINT16_MAX, 0.0, pulses)
            found = channel(time_s, sticks_from_pulses(pulses, parameters), name)
            if found is not None:
                return found
    return None


def thrust(timed: Timed) -> Channel | None:
    """Collective throttle 0..1."""
    if "VFR_HUD" not in timed:
        return None
    table, time_s = timed["VFR_HUD"]
    return channel(time_s, table.numbers["throttle"] * PERCENT, "VFR_HUD.throttle")


def altitude(timed: Timed) -> Channel | None:
    """Above the first sample, up positive [m]."""
    if "LOCAL_POSITION_NED" in timed:
        table, time_s = timed["LOCAL_POSITION_NED"]
        return above_start(channel(time_s, -table.numbers["z"], "LOCAL_POSITION_NED.z"))
    if "GLOBAL_POSITION_INT" in timed:
        table, time_s = timed["GLOBAL_POSITION_INT"]
        height_m = table.numbers["relative_alt"] * MILLI
        return above_start(channel(time_s, height_m, "GLOBAL_POSITION_INT.relative_alt"))
    return None
