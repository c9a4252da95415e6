"""Samples that a logger repeated: `renewed`, the table without them."""

from dataclasses import replace

import numpy as np

from twin.columns import FloatArray
from twin.load_csv import LoadTable

LOADED = 0.25  # of the median current
TOGETHER = 0.6
"""Correlation of what a current and a voltage repeat: of two that are rounded, and a current that
holds, it is small; of a line that is written again it is 1 but for what rounding repeats."""
LEAST = 0.05  # of the lines under load
LEAST_LINES = 100  # fewer are kept: what is left would be too short to judge


def renewed(table: LoadTable) -> LoadTable:
    """Without the lines that repeat current and voltage, where a logger wrote these again.

    A telemetry slower than its log does so: repeats are no samples, and to noise they are silence.
    """
    if table.voltage_V is None or table.time_s.size < LEAST_LINES:
        return table
    loaded = np.abs(table.current_A[1:]) > LOADED * np.median(np.abs(table.current_A))
    if not loaded.any():
        return table
    same = [np.diff(x) == 0.0 for x in (table.current_A, table.voltage_V)]
    both = same[0] & same[1] & loaded  # at rest everything stands still
    current, voltage = (x[loaded] for x in same)
    alike = current.std() > 0.0 < voltage.std() and np.corrcoef(current, voltage)[0, 1] > TOGETHER
    if not alike or np.mean(both[loaded]) < LEAST:
        return table
    kept = np.append(True, ~both)

    def of(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[kept]

    said = (
        f"Lines that repeat current and voltage of the one before: {int(both.sum())} of "
        f"{kept.size}; they were left out."
    )
    return replace(
        table,
        time_s=table.time_s[kept],
        current_A=table.current_A[kept],
        voltage_V=table.voltage_V[kept],
        temperature_K=of(table.temperature_K),
        cell_voltage_V=of(table.cell_voltage_V),
        remarks=(*table.remarks, said),
    )
