"""A reference test from a CSV file: columns by what their header says of quantity and unit."""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

TEMPERATURE = r"(?<!at)temp|^t$|^t[ _]?(?:cell|surf|can|case|skin|amb|air|chamber|oven)"
# quantity -> words of a header that mean it, and unit -> (factor, offset) to SI
QUANTITIES: Mapping[str, tuple[str, Mapping[str, tuple[float, float]]]] = {
    "time_s": (
        r"time|^t$",
        {"s": (1.0, 0.0), "ms": (1e-3, 0.0), "us": (1e-6, 0.0), "min": (60.0, 0.0),
         "h": (3600.0, 0.0)},
    ),
    "current_A": (r"current|^i$", {"a": (1.0, 0.0), "ma": (1e-3, 0.0)}),
    "voltage_V": (r"voltage|recorded|^[uv]$", {"v": (1.0, 0.0), "mv": (1e-3, 0.0)}),
    "temperature_K": (TEMPERATURE, {"k": (1.0, 0.0), "c": (1.0, 273.15)}),
    "ambient_K": (TEMPERATURE, {"k": (1.0, 0.0), "c": (1.0, 273.15)}),
}  # fmt: skip
EXAMPLES = {"time_s": "Time / s", "current_A": "Current / A", "voltage_V": "Voltage / V"}
LONG_UNITS = {
    "sec": "s", "second": "s", "seconds": "s", "hours": "h", "hour": "h", "minutes": "min",
    "amps": "a", "ampere": "a", "volt": "v", "volts": "v", "degc": "c", "°c": "c", "celsius": "c",
    "kelvin": "k", "µs": "us", "μs": "us",
}  # fmt: skip
OPTIONAL = ("temperature_K", "ambient_K")
KELVIN = 200.0, 400.0  # what a pack may have
NOT_OF_THE_PACK = re.compile(r"amb|air|chamber|oven")
BEGINS_ANEW = re.compile(r"(?:step|cycle).*time", re.IGNORECASE)
Place = tuple[int, float, float]
"""Of a column: where it stands, and factor and offset to SI."""
CELL = re.compile(r"cell\D*(?P<number>\d{1,3})(?!\d)")
"""In a header with the unit of a voltage: that of one cell of the pack, by its place."""
HEADER = re.compile(r"^(?P<what>.*?)[\s_]*(?:[\[(/_]|\s)\s*(?P<unit>[a-zµμ°]+)\s*[\])]?$")


