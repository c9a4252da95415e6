"""PX4 ULog files from plain arrays.

    write_ulog(out, topics, ...) -> bytes written          out: a path or a binary stream

A `Topic(name, time_s, fields, instance=0)` is one uORB topic: `fields` maps `type name` (as in the
format, e.g. `float vx` or `float[3] velocity`) to a scalar, (n,) or (n, k) values, in the own
units of the topic. Rows are merged by time unless `order_s` places them. Ready-made topics (SI in,
times in s since boot):

    battery(PackTrace(...), instance=0, cells=4)    battery_status; NaN current is written as -1
    local_position(time_s, position_m, velocity_m_s)               (n, 3) north, east, down
    trajectory_setpoint(time_s, velocity_m_s)                      NaN: not controlled
    land_detected(time_s, landed)
    status(time_s, armed, nav_state, vehicle_type=1)
    thrust(time_s, thrust)                                         vehicle_thrust_setpoint
    gps(time_s, unix_s)                                            vehicle_gps_position

Besides topics: `info` (`ver_hw`, ...), `parameters`, `dropouts` [(time_s, lost_s)], `texts`
[(time_s, level, text)], `appended` (each a further piece, announced in the flag bits) and
`sync_every` (a sync message after so many rows).

Source of the format: https://docs.px4.io/main/en/dev_log/ulog_file_format.html
"""

import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from sample_logs.pack_trace import PackTrace

