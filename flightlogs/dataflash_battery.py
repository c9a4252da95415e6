"""Batteries of a DataFlash log: BAT (3.6 and newer), CURR and CUR2 (older), BCL for cells."""

from collections.abc import Mapping

import numpy as np

from flightlogs.ardupilot import capacity_C, serial
from flightlogs.log import FloatArray
from flightlogs.measured import CELSIUS_K, MAH_C, RawBattery
from flightlogs.table import Table

# label in the log -> factor to SI where the column is a float; CURR of 3.3 and older holds
# integers in hundredths of a volt and an ampere, and only the type of the column tells
VOLTAGE, CURRENT, CHARGE, TEMPERATURE = "Volt", "Curr", "CurrTot", "Temp"
CENTI = 0.01
INTEGERS = frozenset("bBhHiIqQ")
INSTANCE_LABELS = ("Inst", "Instance", "I")
CELLS = {"BCL": range(1, 13), "BCL2": range(13, 15)}  # message -> numbers of its cells
MILLI = 1e-3
CELL_UNUSED_MV = 65535
CELL_HOLD_S = 2.0  # cell voltages are logged with the pack's, at least once a second

Timed = tuple[Table, FloatArray]


def instance_of(table: Table) -> FloatArray:
    """(n,) battery instance of each row; 0 where the log has no such column."""
    for label in INSTANCE_LABELS:
        if label in table.numbers:
            return table.numbers[label]
    return np.zeros(len(table))


def _physical(table: Table, label: str) -> FloatArray:
    values = table.numbers.get(label)
    if values is None:
        return np.full(len(table), np.nan)
    return values * CENTI if table.types[label] in INTEGERS else values


def _split(name: str, timed: Mapping[str, Timed]) -> list[tuple[str, Table, FloatArray, int]]:
    """(label, rows, times, number of the battery) of each battery in a message type."""
    if name not in timed:
        return []
    table, time_s = timed[name]
    if not any(label in table.numbers for label in INSTANCE_LABELS):
        return [(name, table, time_s, int(name.endswith("2")))]
    found = instance_of(table)
    return [
        (f"{name}[{i}]", table.select(found == i), time_s[found == i], i)
        for i in dict.fromkeys(found[np.isfinite(found)].astype(int).tolist())
    ]


def _cells(timed: Mapping[str, Timed], instance: int, at_s: FloatArray) -> FloatArray | None:
    """(n, cells) held to the battery's times; None if the log has no cells of it, or one."""
    held = [_held(timed[name], places, instance, at_s) for name, places in CELLS.items()
            if name in timed]  # fmt: skip
    cells = np.hstack([np.empty((at_s.size, 0)), *held])
    return cells if cells.shape[1] > 1 else None


def _held(timed: Timed, places: range, instance: int, at_s: FloatArray) -> FloatArray:
    """(n, cells) of one message, those that were ever measured."""
    table, time_s = timed
    rows = (instance_of(table) == instance) & np.isfinite(time_s)
    labels = [label for i in places if (label := f"V{i}") in table.numbers]
    if not rows.any() or not labels:
        return np.empty((at_s.size, 0))
    cells = np.column_stack([table.numbers[label][rows] for label in labels])
    cells = np.where((cells > 0) & (cells < CELL_UNUSED_MV), cells * MILLI, np.nan)
    cells = cells[:, np.isfinite(cells).any(axis=0)]
    last = np.searchsorted(time_s[rows], at_s, side="right") - 1
    age_s = at_s - time_s[rows][np.maximum(last, 0)]
    fresh = (last >= 0) & (age_s <= CELL_HOLD_S)
    return np.where(fresh[:, None], cells[np.maximum(last, 0)], np.nan)


def raw_batteries(
    timed: Mapping[str, Timed], parameters: Mapping[str, float]
) -> tuple[RawBattery, ...]:
    """Every battery of the log in order of appearance."""
    names = ("BAT", "BAT2") if "BAT" in timed else ("CURR", "CUR2")
    found = [entry for name in names for entry in _split(name, timed)]
    return tuple(_raw(entry, timed, parameters) for entry in found if len(entry[1]))


def _raw(
    entry: tuple[str, Table, FloatArray, int],
    timed: Mapping[str, Timed],
    parameters: Mapping[str, float],
) -> RawBattery:
    label, table, time_s, number = entry
    charge_mAh, celsius = table.numbers.get(CHARGE), table.numbers.get(TEMPERATURE)
    cells = _cells(timed, number, time_s)
    return RawBattery(
        label=label,
        source=f"{label}.{CURRENT}",
        time_s=time_s,
        current_A=_physical(table, CURRENT),
        voltage_V=_physical(table, VOLTAGE),
        charge_C=None if charge_mAh is None else charge_mAh * MAH_C,
        temperature_K=None if celsius is None else celsius + CELSIUS_K,
        cell_voltage_V=cells,
        series=None if cells is None else cells.shape[1],
        capacity_C=capacity_C(parameters, number),
        serial=serial(parameters, number),
    )
