"""What a fit found of its tests, in words: how much they count, and where they began."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.settle import MISSED_V, taken_V

FloatArray = npt.NDArray[np.float64]

OTHER_START = 0.005  # of the charge
OTHERS = 1.01  # times what the others count as missed: more is no rounding


def of_weights(problem: Problem) -> list[str]:
    """Of tests that count for less than those that a twin follows, or than the others."""
    missed_V = taken_V(problem)
    middle_V, out = float(missed_V.min()), []
    if middle_V > MISSED_V:
        out.append(
            f"the twin misses these tests by about {1e3 * middle_V:.1f} mV a cell, more than the "
            f"{1e3 * MISSED_V:.0f} mV allowed: the tests get less weight against what is known "
            "beforehand"
        )
    less = [t.name for t, v in zip(problem.tests, missed_V, strict=True) if v > OTHERS * middle_V]
    if less:
        out.append(
            f"the twin misses {', '.join(less)} by far more than the others: beside them "
            f"{'they count' if len(less) > 1 else 'it counts'} for less"
        )
    return out


def of_starts(problem: Problem, q: FloatArray, tests: Sequence[ReferenceTest]) -> list[str]:
    """Of tests that began with another charge than a replay of the pack does."""
    told = problem.pack.initial_soc
    own = [problem.mapped(q, k).numbers["initial_soc"] for k in range(len(tests))]
    return [
        f"{t.name}: began with {soc:.1%} of its charge, as fitted; a pack starts with {told:.1%}"
        for t, soc in zip(tests, own, strict=True)
        if abs(soc - told) > OTHER_START and not problem.pack.soc_by_rest
    ]
