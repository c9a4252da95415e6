"""A smooth correction of the open-circuit curve: bumps, fitted with all else.

At rest a cell shows the difference of its potentials alone, so one of them is enough: bumps
evenly over the window of the positive electrode (`twin/bumps.py`), their heights parameters
with a prior about 0. They are kept where the evidence for them is very strong: Savage and Dickey's
ratio of the densities at heights of 0, before and after the tests (J. M. Dickey, Ann. Math. Stat.
42, 204 (1971)), with the covariance of `answer.py`, in which correlated residuals count less.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.bumps import Bumped, evenly
from twin.calibrate.answer import Answer
from twin.calibrate.objective import Problem
from twin.calibrate.parameters import BUMP_V

FloatArray = npt.NDArray[np.float64]

BUMPS = 12
STRONG = 10.0  # gain from which the evidence counts as very strong (Kass and Raftery, 1995)
LEAST_V = 2e-3  # rms that it explains: drift of a sensor over hours looks like a smaller one
PARTS, MOST_PARTS = 10, 5  # of the capacity, and in how many of them the curve has to show
SLOW_PER_H = 0.25  # of the capacity: a larger current does not tell a potential from losses
SHOWN = 101  # states of charge


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """Of the positive electrode's open-circuit potential, and the evidence for it.

    Attributes:
        potential: with bumps, from full to empty.
        heights_V: (k,) of the bumps.
        stds_V: (k,) their standard errors.
        test: name of the test that tells the curve best.
        rms_V: what a fit without the correction leaves of it, less where it dives,
        corrected_rms_V: and what is left with it.
        gain: twice the logarithm of the odds for it.
    """

    potential: Bumped
    heights_V: tuple[float, ...]
    stds_V: tuple[float, ...]
    test: str
    rms_V: float
    corrected_rms_V: float
    gain: float

    def at_V(self, y: FloatArray) -> FloatArray:
        """(m,) at stoichiometries (m,)."""
        off = (y[:, None] - np.array(self.potential.centres)) / self.potential.width
        return np.asarray(np.exp(-(off**2)) @ np.array(self.heights_V))

    def along(self) -> tuple[FloatArray, FloatArray]:
        """(m,) state of charge from full to empty, and what is added there [V]."""
        full, *_, empty = self.potential.centres
        return np.linspace(1.0, 0.0, SHOWN), self.at_V(np.linspace(full, empty, SHOWN))

    @property
    def demanded(self) -> bool:
        """The evidence is very strong, and the test that tells the curve best is of it."""
        explained_V2 = self.rms_V**2 - self.corrected_rms_V**2
        return self.gain >= STRONG and explained_V2 >= LEAST_V**2

    def __str__(self) -> str:
        soc, added_V = self.along()
        low, high = int(added_V.argmin()), int(added_V.argmax())
        return (
            f"{self.test}: the open-circuit curve of the cell is corrected, from "
            f"{1e3 * added_V[low]:+.1f} mV at {100 * soc[low]:.0f} % charge to "
            f"{1e3 * added_V[high]:+.1f} mV at {100 * soc[high]:.0f} %; of this test "
            f"{1e3 * self.corrected_rms_V:.1f} mV rms are left, {1e3 * self.rms_V:.1f} without it"
        )


def slow_test(problem: Problem) -> int | None:
    """Position of the test that tells the open-circuit curve best; None if none does.

    At rest or slow it must show most parts of it; that with the least largest current is best.
    """
    least_A = SLOW_PER_H * problem.nominal_C / 3600
    most_A = {}
    for k, t in enumerate(problem.tests):
        current_A = np.abs(t.load.current_A[t.at])
        parts = np.floor(PARTS * t.drawn_C[current_A < least_A] / problem.nominal_C)
        if np.unique(parts).size >= MOST_PARTS:
            most_A[k] = float(current_A.max())
    return min(most_A, key=lambda k: most_A[k], default=None)


def with_bumps(problem: Problem, q: FloatArray) -> Problem | None:
    """The same before any fit, with bumps over the window of the fit `q` (k,), their heights free.

    None if no test tells the open-circuit curve, or there are bumps already.
    """
    slow = slow_test(problem)
    if slow is None or problem.unbumped:
        return None
    numbers = problem.mapped(q, slow).numbers
    full, empty = (numbers[f"positive.stoichiometry_{end}"] for end in ("min", "max"))
    potential = evenly(problem.pack.cell.positive.ocp_V, full, empty, BUMPS)
    unbumped = problem.tests[slow].name, problem.even_rms_V(q, slow)
    left = [t.as_expected() for t in problem.tests]
    problem = problem.of_other_tests(left).holding(())
    return problem.bumped(potential, unbumped=unbumped)


def correction_of(problem: Problem, q: FloatArray, told: Answer) -> Correction | None:
    """Of the fit `q` (k,) with its `told`; None if its potential has no bumps."""
    potential, unbumped = problem.pack.cell.positive.ocp_V, problem.unbumped
    if not isinstance(potential, Bumped) or unbumped is None:
        return None
    test, rms_V = unbumped
    names = potential.names("positive")
    places = [told.names.index(name) for name in names]
    heights, covariance = q[places], told.covariance[np.ix_(places, places)]
    gain = heights @ np.linalg.solve(covariance, heights) + np.linalg.slogdet(covariance)[1]
    place = [t.name for t in problem.tests].index(test)
    return Correction(
        potential=potential,
        heights_V=tuple((BUMP_V * heights).tolist()),
        stds_V=tuple((BUMP_V * np.sqrt(np.diag(covariance))).tolist()),
        test=test,
        rms_V=rms_V,
        corrected_rms_V=problem.even_rms_V(q, place),
        gain=float(gain),
    )
