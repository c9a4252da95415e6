"""MAVLink telemetry logs (`.tlog`) from plain arrays, packed by pymavlink's own dialect.

    write_tlog(out, streams, start_unix_s=...) -> bytes written       out: a path or a binary stream

A `Stream(message, time_s, fields)` is one message type: `fields` maps each field to a scalar or to
(n,) or (n, k) values, in the units of the MAVLink definition. Packets of all streams are merged by
time. Each record is the 8-byte big-endian UNIX time in microseconds, then the packet (MAVLink 2).

Ready-made streams (SI in, times in s since the start of the log, which is also `time_boot_ms` 0):

    heartbeat(time_s, armed, custom_mode, autopilot=PX4, vehicle=QUADROTOR)
    extended_state(time_s, landed_state)            1 on ground, 2 in air, 3 take-off, 4 landing
    battery_status(PackTrace(...), battery_id=0)    NaN is written as not measured
    sys_status(time_s, voltage_V, current_A)
    local_position(time_s, position_m, velocity_m_s)            (n, 3) north, east, down
    velocity_target(time_s, velocity_m_s)           POSITION_TARGET_LOCAL_NED; NaN: ignore bit
    system_time(time_s, start_unix_s)
    parameter(time_s, name, value)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sample_logs.pack_trace import PackTrace

PX4 = 12
ARDUPILOT = 3
QUADROTOR = 2
ARMED_BIT, CUSTOM_MODE_BIT = 128, 1
NOT_MEASURED_INT16, NOT_MEASURED_UINT16 = 32767, 65535
CELLS = 10
IGNORE_POSITION, IGNORE_ACCELERATION, IGNORE_YAW = 0b111, 0b111 << 6, 0b11 << 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Stream:
    """One message type from one sender.

    Attributes:
        message: MAVLink name, e.g. `BATTERY_STATUS`.
        time_s: (n,) since the start of the log.
        fields: field -> scalar, (n,) or (n, k), in MAVLink's units; every base field is needed.
        system: sender's system id.
        component: sender's component id.
    """

    message: str
    time_s: npt.ArrayLike
    fields: Mapping[str, Any]
    system: int = 1
    component: int = 1

    def packets(self) -> list[Any]:
        """One pymavlink message a row."""
        n = np.size(self.time_s)
        build = getattr(mavlink, f"MAVLink_{self.message.lower()}_message")
        columns = {k: _column(v, n) for k, v in self.fields.items()}
        return [build(**{k: v[i] for k, v in columns.items()}) for i in range(n)]


def _column(values: Any, n: int) -> list[Any]:
    if isinstance(values, str | bytes | int | float):
        return [values.encode() if isinstance(values, str) else values] * n
    rows = np.asarray(values).tolist()
    if len(rows) != n:
        raise ValueError(f"{len(rows)} values for {n} times")
    return list(rows)


def write_tlog(out: Path | BinaryIO, streams: Sequence[Stream], *, start_unix_s: float) -> int:
    """Write the log; returns the bytes written. Rows at equal times keep the streams' order."""
    rows = [(s, packet) for s in streams for packet in s.packets()]
    times = np.concatenate([np.zeros(0), *(np.atleast_1d(s.time_s) for s in streams)])
    link = mavlink.MAVLink(None)
    parts = []
    for k in np.argsort(times, kind="stable"):
        stream, packet = rows[k]
        link.srcSystem, link.srcComponent = stream.system, stream.component
        stamp_us = round((start_unix_s + float(times[k])) * 1e6)
        parts += [stamp_us.to_bytes(8, "big"), bytes(packet.pack(link))]
        link.seq = (link.seq + 1) % 256
    content = b"".join(parts)
    return out.write_bytes(content) if isinstance(out, Path) else out.write(content)


def _counts(values: npt.ArrayLike, factor: float, unknown: int) -> npt.NDArray[np.int64]:
    scaled = np.asarray(values, dtype=float) * factor
    return np.where(np.isfinite(scaled), np.rint(np.nan_to_num(scaled)), unknown).astype(np.int64)


def _boot_ms(time_s: npt.ArrayLike) -> npt.NDArray[np.int64]:
    return _counts(time_s, 1e3, 0)


def heartbeat(
    time_s: npt.ArrayLike,
    armed: npt.ArrayLike,
    custom_mode: npt.ArrayLike,
    *,
    autopilot: int = PX4,
    vehicle: int = QUADROTOR,
) -> Stream:
    """HEARTBEAT with armed bit and mode; PX4's custom mode is main << 16 | sub << 24."""
    base = np.where(np.asarray(armed, dtype=bool), ARMED_BIT, 0) + CUSTOM_MODE_BIT
    n = np.size(time_s)
    fields = {
        "type": vehicle,
        "autopilot": autopilot,
        "base_mode": np.broadcast_to(base, n),
        "custom_mode": np.broadcast_to(custom_mode, n),
        "system_status": 4,
        "mavlink_version": 3,
    }
    return Stream(message="HEARTBEAT", time_s=time_s, fields=fields)


