"""Channels that were kept from the twin, from a CSV: temperature, voltages of cells."""

from dataclasses import dataclass
from typing import TextIO

import numpy as np

from twin.columns import (
    KELVIN,
    FloatArray,
    TableError,
    column,
    numbered_cells,
    places_of,
    table_lines,
)
from twin.load_csv import kept_lines, living, possible_K


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HiddenTable:
    """The columns of a file, SI; NaN where a cell of the table is empty or stands for no answer.

    Attributes:
        name: of the file.
        time_s: (n,) on the clock of the recording, increasing.
        temperature_K: (n,) of the pack, or None.
        cell_voltage_V: (cells, n) in the order of their numbers; no rows if there are none.
    """

    name: str
    time_s: FloatArray
    temperature_K: FloatArray | None
    cell_voltage_V: FloatArray


def read_hidden_csv(stream: TextIO, *, name: str) -> HiddenTable:
    """Places by what their headers say of quantity and unit.

    As a load is read, but that no current is needed, and one cell may be alone: time ("time_s"),
    temperature ("temperature_c", "Temperature / degC"; not that of the air), and any number of
    cells ("cell_1_v", "Cell Voltage 2 / mV"). Others are passed over.

    Raises:
        TableError: no CSV, no time, neither channel, a clock that goes back, or a cell that is no
            number; with the line.
    """
    header, lines = table_lines(stream, name=name)
    cells = numbered_cells(header, name)
    places = places_of(header, cells.values())
    warm = places.get("temperature_K")
    if "time_s" not in places or not (warm or cells):
        raise TableError(
            f"{name}: expected a column for time, such as 'time_s', and one for temperature "
            f"('temperature_c') or for cells ('cell_1_v'); the first line has {header}"
        )
    time_s = column(lines, places["time_s"], "time_s", name)
    kept, _ = kept_lines(lines, {"a time": time_s}, name)
    temperature_K, strange = possible_K(
        column(lines, warm, "temperature_K", name)[kept] if warm else None
    )
    if temperature_K is not None and strange and not np.isfinite(temperature_K).any():
        raise TableError(
            f"{name}: no temperature that a pack can have ({KELVIN[0]:g} to {KELVIN[1]:g} K): is "
            "it in the unit that its header says?"
        )
    cells_V, _ = living([column(lines, p, f"cell {k}", name)[kept] for k, p in cells.items()])
    return HiddenTable(
        name=name,
        time_s=time_s[kept],
        temperature_K=temperature_K,
        cell_voltage_V=np.zeros((0, kept.size)) if cells_V is None else cells_V.T,
    )
