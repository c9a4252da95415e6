"""From a good guess to the estimate: least squares, and what they must be given first.

That is what coarse steps and mesh miss; then the tests weigh as much as the twin misses them, and
parameters that they do not tell are held at their prior. Before all this, what the twin may miss
(`of_a_model`).
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
from twin.calibrate.resample import expected_V

FloatArray = npt.NDArray[np.float64]

MISSED_V, STRETCHES = 5e-3, 50.0
"""What a twin may miss of a measured cell, and in how many stretches of a test by itself: as if all
that it misses were noise, the thousand samples of a pulse test outweigh a discharge."""
MOST_REFINEMENTS = 4
SAME_WEIGHTS, MOST_WEIGHTS = 0.1, 4
"""Of what is missed: a smaller change is not worth another fit; and how many there are at most."""
MUCH = 2.0  # times what the twin misses of the test in the middle
MINDED = 2.0  # of the cost, for each parameter held at its prior: as if two standard errors off
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
    yield from weighed_and_held(best)


def weighed_and_held(best: Settled) -> Iterator[Settled]:
    """`weighed`, then `held_back`, from where `least_squares` end."""
    end = best
    for step in weighed(best):
        yield (end := step)
    yield from held_back(end)


def weighed(best: Settled) -> Iterator[Settled]:
    """Fitted again as if the twin missed each test by what it does in the middle, if that is more.

    What it may miss is a guess. Where it misses far more, the tests would outweigh what is known
    beforehand by as much, and what they hardly tell would follow what the twin lacks. A test that
    it misses by more than MUCH times the middle counts as one of which it misses MUCH times less:
    where the twin lacks something in few tests, all others would be missed for their sake.
    """
    end = best
    for _ in range(MOST_WEIGHTS):
        before_V, missed_V = taken_V(end.problem), _missed_V(end)
        if not before_V.all() or np.abs(missed_V / before_V - 1.0).max() < SAME_WEIGHTS:
            return
        for step in least_squares(of_a_model(end.problem, missed_V), end.q):
            yield (end := step)


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
    if steps and steps[-1].cost < best.cost + MINDED * len(names):
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


def of_a_model(problem: Problem, missed_V: FloatArray | float = MISSED_V) -> Problem:
    """The same where the twin is not the cell: tests missed by `missed_V`, of each, and noise."""
    each_V = np.broadcast_to(missed_V, len(problem.tests)).tolist()
    return problem.of_other_tests(
        [t.of_a_model(v, STRETCHES) for t, v in zip(problem.tests, each_V, strict=True)]
    )


def taken_V(problem: Problem) -> FloatArray:
    """(tests,) the `missed_V` of a problem `of_a_model`; 0 of another."""
    shares = (float(np.sqrt(max(1.0, t.at.size / STRETCHES))) for t in problem.tests)
    return np.array([t.model_V / share for t, share in zip(problem.tests, shares, strict=True)])


def _missed_V(best: Settled) -> FloatArray:
    """(tests,) as what each counts: by what the twin misses in a sample, beside noise.

    In the middle of all, not of all together: one that was recorded with an offset would take their
    weight from the rest.
    """
    tests, own_V = best.problem.tests, []
    ends = np.cumsum([t.at.size for t in tests])
    for test, off in zip(tests, np.split(best.problem.residuals(best.q), ends), strict=False):
        noise_V = expected_V(test.noise_V, test.count)
        square = np.mean(((off * test.sigma_V) ** 2 - noise_V**2) / test.shape**2)
        own_V.append(max(float(square), 0.0) ** 0.5)
    middle_V = max(MISSED_V, float(np.median(own_V)))
    return np.maximum(middle_V, np.array(own_V) / MUCH)


def _moved(before: Problem, after: Problem) -> float:
    changes = [
        (b.missed_V - a.missed_V) / b.sigma_V
        for a, b in zip(before.tests, after.tests, strict=True)
    ]
    return float(np.linalg.norm(np.concatenate(changes)))