def extended_state(time_s: npt.ArrayLike, landed_state: npt.ArrayLike) -> Stream:
    """EXTENDED_SYS_STATE."""
    fields = {"vtol_state": 0, "landed_state": landed_state}
    return Stream(message="EXTENDED_SYS_STATE", time_s=time_s, fields=fields)


def battery_status(pack: PackTrace, *, battery_id: int = 0) -> Stream:
    """BATTERY_STATUS; without cells the total stands in `voltages`, split at 65534 mV."""
    n = np.size(pack.time_s)
    measured = pack.cell_voltage_V
    cells = _total(pack.voltage_V) if measured is None else _counts(measured, 1e3, 65535)
    unused = np.full((n, CELLS - cells.shape[1]), NOT_MEASURED_UINT16)
    kelvin = np.full(n, np.nan) if pack.temperature_K is None else np.asarray(pack.temperature_K)
    fields = {
        "id": battery_id,
        "battery_function": 1,
        "type": 1,
        "temperature": _counts(kelvin - 273.15, 100, NOT_MEASURED_INT16),
        "voltages": np.hstack([cells, unused]),
        "current_battery": _counts(pack.current_A, 100, -1),
        "current_consumed": _counts(pack.charge_C, 1 / 3.6, -1),
        "energy_consumed": -1,
        "battery_remaining": -1,
    }
    return Stream(message="BATTERY_STATUS", time_s=pack.time_s, fields=fields)


def _total(voltage_V: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """(n, places) millivolts: 65534 in each full place, the rest in the next, then unused."""
    mV = _counts(voltage_V, 1e3, 0)
    full = NOT_MEASURED_UINT16 - 1
    places = np.arange(1 + int(np.max(mV, initial=0)) // full)
    rest = mV[:, None] - full * places
    return np.where(rest > 0, np.minimum(rest, full), NOT_MEASURED_UINT16)


def sys_status(time_s: npt.ArrayLike, voltage_V: npt.ArrayLike, current_A: npt.ArrayLike) -> Stream:
    """SYS_STATUS with its battery fields."""
    zero = dict.fromkeys(
        ["onboard_control_sensors_present", "onboard_control_sensors_enabled"]
        + ["onboard_control_sensors_health", "load", "drop_rate_comm", "errors_comm"]
        + [f"errors_count{i}" for i in (1, 2, 3, 4)],
        0,
    )
    fields = zero | {
        "voltage_battery": _counts(voltage_V, 1e3, NOT_MEASURED_UINT16),
        "current_battery": _counts(current_A, 100, -1),
        "battery_remaining": -1,
    }
    return Stream(message="SYS_STATUS", time_s=time_s, fields=fields)


def local_position(
    time_s: npt.ArrayLike,
    position_m: npt.NDArray[np.float64],
    velocity_m_s: npt.NDArray[np.float64],
) -> Stream:
    """LOCAL_POSITION_NED."""
    named = zip(("x", "y", "z", "vx", "vy", "vz"), (*position_m.T, *velocity_m_s.T), strict=True)
    fields = {"time_boot_ms": _boot_ms(time_s)} | dict(named)
    return Stream(message="LOCAL_POSITION_NED", time_s=time_s, fields=fields)


def velocity_target(time_s: npt.ArrayLike, velocity_m_s: npt.NDArray[np.float64]) -> Stream:
    """POSITION_TARGET_LOCAL_NED: position and acceleration ignored; NaN velocity is ignored too."""
    bits = np.isnan(velocity_m_s) @ np.array([8, 16, 32])
    still = dict.fromkeys(["x", "y", "z", "afx", "afy", "afz", "yaw", "yaw_rate"], 0.0)
    fields = still | {
        "time_boot_ms": _boot_ms(time_s),
        "coordinate_frame": 1,
        "type_mask": bits + (IGNORE_POSITION | IGNORE_ACCELERATION | IGNORE_YAW),
    }
    fields |= dict(zip(("vx", "vy", "vz"), np.nan_to_num(velocity_m_s).T, strict=True))
    return Stream(message="POSITION_TARGET_LOCAL_NED", time_s=time_s, fields=fields)


def system_time(time_s: npt.ArrayLike, start_unix_s: float) -> Stream:
    """SYSTEM_TIME: ties the autopilot's clock to UTC."""
    unix_us = np.rint((np.asarray(time_s, dtype=float) + start_unix_s) * 1e6).astype(np.int64)
    fields = {"time_unix_usec": unix_us, "time_boot_ms": _boot_ms(time_s)}
    return Stream(message="SYSTEM_TIME", time_s=time_s, fields=fields)


def parameter(time_s: float, name: str, value: float) -> Stream:
    """One PARAM_VALUE as a float."""
    fields = {
        "param_id": name,
        "param_value": float(value),
        "param_type": 9,
        "param_count": 1,
        "param_index": 0,
    }
    return Stream(message="PARAM_VALUE", time_s=[time_s], fields=fields)
