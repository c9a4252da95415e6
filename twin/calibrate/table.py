"""A reference test from a CSV file: columns by what their header says of quantity and unit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np
import numpy.typing as npt

from twin.columns import (
    KELVIN,
    QUANTITIES,
    TEMPERATURES,
    Lines,
    Place,
    TableError,
    cells_of_a_pack,
    column,
    not_there,
    places_of,
    table_lines,
    untaken_temperature,
)

FloatArray = npt.NDArray[np.float64]


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
        TableError: it is no CSV, a column is missing or there twice, a cell is no number, or a
            temperature is in no unit that is known.
        CalibrationError: there are fewer than two samples, time does not increase, or a temperature
            is one that no pack has.
    """
    header, told = table_lines(stream, name=name)
    of_cells = cells_of_a_pack(header, name)
    taken = places_of(header, of_cells)
    if summed := bool(of_cells) and "voltage_V" not in taken:
        taken["voltage_V"] = of_cells[0]  # until the sum is known
    if lacking := [q for q in QUANTITIES if q not in taken and q not in TEMPERATURES]:
        raise TableError(f"{name}: {not_there(lacking, header)}")
    if title := untaken_temperature(header, taken):
        raise TableError(
            f"{name}: {title!r} is a temperature in no unit that is known: expected one such as "
            "'Temperature / degC' or 'Temperature / K'; without it leave the column out"
        )
    taken |= {f"voltage of cell {k}": place for k, place in enumerate(of_cells, start=1)}
    needed = [q for q in taken if q not in TEMPERATURES]
    lines = [(n, row) for n, row in told if _full(row, [taken[q] for q in needed])]
    columns = {q: column(lines, place, q, name) for q, place in taken.items()}
    _check_temperatures(columns, taken, lines, header, name)
    whole = np.all([np.isfinite(columns[q]) for q in needed], axis=0)
    measured = np.all([columns[q] != 0 for q in needed if "voltage" in q], axis=0)
    kept = np.flatnonzero(whole & measured)
    remarks = _left_out(len(told) - int(whole.sum()), "without time, current or voltage")
    remarks += _left_out(int((whole & ~measured).sum()), "with a voltage of 0, which is none")
    columns = {q: v[kept] for q, v in columns.items()}
    time_s = columns["time_s"]
    for quantity in (q for q in TEMPERATURES if q in columns):
        columns[quantity], said = _throughout(time_s, columns[quantity], quantity)
        remarks += said
    if time_s.size < 2:
        raise CalibrationError(f"{name}: {time_s.size} samples: no test")
    if (stuck := np.flatnonzero(np.diff(time_s) <= 0)).size:
        line, title = lines[kept[stuck[0] + 1]][0], header[taken["time_s"][0]].strip()
        back = int((np.diff(time_s) < 0).sum())
        raise CalibrationError(
            f"{name}, line {line}: {title!r} does not exceed that of the line before "
            f"({stuck.size} such lines, in {back} it goes back): "
            + ("give one test, its time running on" if back else "leave one of each pair out")
        )
    cells_V = np.array([v for q, v in columns.items() if q not in QUANTITIES])
    warm = {q: v for q, v in columns.items() if q in TEMPERATURES and v.size}
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


def _full(row: Sequence[str], places: Sequence[Place]) -> bool:
    return all(place < len(row) and row[place].strip() for place, _, _ in places)


def _check_temperatures(
    columns: Mapping[str, FloatArray],
    taken: Mapping[str, Place],
    lines: Lines,
    header: Sequence[str],
    name: str,
) -> None:
    """Kelvin under a header with degC, or the other way round, is the usual mistake."""
    low, high = KELVIN
    for quantity in TEMPERATURES:
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