class CalibrationError(ValueError):
    """What cannot be calibrated; the text says what, where and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredTable:
    """The columns of a file, (n,) each, in SI, signs as in the file.

    Attributes:
        name: of the file.
        time_s: from the first sample.
        current_A: of whatever was measured, cell or pack.
        voltage_V: likewise.
        temperature_K: of the battery, if there is such a column; NaN before its first entry and
            after its last.
        ambient_K: of what surrounds it, likewise.
        cells_V: (cells, n) of each cell in the order of their numbers, if there are such columns.
        remarks: what was left out or put in, counted.
    """

    name: str
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    temperature_K: FloatArray | None
    ambient_K: FloatArray | None = None
    cells_V: FloatArray | None = None
    remarks: tuple[str, ...] = ()


def read_test(stream: TextIO, *, name: str) -> MeasuredTable:
    """The columns for time, current and voltage, and temperatures if there are some.

    A header names quantity and unit: "Test Time / s", "Current [mA]", "voltage_V". Where several
    fit, the first is taken. Two columns or more such as "Cell 1 / V", "cell2_mV" are the voltages
    of the cells, whose sum is that of the pack where no other column has it. Lines without time,
    current or a voltage are left out, and those with a voltage of exactly 0, which is none; a
    temperature that is not in every line runs straight from one to the next, and is unknown before
    the first and after the last. `remarks` count them.

    Raises:
        CalibrationError: it is no CSV, a column is missing or there twice, there are fewer than two
            samples, a cell is no number, time does not increase, or a temperature is in no unit
            that is known, or one that no pack has.
    """
    rows = csv_lines(stream, name=name)
    _, header = next(rows, (0, []))
    of_cells = cell_columns(header, name)
    own = ["" if place in {p for p, _, _ in of_cells} else t for place, t in enumerate(header)]
    places = {quantity: column_of(own, quantity) for quantity in QUANTITIES}
    if of_cells and places["voltage_V"] is None:
        places["voltage_V"] = of_cells[0]  # until the sum is known
    if lacking := [q for q, place in places.items() if place is None and q not in OPTIONAL]:
        raise CalibrationError(f"{name}: {not_there(lacking, header)}")
    if title := untaken_temperature(header, places):
        raise CalibrationError(
            f"{name}: {title!r} is a temperature in no unit that is known: expected one such as "
            "'Temperature / degC' or 'Temperature / K'; without it leave the column out"
        )
    summed = bool(of_cells) and places["voltage_V"] == of_cells[0]
    taken = {q: place for q, place in places.items() if place is not None}
    taken |= {f"voltage of cell {k}": place for k, place in enumerate(of_cells, start=1)}
    told = [(number, row) for number, row in rows if any(map(str.strip, row))]
    needed = {q: place for q, place in taken.items() if q not in OPTIONAL}
    lines = [(number, row) for number, row in told if _full(row, needed)]
    columns = {q: _values(lines, place, q, name) for q, place in taken.items()}
    _check_temperatures(columns, taken, lines, header, name)
    measured = np.all([v != 0 for q, v in columns.items() if "voltage" in q], axis=0)
    remarks = _left_out(len(told) - len(lines), "without time, current or voltage")
    remarks += _left_out(int((~measured).sum()), "with a voltage of 0, which is none")
    lines = [line for line, kept in zip(lines, measured.tolist(), strict=True) if kept]
    columns = {q: v[measured] for q, v in columns.items()}
    time_s = columns["time_s"]
    for quantity in (q for q in OPTIONAL if q in columns):
        columns[quantity], said = _throughout(time_s, columns[quantity], quantity)
        remarks += said
    if time_s.size < 2:
        raise CalibrationError(f"{name}: {time_s.size} samples: no test")
    if (stuck := np.flatnonzero(np.diff(time_s) <= 0)).size:
        line, title = lines[stuck[0] + 1][0], header[taken["time_s"][0]].strip()
        back = int((np.diff(time_s) < 0).sum())
        raise CalibrationError(
            f"{name}, line {line}: {title!r} does not exceed that of the line before "
            f"({stuck.size} such lines, in {back} it goes back): "
            + ("give one test, its time running on" if back else "leave one of each pair out")
        )
    cells_V = np.array([v for q, v in columns.items() if q not in QUANTITIES])
    warm = {q: v for q, v in columns.items() if q in OPTIONAL and v.size}
    return MeasuredTable(
        name=name,
        time_s=time_s - time_s[0],
        current_A=columns["current_A"],
        voltage_V=cells_V.sum(axis=0) if summed else columns["voltage_V"],
        temperature_K=warm.get("temperature_K"),
        ambient_K=warm.get("ambient_K"),
        cells_V=cells_V if cells_V.size else None,
        remarks=remarks,
    )


def csv_lines(stream: TextIO, *, name: str) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of each line; CalibrationError where it is none of a CSV.

    That is where a quote is not closed, and all behind it too long for a cell.
    """
    rows = csv.reader(stream)
    try:
        for row in rows:
            yield rows.line_num, row
    except csv.Error as e:
        raise CalibrationError(f"{name}, line {rows.line_num}: not a readable CSV: {e}") from e


def not_there(quantities: Sequence[str], header: Sequence[str]) -> str:
    """That a `header` has no column for some of EXAMPLES, and what is expected, in words."""
    examples = " and ".join(
        f"{EXAMPLES[q]!r} ({' or '.join(QUANTITIES[q][1])})" for q in quantities
    )
    whole = len(header) == 1 and re.search(r"[;\t|]", header[0])
    parted = ": columns have to be parted by commas" if whole else ""
    return (
        f"no column for {' and '.join(quantities)}: expected quantity and unit in its header, "
        f"such as {examples}; the first line has {list(header)}{parted}"
    )


def column_of(header: Sequence[str], quantity: str) -> Place | None:
    """Place, factor and offset of the first column whose header names `quantity` with a unit.

    A time that begins anew with each step or cycle comes after all others.
    """
    words, units = QUANTITIES[quantity]
    found: list[Place] = []
    for place, title in enumerate(header):
        what, unit = named(title)
        around = NOT_OF_THE_PACK.search(what) is not None
        if unit in units and re.search(words, what) and around == (quantity == "ambient_K"):
            found.append((place, *units[unit]))
    return min(found, key=lambda p: bool(BEGINS_ANEW.search(header[p[0]])), default=None)


