"""What the tests tell about each parameter: values, standard errors, and what they leave open.

The estimate weighs residuals r by what was expected of them; their true covariance S is estimated
from what is left: per test its mean square, times the number of samples that tell as much as one
(they are correlated where the model errs). With derivatives J and prior precision P, A = J'J + P,
the covariance of the estimate about the truth is A^-1 (J' S J + P) A^-1, in coordinates where the
prior has standard deviation 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.calibrate.objective import Problem
from twin.calibrate.parameters import Parameter, Scale

FloatArray = npt.NDArray[np.float64]

NINETY = 1.6449  # standard deviations of a normal distribution to either side that hold 90 %
LAGS_PER_TIME = 5.0  # sums of autocorrelations stop there: A. Sokal (1997), window of c = 5
MOST_OF_PRIOR, SOME_OF_PRIOR = 0.5, 0.9  # standard error over that of the prior
AT_BOUND = 0.1  # standard errors
SHOWN_LOADINGS = 4


class Verdict(Enum):
    """What the data tell about a parameter."""

    IDENTIFIED = "identified"
    PARTLY = "partly: the prior has a share in it"
    PRIOR = "not identified: as the prior has it"
    AT_BOUND = "at its bound"


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """One parameter.

    Attributes:
        name: as in `parameters.py`, or one of `Problem.derived`.
        unit: of the values.
        value: the estimate.
        std: standard error, in `unit` (where the scale is logarithmic, relative times the value).
        lower: of the 90 % interval,
        upper: and its other end.
        prior: mean of the prior; of what follows from others: at the means of those.
        left_of_prior: standard error over standard deviation of the prior.
        verdict: what the data tell.
    """

    name: str
    unit: str
    value: float
    std: float
    lower: float
    upper: float
    prior: float
    left_of_prior: float
    verdict: Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """A direction in the space of parameters, in standard deviations of their priors.

    Attributes:
        std: what the data alone leave of it, over the prior's.
        loadings: (name, share) of the parameters that matter most in it.
    """

    std: float
    loadings: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answer:
    """What a calibration tells.

    Attributes:
        estimates: of the free parameters, in order.
        derived: what follows from them.
        names: (k,) of the free parameters.
        covariance: (k, k) in standard deviations of the prior.
        stiff: combinations the data determine, the best known first.
        sloppy: those they tell less of than the prior does.
        correlated_samples: test -> samples that tell as much as one.
    """

    estimates: tuple[Estimate, ...]
    derived: tuple[Estimate, ...]
    names: tuple[str, ...]
    covariance: FloatArray
    stiff: tuple[Combination, ...]
    sloppy: tuple[Combination, ...]
    correlated_samples: dict[str, float]

    @property
    def correlations(self) -> FloatArray:
        """(k, k) of the estimates."""
        std = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(std, std))


def answer(problem: Problem, q: FloatArray) -> Answer:
    """At the least squares `q` (k,) of `problem`."""
    residuals, slopes = problem.linearised(q)
    sizes = [t.at.size for t in problem.tests]
    data = sum(sizes)
    prior = slopes[data:].T @ slopes[data:]
    meat, information = prior.copy(), np.zeros_like(prior)
    correlated = {}
    for test, part in zip(problem.tests, _parts(sizes), strict=True):
        own = slopes[part].T @ slopes[part]
        least = float(np.mean((test.noise_V / test.sigma_V) ** 2 / test.count))
        square = max(float(np.mean(residuals[part] ** 2)), least)
        times = correlation_time(residuals[part])
        correlated[test.name] = times
        meat += own * (square * times)
        information += own / (square * times)
    bread = np.linalg.inv(slopes.T @ slopes)
    covariance = bread @ meat @ bread
    stiff, sloppy = combinations(information, [p.name for p in problem.parameters])
    return Answer(
        estimates=estimated(problem.parameters, q, np.sqrt(np.diag(covariance))),
        derived=_derived(problem, q, covariance),
        names=tuple(p.name for p in problem.parameters),
        covariance=covariance,
        stiff=stiff,
        sloppy=sloppy,
        correlated_samples=correlated,
    )


def excess_of(problem: Problem, residuals: FloatArray) -> FloatArray:
    """(tests,) variance of what each test leaves over what was expected, correlation counted."""
    parts = _parts([t.at.size for t in problem.tests])
    return np.array([np.mean(residuals[p] ** 2) * correlation_time(residuals[p]) for p in parts])


def correlation_time(residuals: FloatArray) -> float:
    """How many samples tell as much as one: 1 + 2 sum of autocorrelations, at least 1.

    The mean is not taken out: where the model is off all along, all samples say the same.
    """
    n = residuals.size
    spectrum = np.fft.rfft(residuals, 2 * n)
    covariances = np.fft.irfft(np.abs(spectrum) ** 2)[:n]
    if covariances[0] <= 0:
        return 1.0
    sums = 2 * np.cumsum(covariances / covariances[0]) - 1
    enough = np.arange(n) >= LAGS_PER_TIME * sums
    return float(max(1.0, sums[int(np.argmax(enough)) if enough.any() else -1]))


def _parts(sizes: Sequence[int]) -> list[slice]:
    ends = np.cumsum([0, *sizes]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def estimated(
    parameters: Sequence[Parameter], q: FloatArray, std: FloatArray
) -> tuple[Estimate, ...]:
    """Of (k,) coordinates with their standard errors."""
    out = []
    for k, p in enumerate(parameters):
        value, error, (low, high) = p.value(float(q[k])), float(std[k]), p.bounds
        near = min(q[k] - low, high - q[k]) < AT_BOUND * error
        ends = (max(q[k] - NINETY * error, low), min(q[k] + NINETY * error, high))
        estimate = Estimate(
            name=p.name,
            unit=p.unit,
            value=value,
            std=error * p.std * (value if p.scale is Scale.LOG else 1.0),
            lower=p.value(float(ends[0])),
            upper=p.value(float(ends[1])),
            prior=p.mean,
            left_of_prior=error,
            verdict=_verdict(error, near=bool(near)),
        )
        out.append(estimate)
    return tuple(out)


def _verdict(error: float, *, near: bool) -> Verdict:
    if error > SOME_OF_PRIOR:
        return Verdict.PRIOR
    if near:
        return Verdict.AT_BOUND
    return Verdict.IDENTIFIED if error <= MOST_OF_PRIOR else Verdict.PARTLY


def _derived(problem: Problem, q: FloatArray, covariance: FloatArray) -> tuple[Estimate, ...]:
    mapped = problem.mapped(q, 0)
    by_q = problem.chain(q, mapped.derived_by_values, 0)
    std = np.sqrt(np.einsum("ij,jk,ik->i", by_q, covariance, by_q))
    prior_std = np.linalg.norm(by_q, axis=1)
    priors = problem.mapped(np.zeros_like(q), 0).derived
    return tuple(
        Estimate(
            name=name,
            unit="1/m" if name.endswith("m2_m3") else "",
            value=value,
            std=error,
            lower=value - NINETY * error,
            upper=value + NINETY * error,
            prior=prior,
            left_of_prior=error / before,
            verdict=_verdict(error / before, near=False),
        )
        for name, value, prior, error, before in zip(
            problem.derived,
            mapped.derived.tolist(),
            priors.tolist(),
            std.tolist(),
            prior_std.tolist(),
            strict=True,
        )
    )


def combinations(
    information: FloatArray, names: Sequence[str]
) -> tuple[tuple[Combination, ...], tuple[Combination, ...]]:
    """Stiff and sloppy: eigenvectors of what the data tell, apart at what the prior tells."""
    values, vectors = np.linalg.eigh(information)
    stiff: list[Combination] = []
    sloppy: list[Combination] = []
    for value, vector in zip(values[::-1].tolist(), vectors.T[::-1], strict=True):
        most = np.argsort(-np.abs(vector))[:SHOWN_LOADINGS]
        combination = Combination(
            std=float(max(value, 1e-300) ** -0.5),
            loadings=tuple((names[i], float(vector[i])) for i in most),
        )
        (stiff if value > 1.0 else sloppy).append(combination)
    return tuple(stiff), tuple(sloppy)
