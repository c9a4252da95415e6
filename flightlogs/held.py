"""What is measured more seldom than it is logged: `measured_anew`.

One channel by itself; whole lines of a CSV that are written again: `twin.renewed`.
"""

import numpy as np
import numpy.typing as npt

from flightlogs.errors import LogWarning
from flightlogs.log import FloatArray

BoolArray = npt.NDArray[np.bool_]

LOADED = 0.25  # of the median current: at rest everything stands still
LEAST_STANDS = 20  # fewer tell nothing of their lengths
REGULAR = 0.7  # of the usual length: a sensor's own clock makes hardly a shorter one
MOVES = 1.5  # steps of the values: what moves by one at a time is slow, and rounded
ALIKE = 1e-6  # V or A: values that differ by less are one


def measured_anew(values: FloatArray, current_A: FloatArray) -> BoolArray:
    """(n,) where a voltage or a current was measured, not repeated; all, unless it plainly is held.

    A sensor slower than its log makes a value stand for one length of time, or several of them, and
    move by several of its steps then. Rounding makes it stand for any time, and what it rounds for
    long moves by one step. To the noise of a recording repeats are silence, and a fit counts each
    as if it were another sample.

    Args:
        values: (n,), NaN where not measured; of a vehicle in flight.
        current_A: (n,) of the pack at the same times, which says what is a rest.
    """
    known = np.flatnonzero(np.isfinite(values))
    own, size_A = values[known], np.abs(current_A[known])
    change = np.abs(np.diff(own))
    new = np.flatnonzero(change > ALIKE) + 1
    loaded = size_A > LOADED * np.median(size_A) if known.size else np.zeros(0, dtype=bool)
    under = loaded[new[:-1]]
    stands, moves = np.diff(new)[under], change[new[:-1] - 1][under]
    out = np.ones(values.size, dtype=bool)
    if stands.size < LEAST_STANDS:
        return out
    usual, between = float(np.median(stands)), np.diff(np.unique(own))
    regular = usual >= 2 and float(np.quantile(stands, 0.05)) >= REGULAR * usual
    if regular and float(np.median(moves)) > MOVES * float(np.median(between[between > ALIKE])):
        out[known[1:]] = change > ALIKE
    return out


def voltage_held_warning(
    voltage_V: FloatArray, current_A: FloatArray, where: str
) -> LogWarning | None:
    """How many samples of a voltage (n,) repeat it beside a current (n,), see `measured_anew`."""
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


def current_held_warning(repeats: int, samples: int, where: str) -> LogWarning | None:
    """How many of the samples of a current repeat it."""
    if not repeats:
        return None
    return LogWarning(
        "current_held",
        f"the current is measured more seldom than it is logged: {repeats} of {samples} samples "
        "repeat it; it is taken as straight between the others",
        where,
    )
