"""A load from a CSV file: a time, a current, and the voltage if it was measured."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np
import numpy.typing as npt

from twin.load import Between, Load, LoadError

FloatArray = npt.NDArray[np.float64]

# Our name -> the headers that mean it: our own tables and the Battery Data Format.
HEADERS = {
    "time_s": ("time_s", "test time / s"),
    "current_A": ("current_a", "current / a"),
    "voltage_V": ("voltage_v", "recorded_v", "voltage / v"),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadTable:
    """The columns of a file: (n,) each, the voltage NaN where it is empty, or None."""

    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray | None

    def load(self, *, between: Between, ambient_K: float) -> Load:
        """As the twin takes it; LoadError if it cannot."""
        return Load(
            time_s=self.time_s, current_A=self.current_A, between=between, ambient_K=ambient_K
        )


def read_load_csv(stream: TextIO, *, name: str) -> LoadTable:
    """Columns by their header; discharge current must be positive.

    LoadError, with the line, if a column is missing or a cell is no number.
    """
    rows = csv.reader(stream)
    header = [title.strip().casefold() for title in next(rows, [])]
    places = {
        ours: next((header.index(h) for h in known if h in header), None)
        for ours, known in HEADERS.items()
    }
    for ours in ("time_s", "current_A"):
        if places[ours] is None:
            expected = " or ".join(repr(h) for h in HEADERS[ours])
            raise LoadError(f"{name}: no column {expected}; the first line has {header}")
    table = [(rows.line_num, row) for row in rows if row]
    columns = {ours: _column(table, place, ours, name) for ours, place in places.items()}
    time_s, current_A = columns["time_s"], columns["current_A"]
    assert time_s is not None  # both were looked for above
    assert current_A is not None
    return LoadTable(time_s=time_s, current_A=current_A, voltage_V=columns["voltage_V"])


def _column(
    table: Sequence[tuple[int, Sequence[str]]], place: int | None, ours: str, name: str
) -> FloatArray | None:
    if place is None:
        return None
    out = np.full(len(table), np.nan)
    for k, (line, row) in enumerate(table):
        text = row[place].strip() if place < len(row) else ""
        if not text and ours == "voltage_V":
            continue
        try:
            out[k] = float(text)
        except ValueError as e:
            raise LoadError(f"{name}, line {line}: {ours} is {text!r}, no number") from e
    return out