def cell_columns(header: Sequence[str], name: str) -> list[Place]:
    """The same of each cell's voltage, in the order of their numbers; one alone is the pack's."""
    units = QUANTITIES["voltage_V"][1]
    found: dict[int, Place] = {}
    for place, title in enumerate(header):
        what, unit = named(title)
        if unit not in units or (cell := CELL.search(what)) is None:
            continue
        number = int(cell["number"])
        if number in found:
            raise CalibrationError(f"{name}: two columns have the voltage of cell {number}")
        found[number] = (place, *units[unit])
    if len(found) < 2:
        return []  # of the only cell that was measured
    numbers = sorted(found)
    if numbers[-1] - numbers[0] >= len(numbers):
        raise CalibrationError(
            f"{name}: voltages of the cells {numbers}: expected every number from the first to the "
            "last"
        )
    return [found[number] for number in numbers]


def named(title: str) -> tuple[str, str]:
    """What a header names, and its unit; empty if it does not fit."""
    parts = HEADER.match(title.strip().lstrip("\ufeff").casefold())
    if parts is None:
        return "", ""
    return parts["what"], LONG_UNITS.get(parts["unit"], parts["unit"])


def _left_out(lines: int, which: str) -> tuple[str, ...]:
    said = f"lines {which}: {lines} were left out, the current runs on between those around them"
    return (said,) if lines else ()


def _throughout(
    time_s: FloatArray, kelvin: FloatArray, quantity: str
) -> tuple[FloatArray, tuple[str, ...]]:
    """A temperature straight from one that was measured to the next, NaN beyond; or none."""
    known = np.isfinite(kelvin)
    if known.all():
        return kelvin, ()
    if not known.any():
        return np.empty(0), (f"{quantity}: the column is empty",)
    said = f"{quantity}: measured in {known.sum()} of {known.size} lines, straight in between"
    between = np.interp(time_s, time_s[known], kelvin[known], left=np.nan, right=np.nan)
    if beyond := int(np.isnan(between).sum()):
        said += f", unknown before and after ({beyond} lines)"
    return between, (said,)


def _full(row: Sequence[str], taken: Mapping[str, tuple[int, float, float]]) -> bool:
    return all(place < len(row) and row[place].strip() for place, _, _ in taken.values())


def _values(
    lines: Sequence[tuple[int, Sequence[str]]],
    column: tuple[int, float, float],
    quantity: str,
    name: str,
) -> FloatArray:
    place, factor, offset = column
    out = np.full(len(lines), np.nan)
    for k, (line, row) in enumerate(lines):
        if quantity in OPTIONAL and not _full(row, {quantity: column}):
            continue
        try:
            out[k] = float(row[place])
        except ValueError as e:
            raise CalibrationError(
                f"{name}, line {line}: {quantity} is {row[place]!r}, no number"
            ) from e
        if not np.isfinite(out[k]):
            raise CalibrationError(f"{name}, line {line}: {quantity} is {row[place]!r}")
    return out * factor + offset


def possible_K(kelvin: FloatArray | None) -> tuple[FloatArray | None, int]:
    """NaN for temperatures that no pack can have, as loggers write for none; how many were."""
    if kelvin is None:
        return None, 0
    strange = (kelvin < KELVIN[0]) | (kelvin > KELVIN[1])
    return np.where(strange, np.nan, kelvin), int(strange.sum())


def untaken_temperature(header: Sequence[str], places: Mapping[str, Place | None]) -> str:
    """A title that names a temperature where none was taken, its unit not being known; or ""."""
    if any(places.get(quantity) for quantity in OPTIONAL):
        return ""
    titles = (title.strip() for title in header)
    return next((title for title in titles if re.search(TEMPERATURE, title.casefold())), "")


def _check_temperatures(
    columns: Mapping[str, FloatArray],
    taken: Mapping[str, Place],
    lines: Sequence[tuple[int, Sequence[str]]],
    header: Sequence[str],
    name: str,
) -> None:
    """Kelvin under a header with degC, or the other way round, is the usual mistake."""
    low, high = KELVIN
    for quantity in OPTIONAL:
        kelvin = columns.get(quantity, np.empty(0))
        if not (off := np.flatnonzero((kelvin < low) | (kelvin > high))).size:
            continue
        place, _, offset = taken[quantity]
        line, row = lines[off[0]]
        unit, other = ("K", 0.0) if offset else ("degC", QUANTITIES[quantity][1]["c"][1])
        hint = f": is it in {unit}?" if low <= float(row[place]) + other <= high else ""
        raise CalibrationError(
            f"{name}, line {line}: {header[place]!r} is {row[place].strip()}, which is "
            f"{kelvin[off[0]]:.2f} K; expected {low:g} to {high:g} K ({off.size} such lines){hint}"
        )
