"""Tables that somebody measured, from CSV: what a header names, in which unit, and its numbers."""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TextIO

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Lines = Sequence[tuple[int, Sequence[str]]]
"""Number of each line in its file, and its cells."""
Place = tuple[int, float, float]
"""Of a column: where it stands, and factor and offset to SI."""

TEMPERATURE = r"(?<!at)temp|^t$|^t[ _]?(?:cell|surf|can|case|skin|amb|air|chamber|oven)"
# quantity -> words of a header that mean it, and unit -> (factor, offset) to SI
QUANTITIES: Mapping[str, tuple[str, Mapping[str, tuple[float, float]]]] = {
    "time_s": (
        r"time|^t$",
        {"s": (1.0, 0.0), "ms": (1e-3, 0.0), "us": (1e-6, 0.0), "min": (60.0, 0.0),
         "h": (3600.0, 0.0)},
    ),
    "current_A": (r"current|^<?i>?$|^i_?bat(?:t(?:ery)?)?$", {"a": (1.0, 0.0), "ma": (1e-3, 0.0)}),
    "voltage_V": (
        r"voltage|potential|recorded|^[uve]$|^e(?:we|cell)$|^[uv]_?bat(?:t(?:ery)?)?$",
        {"v": (1.0, 0.0), "mv": (1e-3, 0.0)},
    ),
    "temperature_K": (TEMPERATURE, {"k": (1.0, 0.0), "c": (1.0, 273.15)}),
    "ambient_K": (TEMPERATURE, {"k": (1.0, 0.0), "c": (1.0, 273.15)}),
}  # fmt: skip
TEMPERATURES = ("temperature_K", "ambient_K")
EXAMPLES = {"time_s": "Time / s", "current_A": "Current / A", "voltage_V": "Voltage / V"}
LONG_UNITS = {
    "sec": "s", "second": "s", "seconds": "s", "hours": "h", "hour": "h", "minutes": "min",
    "amps": "a", "ampere": "a", "volt": "v", "volts": "v", "degc": "c", "°c": "c", "celsius": "c",
    "kelvin": "k", "µs": "us", "μs": "us",
}  # fmt: skip
NONE = 1e6  # SI, of all but times: loggers write the largest number that they have for no answer
KELVIN = 200.0, 400.0  # what a pack may have
NOT_OF_THE_PACK = re.compile(r"amb|air|chamber|oven")
BEGINS_ANEW = re.compile(r"(?:step|cycle).*time", re.IGNORECASE)
CELL = re.compile(r"cell\D*(?P<number>\d{1,3})(?!\d)")
"""In a header with the unit of a voltage: that of one cell of the pack, by its place."""
HEADER = re.compile(r"^(?P<what>.*?)[\s_]*(?:[\[(/_]|\s)\s*(?P<unit>[a-zµμ°]+)\s*[\])]?$")


class TableError(ValueError):
    """What cannot be read as a table of measurements; the text says what, where and what to do."""


def table_lines(stream: TextIO, *, name: str) -> tuple[list[str], Lines]:
    """The first line of a CSV, and the others that are not blank.

    Raises:
        TableError: it is no text, or a quote is not closed, and all behind it too long for a cell.
    """
    rows = csv.reader(stream)
    try:
        header = next(rows, [])
        return header, [(rows.line_num, row) for row in rows if any(map(str.strip, row))]
    except csv.Error as e:
        raise TableError(f"{name}, line {rows.line_num}: not a readable CSV: {e}") from e
    except UnicodeDecodeError as e:
        raise TableError(f"{name}: not a readable CSV, which is UTF-8 text with commas") from e


def named(title: str) -> tuple[str, str]:
    """What a header names, and its unit; empty if it does not fit."""
    parts = HEADER.match(_plain(title))
    if parts is None:
        return "", ""
    return parts["what"], LONG_UNITS.get(parts["unit"], parts["unit"])


def _plain(title: str) -> str:
    return title.strip().lstrip("\ufeff").casefold()


def places_of(header: Sequence[str], cells: Iterable[Place]) -> dict[str, Place]:
    """Quantity -> its column, of those there are; those of single `cells` are not looked at."""
    taken = {place for place, _, _ in cells}
    own = ["" if place in taken else title for place, title in enumerate(header)]
    found = {quantity: _column_of(own, quantity) for quantity in QUANTITIES}
    return {quantity: place for quantity, place in found.items() if place is not None}


def _column_of(header: Sequence[str], quantity: str) -> Place | None:
    """The first column whose header names `quantity` with a unit.

    One with our own name for it comes before all others, and a time that begins anew with each
    step or cycle after them.
    """
    words, units = QUANTITIES[quantity]
    found: list[Place] = []
    for place, title in enumerate(header):
        what, unit = named(title)
        around = NOT_OF_THE_PACK.search(what) is not None
        if unit in units and re.search(words, what) and around == (quantity == "ambient_K"):
            found.append((place, *units[unit]))

    def rank(place: Place) -> tuple[bool, bool]:
        title = header[place[0]]
        return _plain(title) != quantity.casefold(), bool(BEGINS_ANEW.search(title))

    return min(found, key=rank, default=None)


def numbered_cells(header: Sequence[str], name: str) -> dict[int, Place]:
    """Number -> the column with that cell's voltage, rising; TableError if one is there twice."""
    units = QUANTITIES["voltage_V"][1]
    found: dict[int, Place] = {}
    for place, title in enumerate(header):
        what, unit = named(title)
        if unit not in units or (cell := CELL.search(what)) is None:
            continue
        number = int(cell["number"])
        if number in found:
            raise TableError(f"{name}: two columns have the voltage of cell {number}")
        found[number] = (place, *units[unit])
    return dict(sorted(found.items()))


def cells_of_a_pack(header: Sequence[str], name: str) -> list[Place]:
    """The same of all cells, whose sum is the pack's voltage; one alone is the pack's own.

    Raises:
        TableError: one is there twice, or one in between is not.
    """
    found = numbered_cells(header, name)
    numbers = list(found)
    if len(found) < 2:
        return []  # of the only cell that was measured
    if numbers[-1] - numbers[0] >= len(numbers):
        raise TableError(
            f"{name}: voltages of the cells {numbers}: expected every number from the first to the "
            "last"
        )
    return list(found.values())


def column(
    lines: Lines, place: Place, quantity: str, name: str, *, most: float = NONE
) -> FloatArray:
    """(n,) SI; NaN where a cell is blank, or says by a number from `most` on that it has no answer.

    A time may be any. TableError, with the line, where it is no number.
    """
    where, factor, offset = place
    out = np.full(len(lines), np.nan)
    for k, (line, row) in enumerate(lines):
        text = row[where].strip() if where < len(row) else ""
        try:
            out[k] = float(text) if text else np.nan
        except ValueError as e:
            raise TableError(f"{name}, line {line}: {quantity} is {text!r}, no number") from e
    values = out * factor + offset
    told = np.isfinite(out) & ((quantity == "time_s") | (np.abs(values) < most))
    return np.where(told, values, np.nan)


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


def untaken_temperature(header: Sequence[str], places: Mapping[str, Place]) -> str:
    """A title that names a temperature where none was taken, its unit not being known; or ""."""
    if any(quantity in places for quantity in TEMPERATURES):
        return ""
    titles = (title.strip() for title in header)
    return next((title for title in titles if re.search(TEMPERATURE, title.casefold())), "")
