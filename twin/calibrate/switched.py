"""Rows of a log that have the voltage of one current and the other current beside it.

Many loggers read the two one after the other. In a row that falls on a change of the current, then,
one is of before and the other of after. Such a voltage is off by all that the cell loses at once,
and a single one outweighs a test: it is left out, and counted.
"""

import numpy as np
import numpy.typing as npt

from twin.calibrate.phases import steady_A

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

FELT_V = 1e-3  # changes of the current that are felt by more are no noise of it, see `phases.py`
LEAST_V = 0.01  # change of the voltage at a change of the current: less is no matter
TIMES = 4.0  # what changes beside the change of the current over what changes with it, at least
FALLS = 4.0  # and over the step that follows or comes before: a relaxing cell changes ever less


def mixed_rows(current_A: FloatArray, voltage_V: FloatArray) -> IntArray:
    """Rows at changes of the current (n,) whose voltage (n,) is of the other side of the change.

    Nearly all of the voltage's change has to lie in the step after that of the current (the row has
    the voltage of before) or in the one before it (the row before has that of after).
    """
    if current_A.size < 2:
        return np.zeros(0, dtype=np.int64)
    least_A = steady_A(current_A, voltage_V, felt_V=FELT_V)
    k = np.flatnonzero(np.abs(np.diff(current_A)) > least_A) + 1
    step_A, step_V = (np.pad(np.diff(v), 2) for v in (current_A, voltage_V))  # k + 1: to row k

    def fell_V(rows: int) -> FloatArray:
        """By the step so many rows after the change of the current."""
        return np.asarray(step_V[k + 1 + rows] * -np.sign(step_A[k + 1]))

    def beside(rows: int) -> npt.NDArray[np.bool_]:
        """Nearly all of the change is there, and it is no change of its own current's."""
        least_V = np.maximum(
            LEAST_V, np.maximum(TIMES * fell_V(0), FALLS * np.abs(fell_V(2 * rows)))
        )
        own = np.abs(step_A[k + 1 + rows]) > np.abs(step_A[k + 1]) / TIMES
        return np.asarray((fell_V(rows) > least_V) & ~own)

    after, before = beside(1), beside(-1)
    return np.sort(np.concatenate([k[after], k[before & ~after] - 1]))
