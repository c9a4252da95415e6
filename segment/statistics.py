"""`LoadStatistics` of a stretch of samples."""

import numpy as np

from segment.runs import FloatArray, moving_average
from segment.segment import LoadStatistics

RIPPLE_WINDOW_s = 2.0  # slower than control activity, faster than a manoeuvre


def load_statistics(
    time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray
) -> LoadStatistics:
    """Of samples without a gap, n >= 2; between samples current and voltage run straight.

    Args:
        time_s: (n,).
        current_A: (n,) discharge positive.
        voltage_V: (n,); any NaN makes the energy NaN.
    """
    dt = np.diff(time_s)
    total_s = float(dt.sum())
    i0, i1 = current_A[:-1], current_A[1:]
    v0, v1 = voltage_V[:-1], voltage_V[1:]
    charge = float(dt @ (i0 + i1) / 2)
    squared = float(dt @ (i0**2 + i0 * i1 + i1**2) / 3)
    energy = float(dt @ (2 * i0 * v0 + i0 * v1 + i1 * v0 + 2 * i1 * v1) / 6)
    ripple = current_A - moving_average(time_s, current_A, RIPPLE_WINDOW_s)
    return LoadStatistics(
        charge_C=charge,
        energy_J=energy,
        mean_A=charge / total_s,
        rms_A=float(np.sqrt(squared / total_s)),
        p99_A=weighted_percentile(time_s, current_A, 99.0),
        ripple_A=float(np.std(ripple)),
    )


def weighted_percentile(time_s: FloatArray, values: FloatArray, percent: float) -> float:
    """Percentile over time: each sample counts for half the steps beside it."""
    dt = np.diff(time_s)
    weight = np.concatenate([dt, [0.0]]) + np.concatenate([[0.0], dt])
    order = np.argsort(values)
    share = (np.cumsum(weight[order]) - weight[order] / 2) / weight.sum()
    return float(np.interp(percent / 100, share, values[order]))
