"""A voltage that is measured more seldom than it is logged: `measured_anew`."""

import numpy as np
import numpy.typing as npt

from flightlogs.errors import LogWarning
from flightlogs.log import FloatArray

BoolArray = npt.NDArray[np.bool_]

LOADED = 0.25  # of the median current: at rest everything stands still
LEAST_STANDS = 20  # fewer tell nothing of their lengths
REGULAR = 0.7  # of the usual length: a sensor's own clock makes hardly a shorter one
MOVES = 1.5  # steps of the voltage: what moves by one at a time is slow, and rounded
ALIKE_V = 1e-6  # two values that are one step


def measured_anew(voltage_V: FloatArray, current_A: FloatArray) -> BoolArray:
    """(n,) where a voltage was measured and not repeated; all, unless it plainly was held.

    A sensor slower than its log makes the voltage stand for one length of time, or several of them,
    and move by several of its steps then. Rounding makes it stand for any time, and what it rounds
    for long moves by one step. To the noise of a recording repeats are silence, and a fit counts
    each as if it were another sample.

    Args:
        voltage_V: (n,), NaN where not measured.
        current_A: (n,), NaN where unknown.
    """
    known = np.flatnonzero(np.isfinite(voltage_V))
    own_V = voltage_V[known]
    change_V = np.abs(np.diff(own_V))
    new = np.flatnonzero(change_V > ALIKE_V) + 1
    size_A = np.abs(current_A[known])
    loaded = size_A > LOADED * np.nanmedian(size_A) if known.size else np.zeros(0, dtype=bool)
    under = loaded[new[:-1]]
    stands, moves_V = np.diff(new)[under], change_V[new[:-1] - 1][under]
    out = np.ones(voltage_V.size, dtype=bool)
    if stands.size < LEAST_STANDS:
        return out
    usual, levels_V = float(np.median(stands)), np.unique(own_V)
    step_V = float(np.median(np.diff(levels_V)[np.diff(levels_V) > ALIKE_V]))
    regular = usual >= 2 and float(np.quantile(stands, 0.05)) >= REGULAR * usual
    if regular and float(np.median(moves_V)) > MOVES * step_V:
        out[known[1:]] = change_V > ALIKE_V
    return out


def held_warning(voltage_V: FloatArray, current_A: FloatArray, where: str) -> LogWarning | None:
    """How many samples of a voltage (n,) repeat it, see `measured_anew`."""
    repeats = int(np.count_nonzero(~measured_anew(voltage_V, current_A)))
    if not repeats:
        return None
    return LogWarning(
        "voltage_held",
        f"the voltage is measured more seldom than it is logged: {repeats} of "
        f"{int(np.count_nonzero(np.isfinite(voltage_V)))} samples repeat it; the twin is compared "
        "with the others",
        where,
    )
