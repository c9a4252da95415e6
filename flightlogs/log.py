"""`FlightLog`: what a log says, channel by channel, in SI, before any choice is made."""

from dataclasses import dataclass, fields
from datetime import datetime
from enum import Enum

import numpy as np
import numpy.typing as npt

from flightlogs.errors import LogError, LogWarning

FloatArray = npt.NDArray[np.float64]


def frozen_array(values: npt.ArrayLike) -> FloatArray:
    """Our own read-only float copy of `values`."""
    out = np.array(values, dtype=float)
    out.flags.writeable = False
    return out


def check_increasing(time_s: FloatArray, owner: str) -> None:
    """LogError unless `time_s` (n,) is finite and strictly increasing."""
    if time_s.ndim != 1 or not np.all(np.isfinite(time_s)):
        raise LogError(f"{owner}: time_s must be one-dimensional and finite")
    if (stuck := np.flatnonzero(np.diff(time_s) <= 0)).size:
        i = int(stuck[0]) + 1
        raise LogError(
            f"{owner}: time_s[{i}] = {time_s[i]} does not exceed {time_s[i - 1]} "
            f"({stuck.size} such steps): run clock.repair() on the raw stamps"
        )


class Vehicle(Enum):
    """Kind of airframe, as the log declares it."""

    MULTIROTOR = "multirotor"
    HELICOPTER = "helicopter"
    FIXED_WING = "fixed_wing"
    VTOL = "vtol"
    OTHER = "other"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Channel:
    """One quantity at its own rate; NaN where a sample was not measured.

    Attributes:
        time_s: (n,) since the first sample of the log, strictly increasing.
        values: (n,) or (n, k), SI.
        source: the logged topic and field, e.g. `vehicle_local_position.vx,vy,vz`.
    """

    time_s: FloatArray
    values: FloatArray
    source: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_s", frozen_array(self.time_s))
        object.__setattr__(self, "values", frozen_array(self.values))
        check_increasing(self.time_s, self.source)
        if self.values.shape[:1] != self.time_s.shape:
            raise LogError(f"{self.source}: {self.values.shape} values, {self.time_s.shape} times")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BatteryLog:
    """One battery as the autopilot recorded it; sentinels are already NaN, absent channels None.

    Attributes:
        instance: index the user names with `--battery` (0-based order of appearance in the log).
        label: how the log calls it, e.g. `battery_status[0], id 1`.
        time_s: (n,) since the first sample of the log, strictly increasing.
        current_A: (n,) discharge positive; None if never measured (a sentinel or 0 throughout).
        voltage_V: (n,) at the pack terminals, or None.
        temperature_K: (n,) measured pack temperature, or None.
        cell_voltage_V: (n, cells), or None.
        charge_C: (n,) the log's own charge counter (only differences mean anything), or None.
        series: cells in series if the log says so (topic or parameter), else None.
        capacity_C: from the log's parameters, else None.
        serial: the pack's own serial number, or "".
        current_source: topic and field the current came from.
    """

    instance: int
    label: str
    time_s: FloatArray
    current_A: FloatArray | None
    voltage_V: FloatArray | None
    temperature_K: FloatArray | None = None
    cell_voltage_V: FloatArray | None = None
    charge_C: FloatArray | None = None
    series: int | None = None
    capacity_C: float | None = None
    serial: str = ""
    current_source: str = ""

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, f.name, frozen_array(value))
                if value.shape[:1] != self.time_s.shape:
                    raise LogError(
                        f"{self.label}: {f.name} {value.shape}, {self.time_s.shape} times"
                    )
        check_increasing(self.time_s, self.label)


@dataclass(frozen=True, slots=True)
class Interval:
    """Half-open time span [start_s, stop_s) on the log's clock."""

    start_s: float
    stop_s: float

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return self.stop_s - self.start_s


@dataclass(frozen=True, slots=True)
class ModeSpan:
    """A stretch in one flight mode, and what the sticks or the mission command in it.

    Attributes:
        start_s: start on the log's clock.
        stop_s: end on the log's clock.
        name: the autopilot's own name, e.g. `POSCTL`, `LOITER`, `AUTO_MISSION`.
    """

    start_s: float
    stop_s: float
    name: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlightLog:
    """All of a log that matters to the battery, channels at their own rates.

    Attributes:
        name: file name, for messages.
        format: `ulog`, `tlog`, `dataflash`, `dataflash_text` or `px4log`.
        firmware: e.g. `PX4 1.14.0` or `ArduCopter V3.4.6`, "" if unknown.
        hardware: autopilot board, "" if unknown.
        vehicle: kind of airframe.
        vehicle_label: what it was judged by, e.g. `SYS_AUTOSTART 4001`.
        simulated: a SITL or HIL log.
        start_utc: aware time of the first sample, or None.
        duration_s: from the first to the last sample of the data (stray stamps ignored).
        batteries: in order of appearance.
        velocity_m_s: (n, 3) north, east, down, or None.
        velocity_setpoint_m_s: (n, 3) commanded north, east, down; NaN where not controlled.
        position_setpoint_m: (n, 3) commanded north, east, down; NaN where not controlled.
        sticks: (n, 4) roll, pitch, yaw in -1..1 and throttle in 0..1, or None.
        thrust: (n,) collective thrust or mean motor output in 0..1, or None.
        altitude_m: (n,) above the start, up positive, or None.
        modes: flight modes in time order.
        armed: spans in which the motors were armed, in time order.
        in_air: spans in the air as the autopilot judged it; None if the log has no such channel.
        board_K: coldest that the autopilot's barometer was, or None.
        parameters: autopilot parameters that matter here (battery scale, cells, capacity).
        dropouts_s: total time the logger says it lost.
        recovered_fraction: share of the file's bytes that could be decoded, 0..1.
        warnings: everything doubtful or repaired, counted.
    """

    name: str
    format: str
    firmware: str
    hardware: str
    vehicle: Vehicle
    vehicle_label: str
    simulated: bool
    start_utc: datetime | None
    duration_s: float
    batteries: tuple[BatteryLog, ...]
    velocity_m_s: Channel | None = None
    velocity_setpoint_m_s: Channel | None = None
    position_setpoint_m: Channel | None = None
    sticks: Channel | None = None
    thrust: Channel | None = None
    altitude_m: Channel | None = None
    modes: tuple[ModeSpan, ...] = ()
    armed: tuple[Interval, ...] = ()
    in_air: tuple[Interval, ...] | None = None
    board_K: float | None = None
    parameters: tuple[tuple[str, float], ...] = ()
    dropouts_s: float = 0.0
    recovered_fraction: float = 1.0
    warnings: tuple[LogWarning, ...] = ()
