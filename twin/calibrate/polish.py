"""From a good guess to the least squares: Gauss-Newton with exact sensitivities, within bounds.

Each step solves the linearised problem within the bounds, damped (Levenberg, Marquardt) by what the
last step was worth: K. Madsen, H. B. Nielsen, O. Tingleff, Methods for non-linear least squares
problems (2nd ed., Technical University of Denmark, 2004), algorithm 3.16.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.optimize import lsq_linear

FloatArray = npt.NDArray[np.float64]

FIRST_DAMPING = 1e-3  # of the largest curvature
SMALL_STEP = 1e-3  # standard deviations of the prior, of the whole step
SMALL_GAIN = 1e-5  # of the cost, and of a half: what noise makes of one residual
MOST_DAMPING = 1e12
MOST_STEPS = 60


class LeastSquares(Protocol):
    """Residuals r (n,) of coordinates q (k,) within bounds."""

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) least and largest coordinates."""
        ...

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (n,) and their derivative (n, k)."""
        ...

    def cost(self, q: FloatArray) -> float:
        """Half the sum of squares of the residuals."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """The best so far.

    Attributes:
        q: (k,) coordinates.
        cost: half the sum of squares.
        steps: linearisations so far.
    """

    q: FloatArray
    cost: float
    steps: int


def polish(
    problem: LeastSquares,
    start: FloatArray,
    *,
    most_steps: int = MOST_STEPS,
    first_damping: float = FIRST_DAMPING,
    small_gain: float = SMALL_GAIN,
) -> Iterator[Polished]:
    """Ever better points, the last one the least squares near `start` (k,).

    The first is `start` itself, within bounds; Infeasible if no cell has its values. From a start
    that is near, a small `first_damping` saves steps. It ends with a step that is expected to lower
    the cost by less than `small_gain` of it.
    """
    low, high = problem.bounds
    q = np.clip(start, low, high)
    residuals, slopes = problem.linearised(q)
    cost = 0.5 * float(residuals @ residuals)
    damping, grow = first_damping * float((slopes**2).sum(axis=0).max()), 2.0
    factor = _triangular(slopes, residuals)
    yield Polished(q, cost, 0)
    for step in range(1, most_steps + 1):
        change = _step(factor, damping, (low - q, high - q))
        expected = cost - 0.5 * float(np.sum((factor @ np.append(change, 1.0)) ** 2))
        trial = np.clip(q + change, low, high)
        trial_cost = problem.cost(trial)
        gain = cost - trial_cost
        if np.linalg.norm(change) < SMALL_STEP or expected < small_gain * (cost + 0.5):
            if gain > 0:
                yield Polished(trial, trial_cost, step)
            return
        if gain <= 0:
            damping, grow = damping * grow, 2.0 * grow
            if damping > MOST_DAMPING:
                return
            continue
        q, cost = trial, trial_cost
        damping *= max(1 / 3, 1 - (2 * gain / expected - 1) ** 3)
        grow = 2.0
        yield Polished(q, cost, step)
        factor = _triangular(*problem.linearised(q)[::-1])


def _triangular(slopes: FloatArray, residuals: FloatArray) -> FloatArray:
    """(m, k + 1), m = k + 1 at most: what has the same normal equations as [slopes, residuals]."""
    return np.asarray(np.linalg.qr(np.column_stack([slopes, residuals]), mode="r"))


def _step(factor: FloatArray, damping: float, bounds: tuple[FloatArray, FloatArray]) -> FloatArray:
    """(k,) least squares of the linearised problem with `damping`, within `bounds`."""
    k = factor.shape[1] - 1
    whole = np.vstack([factor[:, :k], np.sqrt(damping) * np.eye(k)])
    return bounded(whole, np.append(factor[:, k], np.zeros(k)), bounds)


def bounded(
    slopes: FloatArray, residuals: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """(k,) x within `bounds` that makes |residuals + slopes @ x| least; slopes (n, k), n >= k."""
    out, moving = np.zeros(slopes.shape[1]), bounds[1] > bounds[0]
    k = int(moving.sum())
    factor = _triangular(slopes[:, moving], -residuals)
    lower, upper = bounds[0][moving], bounds[1][moving]
    out[moving] = lsq_linear(factor[:k, :k], factor[:k, k], bounds=(lower, upper)).x
    return out
