"""Where least squares begin: windows by the slowest test, then points that lead to other valleys.

Where the twin is not quite the cell, what they end in depends on it: a drive cycle of a Panasonic
NCR18650PF, predicted by a fit to its other tests, was missed by 37.8 mV from the windows alone, by
34.9 from points of the prior too.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy.stats.qmc import MultivariateNormalQMC

from twin.calibrate.cell_map import Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.parameters import EMPTY_ENDS, of_tests
from twin.calibrate.polish import Polished, polish

FloatArray = npt.NDArray[np.float64]

WINDOWS = ("negative.stoichiometry_max", *EMPTY_ENDS, "capacity_C", "series_resistance_ohm")
FULL = (0.0, -1.5, 1.5)  # standard deviations of the first of WINDOWS, where its fit starts
SALT, MORE_SALT = "electrolyte.diffusivity_factor", 1.5  # standard deviations
DRAWN, TRIED = 64, 4  # points of the prior, and how many of them are started from
WHOLE_TEST = 0.5  # of the capacity: a test that draws less shows no window


def of_windows(problem: Problem) -> FloatArray:
    """(k,) windows and capacity by the slowest whole test, all else at its prior."""
    slow = _slowest(problem)
    names = [p.name for p in problem.parameters]
    own = problem.with_only([name for name in names if name in WINDOWS], [slow])
    drawn_C = float(np.ptp(problem.tests[slow].drawn_C))
    results = [r for full in FULL for r in _last(own, _window_start(own, full, drawn_C))]
    q = np.zeros(len(names))
    if results:
        best = min(results, key=lambda r: r.cost)
        for p, value in zip(own.parameters, best.q.tolist(), strict=True):
            q[names.index(p.name)] = value
    return np.asarray(np.clip(q, *problem.bounds))


def plentiful(problem: Problem, q: FloatArray) -> FloatArray:
    """`q` with salt that lasts: where it runs out lies another valley."""
    out = q.copy()
    for k, p in enumerate(problem.parameters):
        if p.name == SALT:
            out[k] += MORE_SALT
    return np.asarray(np.clip(out, *problem.bounds))


def drawn(problem: Problem, q: FloatArray) -> Iterator[FloatArray]:
    """The best TRIED of some points of the prior, the best first; windows and starts are q's."""
    low, high = problem.bounds
    names = [p.name for p in problem.parameters]
    kept = [name in WINDOWS or of_tests(name) for name in names]
    points = MultivariateNormalQMC(np.zeros(q.size), seed=0).random(DRAWN)
    points = np.clip(np.where(kept, q, points), low, high)
    costs = problem.costs((points - low) / (high - low))
    yield from (points[k] for k in np.argsort(costs)[:TRIED] if np.isfinite(costs[k]))


def _window_start(own: Problem, full: float, drawn_C: float) -> FloatArray:
    """Where the fit of the windows starts: the capacity is what a whole test has drawn."""
    q = np.array([full if p.name == WINDOWS[0] else 0.0 for p in own.parameters])
    for k, p in enumerate(own.parameters):
        if p.name == "capacity_C" and drawn_C > WHOLE_TEST * own.nominal_C:
            q[k] = p.coordinate(drawn_C)
    return q


def _last(problem: Problem, start: FloatArray) -> list[Polished]:
    """Where least squares lead; empty if no cell has the values of `start`."""
    try:
        return list(polish(problem, start))[-1:]
    except Infeasible:
        return []


def _slowest(problem: Problem) -> int:
    """Position of the test with the least current of those that draw most of the charge."""
    spans = np.array([np.ptp(t.drawn_C) for t in problem.tests])
    mean_A = [spans[k] / t.load.time_s[-1] for k, t in enumerate(problem.tests)]
    whole = spans > WHOLE_TEST * problem.nominal_C
    return int(np.argmin(np.where(whole, mean_A, np.inf))) if whole.any() else int(spans.argmax())
