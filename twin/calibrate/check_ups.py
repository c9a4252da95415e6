"""What was measured of a pack along its life: check-ups from a CSV file."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TextIO

import numpy as np
import numpy.typing as npt

from twin.calibrate.table import CalibrationError, csv_lines, named

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
        CalibrationError: a column is missing, a value is no positive number, cycles are not whole
            or do not increase, or there are too few check-ups.
    """
    rows = csv_lines(stream, name=name)
    _, header = next(rows, (0, []))
    places = _places(header)
    for wanted, like in (("cycle", "Cycle"), ("capacity_C", "Capacity / Ah")):
        if wanted not in places:
            raise CalibrationError(f"{name}: no column for {wanted}: expected a header {like!r}")
    lines = [(number, row) for number, row in rows if any(cell.strip() for cell in row)]
    if len(lines) < LEAST:
        raise CalibrationError(f"{name}: {len(lines)} check-ups: expected {LEAST} or more")
    values = {
        quantity: np.array([_number(row, place, f"{name}, line {n}: {quantity}")
                            for n, row in lines]) * factor
        for quantity, (place, factor) in places.items()
    }  # fmt: skip
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


def _places(header: list[str]) -> dict[str, tuple[int, float]]:
    """Quantity -> place and factor of the first column that has it."""
    out: dict[str, tuple[int, float]] = {}
    for place, title in enumerate(header):
        if CYCLE.match(title.strip().lstrip("\ufeff").casefold()):
            out.setdefault("cycle", (place, 1.0))
        what, unit = named(title)
        for quantity, (word, units) in COLUMNS.items():
            if unit in units and word in what:
                out.setdefault(quantity, (place, units[unit]))
    return out


def _number(row: list[str], place: int, where: str) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise CalibrationError(f"{where} is {text!r}: expected a number")
    return value
