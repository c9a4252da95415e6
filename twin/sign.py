"""Whether positive current discharges, as the voltage beside it says."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def discharge_sign(time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray) -> float:
    """1 or -1, the factor that makes discharge positive; 0 where no voltage answers a current.

    Voltage falls with discharge current and with charge that was drawn. Both together decide: a
    clock that is off between current and voltage can turn the first round, but not their sum.

    Args:
        time_s: (n,) increasing.
        current_A: (n,)
        voltage_V: (n,) some may be NaN.
    """
    good = np.isfinite(voltage_V)
    told_V = voltage_V[good]
    drawn_C = np.append(0.0, np.cumsum(np.diff(time_s) * (current_A[1:] + current_A[:-1]) / 2))
    columns = [c[good] - c[good].mean() for c in (current_A, drawn_C) if told_V.size]
    moved = [c / spread for c in columns if (spread := float(c.std())) > 1e-9]
    if not moved or not np.ptp(told_V):
        return 0.0
    slopes = np.linalg.lstsq(np.column_stack(moved), told_V, rcond=None)[0]
    return float(-np.sign(np.sum(slopes)))
