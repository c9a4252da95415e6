"""What was measured of a pack along its life: check-ups from a CSV file."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TextIO

import numpy as np
import numpy.typing as npt

from twin.calibrate.table import CalibrationError
from twin.columns import Lines, Place, TableError, column, named, table_lines

FloatArray = npt.NDArray[np.float64]

CYCLE = re.compile(r"^\W*cycles?(\W+(number|count|index|no\.?))?(\W+1)?$")
# quantity -> words of a header that mean it, and unit -> factor to SI
COLUMNS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "capacity_C": ("capacity", {"ah": 3600.0, "mah": 3.6, "as": 1.0}),
    "resistance_ohm": ("resist", {"ohm": 1.0, "mohm": 1e-3, "ω": 1.0, "mω": 1e-3}),
}
LEAST = 3  # check-ups: one begins, two tell a course


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckUps:
    """Of one pack, at its terminals.

    Attributes:
        cycle: (n,) so many since it was new, increasing; 0 before the first.
        capacity_C: (n,) that was measured.
        resistance_ohm: (n,) likewise; None if it was not.
    """

    cycle: npt.NDArray[np.int64]
    capacity_C: FloatArray
    resistance_ohm: FloatArray | None = None

    def __len__(self) -> int:
        return self.cycle.size

    def before(self, count: int) -> "CheckUps":
        """The first `count`."""
        ohm = None if self.resistance_ohm is None else self.resistance_ohm[:count]
        return CheckUps(
            cycle=self.cycle[:count], capacity_C=self.capacity_C[:count], resistance_ohm=ohm
        )


def read_check_ups(stream: TextIO, *, name: str) -> CheckUps:
    """Columns "Cycle", "Capacity / Ah" and, if there is one, "Resistance / ohm".

    Raises:
        TableError: it is no CSV, a column is missing, or a value is no number.
        CalibrationError: a value is not positive, cycles are not whole or do not increase, or there
            are too few check-ups.
    """
    header, lines = table_lines(stream, name=name)
    places = _places(header)
    for wanted, like in (("cycle", "Cycle"), ("capacity_C", "Capacity / Ah")):
        if wanted not in places:
            raise TableError(f"{name}: no column for {wanted}: expected a header {like!r}")
    if len(lines) < LEAST:
        raise CalibrationError(f"{name}: {len(lines)} check-ups: expected {LEAST} or more")
    values = {quantity: _full(lines, p, quantity, name) for quantity, p in places.items()}
    cycle = values["cycle"]
    if np.any(cycle != np.round(cycle)) or cycle[0] < 0 or np.any(np.diff(cycle) <= 0):
        raise CalibrationError(
            f"{name}: cycles {cycle.tolist()}: expected whole numbers, each more than the last"
        )
    for quantity in COLUMNS:
        if quantity in values and values[quantity].min() <= 0:
            raise CalibrationError(f"{name}: {quantity} is not positive in every line")
    return CheckUps(
        cycle=cycle.astype(np.int64),
        capacity_C=values["capacity_C"],
        resistance_ohm=values.get("resistance_ohm"),
    )


def _full(lines: Lines, place: Place, quantity: str, name: str) -> FloatArray:
    values = column(lines, place, quantity, name, most=math.inf)
    if (blank := np.flatnonzero(np.isnan(values))).size:
        line, row = lines[blank[0]]
        text = row[place[0]] if place[0] < len(row) else ""
        raise TableError(f"{name}, line {line}: {quantity} is {text!r}: expected a number")
    return values


def _places(header: list[str]) -> dict[str, Place]:
    """Quantity -> the first column that has it."""
    out: dict[str, Place] = {}
    for place, title in enumerate(header):
        if CYCLE.match(title.strip().lstrip("\ufeff").casefold()):
            out.setdefault("cycle", (place, 1.0, 0.0))
        what, unit = named(title)
        for quantity, (word, units) in COLUMNS.items():
            if unit in units and word in what:
                out.setdefault(quantity, (place, units[unit], 0.0))
    return out
