"""How much each test tells about each parameter.

A test's Fisher information is J' J / s: J its derivatives over what is expected of its residuals, s
what they are over that, counting that samples which err alike say the same (`answer.py`). All is in
coordinates where the prior has standard deviation 1, so that numbers of different parameters and
tests compare.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.calibrate.answer import OF_FILLERS, excess_of
from twin.calibrate.objective import Problem

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Information:
    """What t tests tell about k parameters.

    Attributes:
        tests: (t,) names.
        names: (k,) of the free parameters.
        by_test: (t, k, k) Fisher information of each test.
        prior: (k, k) precision of the prior.
        effect_V: (t, k) change of the voltage, root mean square over the compared samples, for one
            standard deviation of the prior.
    """

    tests: tuple[str, ...]
    names: tuple[str, ...]
    by_test: FloatArray
    prior: FloatArray
    effect_V: FloatArray

    @property
    def alone(self) -> FloatArray:
        """(t, k) standard error by one test and the prior, over that of the prior: 1 is nothing."""
        return np.array([_std(own + self.prior) for own in self.by_test]) / _std(self.prior)

    @property
    def together(self) -> FloatArray:
        """(k,) the same by all tests."""
        return _std(self.by_test.sum(axis=0) + self.prior) / _std(self.prior)


def information(problem: Problem, q: FloatArray) -> Information:
    """At the fit `q` (k,) of `problem`."""
    residuals, slopes = problem.linearised(q)
    sizes = [t.at.size for t in problem.tests]
    parts = [slice(a, b) for a, b in pairwise(np.cumsum([0, *sizes]).tolist())]
    noise = [np.mean((t.noise_V / t.sigma_V) ** 2 / t.count) for t in problem.tests]
    excess = np.maximum(excess_of(problem, residuals), noise)  # no fit is better than the noise
    by_volt = [slopes[p] * t.sigma_V[:, None] for p, t in zip(parts, problem.tests, strict=True)]
    prior = slopes[sum(sizes) : sum(sizes) + q.size + OF_FILLERS]
    return Information(
        tests=tuple(t.name for t in problem.tests),
        names=tuple(p.name for p in problem.parameters),
        by_test=np.array([slopes[p].T @ slopes[p] / e for p, e in zip(parts, excess, strict=True)]),
        prior=prior.T @ prior,
        effect_V=np.array([np.sqrt(np.mean(s**2, axis=0)) for s in by_volt]),
    )


def _std(precision: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(precision))))
