"""From a good guess to the estimate: least squares, and what they must be given first.

In this order: what coarse steps and mesh miss; a weight for each test by what the model misses in
it; parameters that these tests do not tell, held at their prior.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.calibrate.answer import excess_of, not_identified
from twin.calibrate.cell_map import START_V, Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.polish import polish

FloatArray = npt.NDArray[np.float64]

SLIGHT = 0.2  # more noise than was expected in a test, relative: not worth another fit
MOST_REFINEMENTS = 4
UNNOTICED = 0.3
"""Norm of a change of the residuals that is not worth another fit: as these have unit variance, it
moves no parameter by more of its standard errors."""


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """The best so far: `q` (k,) of `problem`, and half its sum of squares."""

    problem: Problem
    q: FloatArray
    cost: float


def settled(problem: Problem, start: FloatArray) -> Iterator[Settled]:
    """All of it from `start` (k,); the last is the estimate."""
    best = None
    for best in least_squares(problem, start):
        yield best
    assert best is not None
    yield from weighed(best)


def weighed(best: Settled) -> Iterator[Settled]:
    """Weights, then what is held; from where `least_squares` end."""
    problem = reweighted(best.problem, best.q)
    if problem is not None:
        ends = [_end(problem, start) for start in (best.q, _as_known(problem, best.q))]
        best = min([end for end in ends if end is not None], key=lambda end: end.cost, default=best)
        yield best
    problem = held_back(best.problem, best.q)
    if problem is not None:
        end = _end(problem, np.where(problem.held, 0.0, best.q))
        yield best if end is None else end


def _end(problem: Problem, start: FloatArray) -> Settled | None:
    """Where least squares lead; None if no cell has the values of `start` (k,)."""
    try:
        *_, end = least_squares(problem, start)
    except Infeasible:
        return None
    return end


def _as_known(problem: Problem, q: FloatArray) -> FloatArray:
    """The cell as it was known, each test starting as in `q` (k,).

    Tests that weigh less may leave the least squares in a valley far from all that was known, in
    which they would not be now.
    """
    of_cell = [not p.name.startswith(START_V) for p in problem.parameters]
    return np.where(of_cell, 0.0, q)


def least_squares(problem: Problem, start: FloatArray) -> Iterator[Settled]:
    """Polished; then with what steps and mesh miss there, until that changes no more.

    The first is `start` (k,) itself; Infeasible if no cell has its values.
    """
    q = start
    for _ in range(MOST_REFINEMENTS):
        for polished in polish(problem, q):
            q = polished.q
            yield Settled(problem, q, polished.cost)
        before, problem = problem, problem.refined(q)
        if _moved(before, problem) < UNNOTICED:
            return


def reweighted(problem: Problem, q: FloatArray) -> Problem | None:
    """Tests weighed by what the model misses in them; None if that is what was expected.

    What was expected of the residuals knows of noise alone. Where the model itself is off, and the
    same way in many samples, they would drive parameters far from their prior to no purpose. To be
    done once: a test that weighs less is missed by more, so weights that are repeated run away.
    """
    scale = np.sqrt(excess_of(problem, problem.residuals(q)))
    if scale.max() <= 1.0 + SLIGHT:
        return None
    return problem.of_other_tests(
        [
            replace(t, sigma_V=t.sigma_V * max(1.0, s))
            for t, s in zip(problem.tests, scale.tolist(), strict=True)
        ]
    )


def held_back(problem: Problem, q: FloatArray) -> Problem | None:
    """What the tests do not tell held at its prior; None if they tell everything."""
    names = not_identified(problem, q)
    return problem.holding(names) if names else None


def _moved(before: Problem, after: Problem) -> float:
    changes = [
        (b.missed_V - a.missed_V) / b.sigma_V
        for a, b in zip(before.tests, after.tests, strict=True)
    ]
    return float(np.linalg.norm(np.concatenate(changes)))
