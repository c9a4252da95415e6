"""From a good guess to the estimate: least squares, and what they must be given first.

That is what coarse steps and mesh miss; then parameters that these tests do not tell are held at
their prior. Before all this, what the twin may miss (`of_a_model`).
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.calibrate.answer import not_identified
from twin.calibrate.cell_map import Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.polish import SMALL_GAIN, polish

FloatArray = npt.NDArray[np.float64]

MISSED_V, STRETCHES = 5e-3, 50.0
"""What a twin may miss of a measured cell, and in how many stretches of a test by itself: as if all
that it misses were noise, the thousand samples of a pulse test outweigh a discharge."""
MOST_REFINEMENTS = 4
MINDED = 2.0
"""Of the cost, for each parameter held at its prior: as if that were two standard errors off; so
many times more as the twin misses the tests by more than it may: what they say is worth less."""
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
    yield from held_back(best)


def held_back(best: Settled) -> Iterator[Settled]:
    """What the tests do not tell held at its prior; from where `least_squares` end.

    Nothing is held if that costs more than MINDED: a diffusion too fast to be seen tells nothing of
    itself either, and at its prior it may be too slow.
    """
    names = not_identified(best.problem, best.q)
    if not names:
        return
    problem, steps = best.problem.holding(names), []
    with suppress(Infeasible):
        steps = list(least_squares(problem, np.where(problem.held, 0.0, best.q)))
    worse = MINDED * len(names) * max(1.0, best.cost / _allowed(best.problem))
    if steps and steps[-1].cost < best.cost + worse:
        yield from steps


def least_squares(
    problem: Problem, start: FloatArray, *, small_gain: float = SMALL_GAIN
) -> Iterator[Settled]:
    """Polished; then with what steps and mesh miss there, until that changes no more.

    The first is `start` (k,) itself; Infeasible if no cell has its values. `small_gain` as `polish`
    has it.
    """
    q = start
    for _ in range(MOST_REFINEMENTS):
        for polished in polish(problem, q, small_gain=small_gain):
            q = polished.q
            yield Settled(problem, q, polished.cost)
        before, problem = problem, problem.refined(q)
        if _moved(before, problem) < UNNOTICED:
            return


def of_a_model(problem: Problem) -> Problem:
    """The same where the twin is not the cell: tests missed by MISSED_V and noise."""
    return problem.of_other_tests([t.of_a_model(MISSED_V, STRETCHES) for t in problem.tests])


def _allowed(problem: Problem) -> float:
    """Cost of noise, and of what a twin may miss of the tests `of_a_model`."""
    squares = [np.minimum((MISSED_V / t.sigma_V) ** 2, 1.0).sum() for t in problem.tests]
    return 0.5 * float(sum(squares))


def _moved(before: Problem, after: Problem) -> float:
    changes = [
        (b.missed_V - a.missed_V) / b.sigma_V
        for a, b in zip(before.tests, after.tests, strict=True)
    ]
    return float(np.linalg.norm(np.concatenate(changes)))
