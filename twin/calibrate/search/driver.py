"""`search`: evaluates what the course proposes, and says now and then how it stands."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.calibrate.search.course import Course, Stage
from twin.calibrate.search.journal import Journal, SearchError
from twin.calibrate.search.members import MEMBERS

FloatArray = npt.NDArray[np.float64]
Evaluate = Callable[[FloatArray], FloatArray]
"""(m, k) points of the unit box -> (m,) finite costs."""

AT_ONCE = 16  # points given to `evaluate`: whoever stops a search of slow costs need not wait long


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Best:
    """How a search stands after some evaluations.

    Attributes:
        point: (k,) the best so far, in the unit box.
        cost: of it.
        evaluations: so far.
        algorithm: that proposed the last of them.
        stage: what they were for.
    """

    point: FloatArray
    cost: float
    evaluations: int
    algorithm: str
    stage: Stage


def search(  # noqa: PLR0913
    evaluate: Evaluate, dimension: int, *, seed: int, evaluations: int,
    start: npt.ArrayLike | None = None, state: Journal | None = None,
    members: Sequence[str] = tuple(MEMBERS),
) -> Iterator[Best]:  # fmt: skip
    """Minimise `evaluate` over the unit box of `dimension`, one `Best` after some evaluations.

    AT_ONCE of them, or fewer. Stop iterating whenever it is good enough; no more than `evaluations`
    are made in all. `start`, (k,) or (m, k), is evaluated first. A `state` is appended to as the
    search goes; one that holds evaluations of this search continues it, beginning with how it
    stood, and `evaluations` counts them. The course is that of `seed` whatever `evaluations` is.
    `members` are those of MEMBERS that take part.

    Raises:
        SearchError: arguments that do not fit each other, costs that are not finite or not one a
            point, or a `state` of another search.
    """
    first = _start(start, dimension)
    if dimension < 1 or evaluations < 1:
        raise SearchError(f"dimension {dimension}, evaluations {evaluations}: expected 1 or more")
    if not members or not set(members) <= set(MEMBERS):
        raise SearchError(f"members {tuple(members)}: expected some of {tuple(MEMBERS)}")
    course = Course(dimension, seed, first, members)
    return _steps(evaluate, course, evaluations, Journal() if state is None else state)


def _steps(
    evaluate: Evaluate, course: Course, evaluations: int, journal: Journal
) -> Iterator[Best]:
    turns, done, held = course.turns(), 0, min(len(journal), evaluations)
    proposal = next(turns)
    point, cost = proposal.points[0], np.inf
    while True:
        told = []
        for first in range(0, len(proposal.points), AT_ONCE):
            points = proposal.points[first : first + AT_ONCE][: evaluations - done]
            costs = _costs(evaluate, points, journal, done)
            told.append(costs)
            done += len(points)
            at = int(np.argmin(costs))
            if costs[at] < cost:
                point, cost = points[at], float(costs[at])
            if done >= held:
                yield Best(
                    point=point, cost=cost, evaluations=done,
                    algorithm=proposal.algorithm, stage=proposal.stage,
                )  # fmt: skip
            if done >= evaluations:
                return
        proposal = turns.send(np.concatenate(told))


def _costs(evaluate: Evaluate, points: FloatArray, journal: Journal, at: int) -> FloatArray:
    """(m,) from the journal as far as it reaches, then evaluated and recorded."""
    known = journal.known(at, points)
    fresh = points[len(known) :]
    if not len(fresh):
        return known
    costs = np.array(evaluate(fresh.copy()), dtype=float)
    if costs.shape != fresh.shape[:1]:
        raise SearchError(f"evaluate gave {costs.shape} costs for {len(fresh)} points")
    if not np.isfinite(costs).all():
        raise SearchError(
            f"evaluate gave {costs[~np.isfinite(costs)][0]} for the point "
            f"{fresh[~np.isfinite(costs)][0].tolist()}: give a large finite cost instead"
        )
    journal.record(fresh, costs)
    return np.append(known, costs)


def _start(start: npt.ArrayLike | None, dimension: int) -> FloatArray:
    """(m, k), none of them outside."""
    points = np.empty((0, dimension)) if start is None else np.atleast_2d(np.array(start, float))
    if points.ndim != 2 or points.shape[1] != dimension:
        raise SearchError(f"start {points.shape}: expected (points, {dimension})")
    if not ((points >= 0.0) & (points <= 1.0)).all():
        raise SearchError("start: every coordinate must be within 0 and 1")
    return points
