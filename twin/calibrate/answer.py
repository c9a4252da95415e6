"""What the tests tell about each parameter: values, standard errors, and what they leave open.

The estimate weighs residuals r by what was expected of them; their true covariance S is estimated
from what is left: per test its mean square, times the number of samples that tell as much as one
(they are correlated where the model errs). With derivatives J and prior precision P (that of the
fillers in it), A = J'J + P, the covariance of the estimate about the truth is
A^-1 (J' S J + P) A^-1, in coordinates where a parameter's own prior has standard deviation 1.

What these tests hardly tell (`not_identified`) is held at its prior. Its interval is the prior's,
and that it may be wrong is part of the errors of the others: consider covariance analysis, B. D.
Tapley, B. E. Schutz, G. H. Born, Statistical Orbit Determination (Elsevier, 2004), chapter 6.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.calibrate.objective import Problem
from twin.calibrate.parameters import Parameter, Scale
from twin.correlation import correlation_time

FloatArray = npt.NDArray[np.float64]

OF_FILLERS = 2  # rows of the prior beside those of the parameters
NINETY = 1.6449  # standard deviations of a normal distribution to either side that hold 90 %
MOST_OF_PRIOR, SOME_OF_PRIOR = 0.5, 0.98
"""Standard error over that of the prior. What is told a little is not held at its prior: what it
could have taken up would go into numbers that are told well (at 0.9 a measured pouch's 1C discharge
started at 1 % more charge than it did)."""
UNMOVED = 0.2
"""Of the prior's deviation: by what data move a number that leave 0.98 of it, usually."""
AT_BOUND = 0.1  # standard errors
SHOWN_LOADINGS = 4


