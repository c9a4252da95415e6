"""Channels that were kept from the twin, from a CSV: temperature, voltages of cells."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np

from twin.calibrate.table import (
    KELVIN,
    NOT_OF_THE_PACK,
    QUANTITIES,
    CalibrationError,
    Place,
    csv_lines,
    named,
    possible_K,
)
from twin.mismatch.flight import FloatArray, MismatchError

CELL_VOLTAGE = re.compile(r"cell")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HiddenTable:
    """The columns of a file, SI; NaN where a cell of the table is empty or stands for no answer.

    Attributes:
        name: of the file.
        time_s: (n,) on the clock of the recording, increasing.
        temperature_K: (n,) of the pack, or None.
        cell_voltage_V: (cells, n) in the order of the columns; no rows if there are none.
    """

    name: str
    time_s: FloatArray
    temperature_K: FloatArray | None
    cell_voltage_V: FloatArray


def read_hidden_csv(stream: TextIO, *, name: str) -> HiddenTable:
    """Places by what their headers say of quantity and unit.

    Time ("time_s"), temperature ("temperature_c", "Temperature / degC"; not that of the air), and
    any number of cells ("cell_1_v", "Cell Voltage 2 / mV"). Others are passed over; of lines with
    one time the first counts.

    Raises:
        MismatchError: no CSV, no time, neither channel, or a cell that is no number; with the line.
    """
    try:
        rows = list(csv_lines(stream, name=name))
    except CalibrationError as e:
        raise MismatchError(str(e)) from e
    header = rows[0][1] if rows else []
    places = [_place(k, title) for k, title in enumerate(header)]
    time, warm = _first(places, "time_s"), _first(places, "temperature_K")
    cells = [column for kind, column in filter(None, places) if kind == "cell_V"]
    if time is None or not (warm or cells):
        raise MismatchError(
            f"{name}: expected a column for time, such as 'time_s', and one for temperature "
            f"('temperature_c') or for cells ('cell_1_v'); the first line has {header}"
        )
    lines = [(number, row) for number, row in rows[1:] if any(text.strip() for text in row)]
    stamps = _values(lines, time, name)
    lines = [line for line, known in zip(lines, np.isfinite(stamps), strict=True) if known]
    stamps = stamps[np.isfinite(stamps)]
    lines = [
        line for line, new in zip(lines, np.diff(stamps, prepend=-np.inf) != 0, strict=True) if new
    ]
    time_s = _values(lines, time, name)
    if time_s.size < 2 or not np.all(np.diff(time_s) > 0):
        raise MismatchError(f"{name}: expected two lines or more, time increasing in each")
    temperature_K, strange = possible_K(None if warm is None else _values(lines, warm, name))
    if temperature_K is not None and strange and not np.isfinite(temperature_K).any():
        raise MismatchError(
            f"{name}: no temperature that a pack can have ({KELVIN[0]:g} to {KELVIN[1]:g} K): is "
            "it in the unit that its header says?"
        )
    cells_V = np.array([_values(lines, c, name) for c in cells]).reshape(-1, time_s.size)
    return HiddenTable(
        name=name,
        time_s=time_s,
        temperature_K=temperature_K,
        cell_voltage_V=np.where(cells_V == 0.0, np.nan, cells_V),
    )


def _first(places: Sequence[tuple[str, Place] | None], kind: str) -> Place | None:
    return next((column for found, column in filter(None, places) if found == kind), None)


def _place(k: int, title: str) -> tuple[str, Place] | None:
    """What a column holds, its place, factor and offset; None if nothing of use."""
    what, unit = named(title)
    kinds = {
        "time_s": QUANTITIES["time_s"],
        "temperature_K": QUANTITIES["temperature_K"],
        "cell_V": (CELL_VOLTAGE.pattern, QUANTITIES["voltage_V"][1]),
    }
    for kind, (words, units) in kinds.items():
        if unit in units and re.search(words, what) and not NOT_OF_THE_PACK.search(what):
            return kind, (k, *units[unit])
    return None


def _values(lines: Sequence[tuple[int, Sequence[str]]], column: Place, name: str) -> FloatArray:
    place, factor, offset = column
    out = np.full(len(lines), np.nan)
    for k, (line, row) in enumerate(lines):
        text = row[place].strip() if place < len(row) else ""
        try:
            out[k] = float(text) if text else np.nan
        except ValueError as e:
            raise MismatchError(f"{name}, line {line}: {text!r} is no number") from e
    return out * factor + offset
