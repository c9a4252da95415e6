"""Motion, commands and thrust of a PX4 log.

    topic                            field                              ours
    vehicle_local_position           vx, vy, vz (v_xy_valid, v_z_valid) velocity_m_s
    trajectory_setpoint              velocity[3], until 1.13 vx, vy, vz velocity_setpoint_m_s
    vehicle_local_position_setpoint  vx, vy, vz                         velocity_setpoint_m_s
    the same two                     position[3] or x, y, z             position_setpoint_m
    manual_control_setpoint          roll, pitch, yaw, throttle (-1..1) sticks, throttle to 0..1
      until 1.13                     y, x, r, z (0..1)                  sticks
    vehicle_air_data                 baro_alt_meter                     altitude_m
    vehicle_local_position           z (z_valid), down                  altitude_m, if no barometer
    see THRUST                                                          thrust

All in m, m/s, north, east, down; NaN: not controlled.
Source: PX4-Autopilot, msg/ of the releases 1.6 to 1.17.
"""

from collections.abc import Callable, Sequence

import numpy as np

from flightlogs.channels import during
from flightlogs.log import Channel, FloatArray, ModeSpan
from flightlogs.px4_topics import Px4Topics, Samples

VELOCITY = ("vx", "vy", "vz")
SETPOINTS = ("trajectory_setpoint", "vehicle_local_position_setpoint")
VELOCITY_LAYOUTS = (("velocity[0]", "velocity[1]", "velocity[2]"), VELOCITY)
POSITION_LAYOUTS = (("position[0]", "position[1]", "position[2]"), ("x", "y", "z"))
STICKS = ("roll", "pitch", "yaw", "throttle")
OLD_STICKS = ("y", "x", "r", "z")
NO_HORIZONTAL_SETPOINT = frozenset(["ALTCTL"])
SIMILAR = 0.9  # of two setpoints the pilot's own is taken unless it says clearly less
MOTORS = 12  # length of actuator_motors.control
OUTPUTS = 16  # length of actuator_outputs.output
PWM_US = (800.0, 2200.0)  # outputs outside are not servo pulses
IDLE_US, SPAN_US = 1000.0, 1000.0
LEAST_THRUST_RANGE = 0.02  # a thrust that never moves by more is not the thrust


def velocity(topics: Px4Topics) -> Channel | None:
    """(n, 3) measured by the estimator; NaN where it says that it is not valid."""
    samples = topics.measured("vehicle_local_position")
    values = None if samples is None else samples.matrix(VELOCITY)
    if samples is None or values is None:
        return None
    for flag, columns in (("v_xy_valid", slice(0, 2)), ("v_z_valid", slice(2, 3))):
        valid = samples.get(flag)
        if valid is not None:
            values[valid == 0, columns] = np.nan
    return samples.channel(values, ",".join(VELOCITY))


def velocity_setpoint(topics: Px4Topics, modes: Sequence[ModeSpan]) -> Channel | None:
    """(n, 3) as commanded: what pilot or mission ask for, else what the position control adds."""
    return _setpoint(topics, modes, VELOCITY_LAYOUTS)


def position_setpoint(topics: Px4Topics, modes: Sequence[ModeSpan]) -> Channel | None:
    """(n, 3) as commanded."""
    return _setpoint(topics, modes, POSITION_LAYOUTS)


def _setpoint(
    topics: Px4Topics, modes: Sequence[ModeSpan], layouts: tuple[tuple[str, ...], ...]
) -> Channel | None:
    """Of the topic that says most; firmware until 1.7 writes 0 for what an altitude mode leaves."""
    found: list[tuple[float, Channel]] = []
    for name in SETPOINTS:
        samples = topics.measured(name)
        for fields in layouts:
            values = None if samples is None else samples.matrix(fields)
            if samples is None or values is None:
                continue
            idle = during(samples.time_s, modes, NO_HORIZONTAL_SETPOINT)
            idle &= (values[:, :2] == 0).all(axis=1)
            values[idle, :2] = np.nan
            channel = samples.channel(values, ",".join(fields))
            if channel is not None:
                found.append((float(np.isfinite(values).sum()) / 3, channel))
    if not found:
        return None
    most = max(known for known, _ in found)
    return next(channel for known, channel in found if known >= SIMILAR * most)