MAGIC = b"ULog\x01\x12\x35\x01"
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
DTYPE = {
    "bool": "?", "uint8_t": "<u1", "int8_t": "<i1", "uint16_t": "<u2", "int16_t": "<i2",
    "uint32_t": "<u4", "int32_t": "<i4", "uint64_t": "<u8", "int64_t": "<i8", "float": "<f4",
    "double": "<f8", "char": "<u1",
}  # fmt: skip
FIELD = re.compile(r"(\w+)(?:\[(\d+)\])? (\w+)")
COMPATIBLE, APPENDED = bytes(8), b"\x01" + bytes(7)
OFFSETS = 3
Row = tuple[float, bytes]


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """One topic and all its rows.

    Attributes:
        name: uORB name, e.g. `battery_status`.
        time_s: (n,) since boot; may lie about the order, as real ones do.
        fields: `type name` -> scalar, (n,) or (n, k).
        instance: multi id.
        order_s: (n,) place in the file; None takes the times.
    """

    name: str
    time_s: npt.ArrayLike
    fields: Mapping[str, npt.ArrayLike]
    instance: int = 0
    order_s: npt.ArrayLike | None = None

    def format(self) -> str:
        """The definition that stands in the file."""
        return f"{self.name}:uint64_t timestamp;" + "".join(f"{key};" for key in self.fields)

    def rows(self, message_id: int) -> list[Row]:
        """Place in the file and bytes of each data message."""
        time_s = np.atleast_1d(np.asarray(self.time_s, dtype=float))
        table = np.zeros(time_s.size, dtype=[("stamp", "<u8"), *map(_dtype, self.fields)])
        table["stamp"] = np.rint(time_s * 1e6).astype(np.uint64)
        for key, values in self.fields.items():
            table[_dtype(key)[0]] = values
        order = time_s if self.order_s is None else np.asarray(self.order_s, dtype=float)
        head = struct.pack("<H", message_id)
        return [
            (at, message("D", head + row.tobytes()))
            for at, row in zip(order.tolist(), table, strict=True)
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Extras:
    """What a log holds besides its topics, see the text at the top of this file."""

    info: Mapping[str, str | int] = field(default_factory=dict)
    parameters: Mapping[str, float | int] = field(default_factory=dict)
    dropouts: Sequence[tuple[float, float]] = ()
    texts: Sequence[tuple[float, int, str]] = ()
    appended: Sequence[bytes] = ()
    sync_every: int = 0


def _dtype(key: str) -> tuple[Any, ...]:
    found = FIELD.fullmatch(key)
    if not found:
        raise ValueError(f"{key!r} is no field; expected e.g. 'float vx' or 'float[3] velocity'")
    kind, length, label = found.groups()
    return (label, DTYPE[kind], (int(length),)) if length else (label, DTYPE[kind])


def message(kind: str, body: bytes) -> bytes:
    """One ULog message."""
    return struct.pack("<HB", len(body), ord(kind)) + body


def _keyed(kind: str, key: str, value: bytes) -> bytes:
    return message(kind, bytes([len(key)]) + key.encode() + value)


def _info(key: str, value: str | int) -> bytes:
    if isinstance(value, str):
        return _keyed("I", f"char[{len(value.encode())}] {key}", value.encode())
    return _keyed("I", f"uint32_t {key}", struct.pack("<I", value))


def _parameter(key: str, value: float) -> bytes:
    if isinstance(value, int):
        return _keyed("P", f"int32_t {key}", struct.pack("<i", value))
    return _keyed("P", f"float {key}", struct.pack("<f", value))


def _flags(offsets: Sequence[int]) -> bytes:
    places = [*offsets, *[0] * (OFFSETS - len(offsets))]
    flags = APPENDED if offsets else bytes(8)
    return message("B", COMPATIBLE + flags + struct.pack("<3Q", *places))


def _definitions(topics: Sequence[Topic], extras: Extras) -> bytes:
    formats = {t.name: t.format() for t in topics}
    parts = [message("F", text.encode()) for text in formats.values()]
    parts += [_info(k, v) for k, v in extras.info.items()]
    parts += [_parameter(k, v) for k, v in extras.parameters.items()]
    return b"".join(parts)


def _data(topics: Sequence[Topic], extras: Extras) -> bytes:
    rows: list[Row] = [row for i, topic in enumerate(topics) for row in topic.rows(i)]
    rows += [
        (at, message("O", struct.pack("<H", round(lost * 1e3)))) for at, lost in extras.dropouts
    ]
    rows += [
        (at, message("L", struct.pack("<BQ", ord(str(level)), round(at * 1e6)) + text.encode()))
        for at, level, text in extras.texts
    ]
    parts = [bytes_ for _, bytes_ in sorted(rows, key=lambda row: row[0])]
    if extras.sync_every:
        parts[extras.sync_every :: extras.sync_every] = [
            part + message("S", SYNC) for part in parts[extras.sync_every :: extras.sync_every]
        ]
    subscribed = [
        message("A", struct.pack("<BH", topic.instance, i) + topic.name.encode())
        for i, topic in enumerate(topics)
    ]
    return b"".join(subscribed + parts)


def write_ulog(
    out: Path | BinaryIO,
    topics: Sequence[Topic],
    extras: Extras | None = None,
    *,
    start_s: float = 0.0,
) -> int:
    """Write the log; returns the bytes written.

    Args:
        out: where to.
        topics: their place in this sequence is their message id.
        extras: everything that is no topic.
        start_s: the header's time stamp, since boot.
    """
    extras = extras or Extras()
    header = MAGIC + struct.pack("<Q", round(start_s * 1e6))
    body = _definitions(topics, extras) + _data(topics, extras)
    sizes = [len(header) + len(_flags(())) + len(body), *map(len, extras.appended)]
    offsets = np.cumsum(sizes[:-1]).tolist() if extras.appended else []
    content = header + _flags(offsets) + body + b"".join(extras.appended)
    return out.write_bytes(content) if isinstance(out, Path) else out.write(content)


def _or(values: npt.ArrayLike, unknown: float) -> npt.NDArray[np.float64]:
    array = np.asarray(values, dtype=float)
    return np.where(np.isfinite(array), array, unknown)


def battery(pack: PackTrace, *, instance: int = 0, cells: int = 0) -> Topic:
    """battery_status as PX4 1.15 writes it; NaN becomes the sentinel of its field."""
    voltage, current = np.asarray(pack.voltage_V), np.asarray(pack.current_A)
    kelvin = np.nan if pack.temperature_K is None else np.asarray(pack.temperature_K)
    fields: dict[str, npt.ArrayLike] = {
        "float voltage_v": _or(voltage, 0.0),
        "float current_a": _or(current, -1.0),
        "float discharged_mah": _or(np.asarray(pack.charge_C) / 3.6, -1.0),
        "float remaining": -1.0,
        "float temperature": kelvin - 273.15,
        "uint8_t cell_count": cells,
        "bool connected": True,
        "uint8_t id": instance + 1,
    }
    if pack.cell_voltage_V is not None:
        measured = np.asarray(pack.cell_voltage_V)
        fields["float[14] voltage_cell_v"] = np.pad(measured, ((0, 0), (0, 14 - measured.shape[1])))
    return Topic(name="battery_status", time_s=pack.time_s, fields=fields, instance=instance)


def local_position(
    time_s: npt.ArrayLike, position_m: npt.ArrayLike, velocity_m_s: npt.ArrayLike
) -> Topic:
    """vehicle_local_position, everything valid."""
    position, velocity = np.asarray(position_m), np.asarray(velocity_m_s)
    values = dict(zip(("x", "y", "z"), position.T, strict=True))
    values |= dict(zip(("vx", "vy", "vz"), velocity.T, strict=True))
    flags = {f"bool {k}": True for k in ("xy_valid", "z_valid", "v_xy_valid", "v_z_valid")}
    fields: dict[str, npt.ArrayLike] = {f"float {k}": v for k, v in values.items()}
    fields |= flags
    return Topic(name="vehicle_local_position", time_s=time_s, fields=fields)


def trajectory_setpoint(time_s: npt.ArrayLike, velocity_m_s: npt.ArrayLike) -> Topic:
    """trajectory_setpoint in its form since PX4 1.14; NaN where not controlled."""
    fields: dict[str, npt.ArrayLike] = {
        "float[3] position": np.nan,
        "float[3] velocity": velocity_m_s,
    }
    return Topic(name="trajectory_setpoint", time_s=time_s, fields=fields)


def land_detected(time_s: npt.ArrayLike, landed: npt.ArrayLike) -> Topic:
    """vehicle_land_detected."""
    return Topic(name="vehicle_land_detected", time_s=time_s, fields={"bool landed": landed})


def status(
    time_s: npt.ArrayLike,
    armed: npt.ArrayLike,
    nav_state: npt.ArrayLike,
    *,
    vehicle_type: int = 1,
    is_vtol: bool = False,
) -> Topic:
    """vehicle_status: arming state 1 or 2, mode number, vehicle type 1 rotary or 2 fixed wing."""
    fields: dict[str, npt.ArrayLike] = {
        "uint8_t arming_state": 1 + np.asarray(armed, dtype=int),
        "uint8_t nav_state": nav_state,
        "uint8_t vehicle_type": vehicle_type,
        "bool is_vtol": is_vtol,
    }
    return Topic(name="vehicle_status", time_s=time_s, fields=fields)


def thrust(time_s: npt.ArrayLike, level: npt.ArrayLike) -> Topic:
    """vehicle_thrust_setpoint of a multirotor: (n,) 0..1, upwards."""
    xyz = np.asarray(level)[:, None] * np.array([0.0, 0.0, -1.0])
    return Topic(name="vehicle_thrust_setpoint", time_s=time_s, fields={"float[3] xyz": xyz})


def gps(time_s: npt.ArrayLike, unix_s: npt.ArrayLike) -> Topic:
    """vehicle_gps_position with UTC; 0 is no UTC."""
    utc = np.rint(np.asarray(unix_s) * 1e6).astype(np.uint64)
    fields: dict[str, npt.ArrayLike] = {"uint64_t time_utc_usec": utc, "uint8_t fix_type": 3}
    return Topic(name="vehicle_gps_position", time_s=time_s, fields=fields)
