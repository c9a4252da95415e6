"""ArduPilot DataFlash logs from plain arrays: binary (`.bin`) and the text form (`.log`).

    write_dataflash(out, tables) -> bytes written          out: a path or a binary stream
    write_dataflash_text(out, tables, banner=()) -> bytes written

Both take any number of `Table(name, format, columns)`; rows of all tables are merged by their time
column (`TimeUS` or `TimeMS`, integers); tables without one are written first, in the order given,
unless `order_s` places them. FMT records are made from the tables. Values are in the unit a reader
sees (0.01 degrees for format `c`, degrees for `L`): the writer applies the format's own factor.

Ready-made tables (SI in, times in s since boot):

    parameters({"BATT_CAPACITY": 2200.0})          PARM
    texts(time_s, ["ArduCopter V4.5.7", ...])      MSG
    events(time_s, [10, 28, 18, 11])               EV: 10 armed, 28 airborne, 18 landed, 11 disarmed
    modes(time_s, [5, 2])                          MODE by ArduCopter number: 5 LOITER, 2 ALT_HOLD
    battery(PackTrace(time_s=, voltage_V=, current_A=, charge_C=, ...), instance=0)    BAT
    velocity(time_s, velocity_m_s)                 XKF1, core 0; (n, 3) north, east, down
    velocity_setpoint(time_s, desired_m_s, velocity_m_s)   PSCN, PSCE, PSCD
    control(time_s, throttle, altitude_m, climb_m_s, desired_climb_m_s)    CTUN, up positive
    utc(time_s, unix_s)                            GPS, with a fix, at rest at the origin

Source of the format: ArduPilot `libraries/AP_Logger/LogStructure.h` (FMT: type, length, name[4],
format[16], labels[64]; every record starts 0xA3 0x95 type).
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from sample_logs.pack_trace import PackTrace

HEAD = b"\xa3\x95"
FMT_TYPE, FMT_LENGTH = 128, 89
FIRST_TYPE = 129
STRUCT = dict(zip("bBhHiIfdQqMnNZ", (*"bBhHiIfdQqB", "4s", "16s", "64s"), strict=True)) | {
    "c": "h", "C": "H", "e": "i", "E": "I", "L": "i",
}  # fmt: skip
FACTOR = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}
LEAP_SECONDS = 18
GPS_EPOCH_UNIX_S = 315964800
WEEK_S = 604800

Column = npt.ArrayLike | Sequence[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """One message type and all its rows.

    Attributes:
        name: at most four characters, e.g. `BAT`.
        format: one format character a column, e.g. `QBff`.
        columns: label -> (n,) values or strings, in record order.
        order_s: (n,) place in the file for a table without a time column.
    """

    name: str
    format: str
    columns: Mapping[str, Column]
    order_s: npt.ArrayLike | None = None

    def rows(self) -> list[tuple[object, ...]]:
        """Values as the format stores them, row by row."""
        return list(zip(*map(_stored, self.format, self.columns.values()), strict=True))

    def place_s(self) -> npt.NDArray[np.float64]:
        """(n,) time by which the rows are merged; -inf puts them first."""
        if self.order_s is not None:
            return np.asarray(self.order_s, dtype=float)
        for label, unit_s in (("TimeUS", 1e-6), ("TimeMS", 1e-3)):
            if label in self.columns:
                return np.asarray(self.columns[label], dtype=float) * unit_s
        return np.full(len(self.rows()), -np.inf)


def _stored(char: str, values: Column) -> list[object]:
    if char in "nNZ":
        return [str(v).encode() for v in np.atleast_1d(np.asarray(values, dtype=object))]
    if char in "fd":
        return list(np.atleast_1d(np.asarray(values, dtype=float)).tolist())
    scaled = np.atleast_1d(np.asarray(values, dtype=np.float64)) * FACTOR.get(char, 1.0)
    return list(np.rint(scaled).astype(np.int64).tolist())


def _merged(tables: Sequence[Table]) -> list[tuple[int, tuple[object, ...]]]:
    """(index of the table, stored row) in file order; ties keep the order of the tables."""
    rows = [(i, row) for i, table in enumerate(tables) for row in table.rows()]
    place = np.concatenate([np.zeros(0), *(table.place_s() for table in tables)])
    return [rows[k] for k in np.argsort(place, kind="stable")]


def _deliver(out: Path | BinaryIO, content: bytes) -> int:
    if isinstance(out, Path):
        return out.write_bytes(content)
    return out.write(content)


def _layout(format_: str) -> struct.Struct:
    return struct.Struct("<" + "".join(STRUCT[char] for char in format_))


def write_dataflash(out: Path | BinaryIO, tables: Sequence[Table]) -> int:
    """Write the binary form; returns the bytes written."""
    fmt = struct.Struct("<2sBBB4s16s64s")
    self_described = (b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    parts = [fmt.pack(HEAD, FMT_TYPE, FMT_TYPE, FMT_LENGTH, *self_described)]
    layouts = [_layout(t.format) for t in tables]
    for i, (t, layout) in enumerate(zip(tables, layouts, strict=True)):
        described = (t.name.encode(), t.format.encode(), ",".join(t.columns).encode())
        parts.append(fmt.pack(HEAD, FMT_TYPE, FIRST_TYPE + i, layout.size + 3, *described))
    heads = [HEAD + bytes([FIRST_TYPE + i]) for i in range(len(tables))]
    parts += [heads[i] + layouts[i].pack(*row) for i, row in _merged(tables)]
    return _deliver(out, b"".join(parts))


def write_dataflash_text(
    out: Path | BinaryIO, tables: Sequence[Table], *, banner: Sequence[str] = ()
) -> int:
    """Write the text form as ArduCopter 3.x prints it; returns the bytes written."""
    lines = [*banner, "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format"]
    for i, t in enumerate(tables):
        length = _layout(t.format).size + 3
        labels = ",".join(t.columns)
        lines.append(f"FMT, {FIRST_TYPE + i}, {length}, {t.name}, {t.format}, {labels}")
    for i, row in _merged(tables):
        printed = map(_printed, tables[i].format, row)
        lines.append(", ".join([tables[i].name, *printed]))
    return _deliver(out, ("\n".join(lines) + "\n").encode())


def _printed(char: str, stored: object) -> str:
    if isinstance(stored, bytes):
        return stored.decode()
    if char in FACTOR:
        return f"{float(stored) / FACTOR[char]:.7g}"  # type: ignore[arg-type]
    return repr(stored)


def _us(time_s: npt.ArrayLike) -> npt.NDArray[np.int64]:
    return np.rint(np.asarray(time_s, dtype=float) * 1e6).astype(np.int64)


def parameters(values: Mapping[str, float]) -> Table:
    """PARM rows, at the start of the file."""
    names, zeros = list(values), np.zeros(len(values))
    columns: dict[str, Column] = {"TimeUS": zeros, "Name": names, "Value": list(values.values())}
    return Table(name="PARM", format="QNf", columns=columns, order_s=zeros - 1)


def texts(time_s: npt.ArrayLike, lines: Sequence[str]) -> Table:
    """MSG rows; the first of a real log is the firmware, e.g. `ArduCopter V4.5.7 (abcdef01)`."""
    return Table(name="MSG", format="QZ", columns={"TimeUS": _us(time_s), "Message": list(lines)})


def events(time_s: npt.ArrayLike, numbers: npt.ArrayLike) -> Table:
    """EV rows."""
    return Table(name="EV", format="QB", columns={"TimeUS": _us(time_s), "Id": numbers})


def modes(time_s: npt.ArrayLike, numbers: npt.ArrayLike) -> Table:
    """MODE rows, changed by the radio (reason 1)."""
    n = np.atleast_1d(np.asarray(numbers, dtype=int))
    columns = {"TimeUS": _us(time_s), "Mode": n, "ModeNum": n, "Rsn": np.ones_like(n)}
    return Table(name="MODE", format="QMBB", columns=columns)


def battery(pack: PackTrace, *, instance: int = 0) -> Table:
    """BAT rows as ArduCopter 4.1 and newer log them; without a temperature `Temp` is 0."""
    n = np.size(pack.time_s)
    kelvin = np.full(n, 273.15) if pack.temperature_K is None else np.asarray(pack.temperature_K)
    energy_Wh = np.asarray(pack.voltage_V) * np.asarray(pack.charge_C) / 3600
    columns: dict[str, Column] = {
        "TimeUS": _us(pack.time_s),
        "Inst": np.full(n, instance),
        "Volt": pack.voltage_V,
        "VoltR": pack.voltage_V,
        "Curr": pack.current_A,
        "CurrTot": np.asarray(pack.charge_C) / 3.6,
        "EnrgTot": energy_Wh,
        "Temp": kelvin - 273.15,
        "Res": np.zeros(n),
        "RemPct": np.full(n, 100),
    }
    return Table(name="BAT", format="QBfffffcfB", columns=columns)


def velocity(time_s: npt.ArrayLike, velocity_m_s: npt.NDArray[np.float64]) -> Table:
    """XKF1 rows of core 0 with the columns a velocity needs."""
    north, east, down = velocity_m_s.T
    columns = {"TimeUS": _us(time_s), "C": np.zeros(np.size(time_s))}
    columns |= {"VN": north, "VE": east, "VD": down}
    return Table(name="XKF1", format="QBfff", columns=columns)


def velocity_setpoint(
    time_s: npt.ArrayLike,
    desired_m_s: npt.NDArray[np.float64],
    velocity_m_s: npt.NDArray[np.float64],
) -> tuple[Table, Table, Table]:
    """PSCN, PSCE, PSCD rows: desired (the pilot's or the mission's) and actual velocity."""
    return tuple(  # type: ignore[return-value]
        Table(
            name=f"PSC{axis}",
            format="Qfff",
            columns={
                "TimeUS": _us(time_s),
                f"DV{axis}": desired_m_s[:, i],
                f"TV{axis}": desired_m_s[:, i],
                f"V{axis}": velocity_m_s[:, i],
            },
        )
        for i, axis in enumerate("NED")
    )


def control(
    time_s: npt.ArrayLike,
    throttle: npt.ArrayLike,
    altitude_m: npt.ArrayLike,
    climb_m_s: npt.ArrayLike,
    desired_climb_m_s: npt.ArrayLike,
) -> Table:
    """CTUN rows: throttle out 0..1, altitude and climb rates up positive (cm/s in the log)."""
    columns: dict[str, Column] = {
        "TimeUS": _us(time_s),
        "ThO": throttle,
        "Alt": altitude_m,
        "DCRt": np.asarray(desired_climb_m_s) * 100,
        "CRt": np.asarray(climb_m_s) * 100,
    }
    return Table(name="CTUN", format="Qffhh", columns=columns)


def utc(time_s: npt.ArrayLike, unix_s: npt.ArrayLike) -> Table:
    """GPS rows that tie the log to UTC (week and milliseconds of GPS time, 18 leap seconds)."""
    gps_s = np.asarray(unix_s, dtype=float) - GPS_EPOCH_UNIX_S + LEAP_SECONDS
    n = np.size(time_s)
    columns: dict[str, Column] = {
        "TimeUS": _us(time_s),
        "Status": np.full(n, 3),
        "GMS": np.mod(gps_s, WEEK_S) * 1000,
        "GWk": gps_s // WEEK_S,
        "Spd": np.zeros(n),
        "GCrs": np.zeros(n),
        "VZ": np.zeros(n),
    }
    return Table(name="GPS", format="QBIHfff", columns=columns)