def sticks(topics: Px4Topics) -> Channel | None:
    """(n, 4) roll, pitch, yaw in -1..1, throttle in 0..1; NaN while there is no pilot."""
    samples = topics.measured("manual_control_setpoint")
    if samples is None:
        return None
    values = samples.matrix(STICKS)
    if values is not None:
        values[:, 3] = (values[:, 3] + 1) / 2
    else:
        values = samples.matrix(OLD_STICKS)
    if values is None:
        return None
    valid = samples.get("valid")
    if valid is not None:
        values[valid == 0] = np.nan
    limits = np.array([[-1.0, -1.0, -1.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    return samples.channel(np.clip(values, *limits), ",".join(STICKS))


def altitude(topics: Px4Topics) -> Channel | None:
    """(n,) above the first sample: by barometer, which an estimator that diverges leaves alone."""
    for name, field, sign, flag in (
        ("vehicle_air_data", "baro_alt_meter", 1.0, ""),
        ("sensor_combined", "baro_alt_meter", 1.0, ""),
        ("vehicle_local_position", "z", -1.0, "z_valid"),
    ):
        samples = topics.measured(name)
        values = None if samples is None else samples.get(field)
        if samples is None or values is None:
            continue
        valid = samples.get(flag)
        up = sign * values if valid is None else np.where(valid != 0, sign * values, np.nan)
        known = np.flatnonzero(np.isfinite(up))
        if known.size:
            return samples.channel(up - up[known[0]], field)
    return None


def thrust(topics: Px4Topics) -> Channel | None:
    """(n,) 0..1, from the first source in THRUST that moves."""
    for name, fields, read in THRUST:
        samples = topics.measured(name)
        values = None if samples is None else read(samples)
        if samples is None or values is None:
            continue
        known = values[np.isfinite(values)]
        if known.size and np.ptp(known) > LEAST_THRUST_RANGE:
            return samples.channel(np.clip(values, 0.0, 1.0), fields)
    return None


def _down_to_up(field: str) -> Callable[[Samples], FloatArray | None]:
    def read(samples: Samples) -> FloatArray | None:
        values = samples.get(field)
        return None if values is None else -values

    return read


def _motors(samples: Samples) -> FloatArray | None:
    return _mean_used([samples.get(f"control[{i}]") for i in range(MOTORS)])


def _pulses(samples: Samples) -> FloatArray | None:
    columns = []
    for i in range(OUTPUTS):
        pulse = samples.get(f"output[{i}]")
        if pulse is not None and np.all((pulse > PWM_US[0]) & (pulse < PWM_US[1])):
            columns.append((pulse - IDLE_US) / SPAN_US)
    return _mean_used(list(columns))


def _mean_used(columns: list[FloatArray | None]) -> FloatArray | None:
    """(n,) mean of the columns that ever move; unused outputs are NaN or constant."""
    used = [c for c in columns if c is not None and np.unique(c[np.isfinite(c)]).size > 1]
    return np.mean(used, axis=0) if used else None


THRUST: tuple[tuple[str, str, Callable[[Samples], FloatArray | None]], ...] = (
    ("vehicle_thrust_setpoint", "xyz[2]", _down_to_up("xyz[2]")),
    ("vehicle_attitude_setpoint", "thrust_body[2]", _down_to_up("thrust_body[2]")),
    ("vehicle_attitude_setpoint", "thrust", lambda samples: samples.get("thrust")),
    ("actuator_controls_0", "control[3]", lambda samples: samples.get("control[3]")),
    ("actuator_motors", "control", _motors),
    ("actuator_outputs", "output", _pulses),
)