class Verdict(Enum):
    """What the data tell about a parameter."""

    IDENTIFIED = "identified"
    PARTLY = "partly: the prior has a share in it"
    PRIOR = "not identified by these tests: its prior"
    UNTOLD = "not identified by these tests, though the fit moved it"
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
        left_of_prior: standard error over standard deviation of the prior, all of it (that of the
            fillers bears on what they follow from).
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
        covariance: (k, k) in coordinates.
        stiff: combinations the data determine, the best known first.
        sloppy: those they tell less of than the prior does.
        correlated_samples: test -> samples that tell as much as one.
        held: names of those that were held at their prior.
    """

    estimates: tuple[Estimate, ...]
    derived: tuple[Estimate, ...]
    names: tuple[str, ...]
    covariance: FloatArray
    stiff: tuple[Combination, ...]
    sloppy: tuple[Combination, ...]
    correlated_samples: dict[str, float]
    held: tuple[str, ...]

    @property
    def correlations(self) -> FloatArray:
        """(k, k) of the estimates."""
        std = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(std, std))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Curvature:
    """Of the sum of squares at an estimate; (k, k) each, in coordinates.

    Attributes:
        weighed: J'J of the data, as they are weighed.
        meat: J'SJ, the covariance of their pull.
        data: J'S^-1 J, the most they tell.
        prior: P.
        correlated: test -> samples that tell as much as one.
    """

    weighed: FloatArray
    meat: FloatArray
    data: FloatArray
    prior: FloatArray
    correlated: dict[str, float]


def answer(problem: Problem, q: FloatArray) -> Answer:
    """At the least squares `q` (k,) of `problem`."""
    told = _curvature(problem, q)
    names = tuple(p.name for p in problem.parameters)
    covariance = _covariance(told, problem.held)
    prior = np.asarray(np.linalg.inv(told.prior))
    stiff, sloppy = combinations(told.data, names)
    return Answer(
        estimates=estimated(
            problem.parameters,
            q,
            np.sqrt(np.diag(covariance)),
            np.sqrt(np.diag(prior)),
            problem.held,
        ),
        derived=_derived(problem, q, covariance, prior),
        names=names,
        covariance=covariance,
        stiff=stiff,
        sloppy=sloppy,
        correlated_samples=told.correlated,
        held=tuple(n for n, held in zip(names, problem.held, strict=True) if held),
    )


def not_identified(problem: Problem, q: FloatArray) -> tuple[str, ...]:
    """Names of what the tests hardly tell, at the least squares `q` (k,) of `problem`.

    Those whose prior the data narrow by less than 2 %, one after the other, the least told
    first: of parameters that only a combination is told of, one at least stays free.
    """
    told = _curvature(problem, q)
    free = np.arange(q.size)
    while free.size:
        own = np.ix_(free, free)
        after, before = (np.linalg.inv(m[own]) for m in (told.data + told.prior, told.prior))
        left = np.sqrt(np.diag(after) / np.diag(before))
        if left.max() <= SOME_OF_PRIOR:
            break
        free = np.delete(free, int(np.argmax(left)))
    return tuple(p.name for k, p in enumerate(problem.parameters) if k not in free)


def _curvature(problem: Problem, q: FloatArray) -> _Curvature:
    residuals, slopes = problem.linearised(q)
    sizes = [t.at.size for t in problem.tests]
    behind = slopes[sum(sizes) :]
    prior, warming = behind[: q.size + OF_FILLERS], behind[q.size + OF_FILLERS :]
    weighed, meat, data = (np.zeros((q.size, q.size)) for _ in range(3))
    correlated = {}
    for test, part in zip(problem.tests, _parts(sizes), strict=True):
        own = slopes[part].T @ slopes[part]
        least = float(np.mean((test.noise_V / test.sigma_V) ** 2 / test.count))
        square = max(float(np.mean(residuals[part] ** 2)), least)
        times = correlation_time(residuals[part])
        correlated[test.name] = times
        weighed += own
        meat += own * (square * times)
        data += own / (square * times)
    if warming.size:  # temperatures err alike all along: together they tell what one test does
        left = residuals[-len(warming) :]
        own = warming.T @ warming
        excess = max(float(np.mean(left**2)) * correlation_time(left), 1.0)
        weighed, meat, data = weighed + own, meat + own * excess, data + own / excess
    return _Curvature(
        weighed=weighed, meat=meat, data=data, prior=prior.T @ prior, correlated=correlated
    )


def _covariance(told: _Curvature, held: npt.NDArray[np.bool_]) -> FloatArray:
    """(k, k) of the estimate about the truth, `held` (k,) at the mean of its prior.

    With d = prior mean - truth, noise n, o what is free and h what is held, the estimate errs by
    e_h = d_h and, where the sum of squares is least, A_oo e_o = P_oo d_o - (J'J)_oh d_h - J_o' n.
    """
    free = ~held
    oo, oh = np.ix_(free, free), np.ix_(free, held)
    by_noise, by_prior = np.zeros_like(told.prior), np.diag(held.astype(float))
    by_noise[oo] = np.linalg.inv((told.weighed + told.prior)[oo])
    by_prior[oo] = by_noise[oo] @ told.prior[oo]
    by_prior[oh] = -by_noise[oo] @ told.weighed[oh]
    prior = np.linalg.inv(told.prior)
    return np.asarray(by_noise @ told.meat @ by_noise.T + by_prior @ prior @ by_prior.T)


def excess_of(problem: Problem, residuals: FloatArray) -> FloatArray:
    """(tests,) variance of what each test leaves over what was expected, correlation counted."""
    parts = _parts([t.at.size for t in problem.tests])
    return np.array([np.mean(residuals[p] ** 2) * correlation_time(residuals[p]) for p in parts])


def _parts(sizes: Sequence[int]) -> list[slice]:
    ends = np.cumsum([0, *sizes]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def estimated(
    parameters: Sequence[Parameter],
    q: FloatArray,
    std: FloatArray,
    prior_std: FloatArray,
    held: npt.NDArray[np.bool_],
) -> tuple[Estimate, ...]:
    """Of (k,) coordinates with their standard errors, and those of the prior.

    What is `held` (k,) is its prior, and so is what was fitted, is not told, and stands there. What
    was moved is not, however little is told of it.
    """
    out = []
    for k, p in enumerate(parameters):
        value, error = p.value(float(q[k])), float(std[k])
        (low, high), left = p.bounds, error / float(prior_std[k])
        unmoved = bool(held[k] or abs(q[k]) < UNMOVED * prior_std[k])
        near = bool(min(q[k] - low, high - q[k]) < AT_BOUND * error)
        ends = (max(q[k] - NINETY * error, low), min(q[k] + NINETY * error, high))
        estimate = Estimate(
            name=p.name,
            unit=p.unit,
            value=value,
            std=error * p.std * (value if p.scale is Scale.LOG else 1.0),
            lower=p.value(float(ends[0])),
            upper=p.value(float(ends[1])),
            prior=p.mean,
            left_of_prior=left,
            verdict=_verdict(left, near=near, moved=not unmoved),
        )
        out.append(estimate)
    return tuple(out)


def _verdict(left: float, *, near: bool, moved: bool = False) -> Verdict:
    if left > SOME_OF_PRIOR and not moved:
        return Verdict.PRIOR
    if near:
        return Verdict.AT_BOUND
    if left > SOME_OF_PRIOR:
        return Verdict.UNTOLD
    return Verdict.IDENTIFIED if left <= MOST_OF_PRIOR else Verdict.PARTLY


def _derived(
    problem: Problem, q: FloatArray, covariance: FloatArray, prior: FloatArray
) -> tuple[Estimate, ...]:
    mapped = problem.mapped(q, 0)
    by_q = problem.chain(q, mapped.derived_by_values, 0)
    std, prior_std = (np.sqrt(np.einsum("ij,jk,ik->i", by_q, m, by_q)) for m in (covariance, prior))
    left = np.divide(std, prior_std, out=np.ones_like(std), where=prior_std > 0)  # 1: all is fixed
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
            left_of_prior=share,
            verdict=_verdict(share, near=False),
        )
        for name, value, prior, error, share in zip(
            problem.derived,
            mapped.derived.tolist(),
            priors.tolist(),
            std.tolist(),
            left.tolist(),
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
