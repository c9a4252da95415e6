"""A quick calibration from one flight: what its voltage tells of the pack, and what it does not.

Least squares with priors (`flight_problem.py`). A flight says little and its residuals are
correlated: each sample counts as much as is left over, times the number of samples that tell as
much as one. What is not told stays at its prior. And nothing is fitted on what it is judged by:
each quarter of the flight is predicted by a fit to the others, and a fit that predicts no better
than the pack as it was known is refused.

A good fit is no proof: a wrong scale of the current, a long lead or another chemistry are taken up
by whatever number looks most like them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import numpy.typing as npt

from twin.calibrate.answer import (
    AT_BOUND,
    MOST_OF_PRIOR,
    NINETY,
    Estimate,
    Verdict,
)
from twin.calibrate.flight_problem import FlightProblem, Flown, Known, Quantity, changed, quantities
from twin.calibrate.parameters import Scale
from twin.calibrate.polish import polish
from twin.correlation import correlation_time
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

TOLD = 0.9  # standard error over that of the prior: more, and a flight does not tell it
LEAST_S, LEAST_SAMPLES = 30.0, 30
"""In the air, with voltage: below it a fall by charge and a fall by load look alike."""
FOLDS = 4
FIRST_V, FIRST_SAMPLES = 0.005, 50.0
"""To begin with, a cell is expected to be off by that, and a flight to have so many independent
samples: little, so that the assumptions do not weigh too much before it is known what is left."""
LEAST_V = 0.0005  # a cell: the twin's own error
FIRST_STEPS, MORE_STEPS = 40, 12  # of a coarse fit, and from its answer
NEAR = 1e-7  # damping there: less than what the priors add to the curvature
FINE, COARSE = 600, 200  # samples a flight is averaged to; see `Flown.averaged`
SPREAD = {
    "initial_soc": (-2.0, 0.0, 2.0),
    "capacity_C": (-1.0, 0.0, 1.5),
    "series_resistance_ohm": (0.0, 1.0, 3.0),
}
"""Where a fit may begin, in standard deviations of the prior; the others begin at theirs."""
LEAST_GAIN = 0.95  # of the error on what was held out: less is not worth other numbers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlightFit:
    """A pack fitted to one flight.

    Attributes:
        pack: with what was told; the rest as it was, but that a capacity which nobody knows is that
            of its prior.
        ambient_K: of the air.
        estimates: of all that was free; those with `Verdict.PRIOR` were put back to their prior.
        pulse: voltage lost per ampere in a pulse of the median current, which is told better than
            its parts are.
        held_out_before_V: error of the pack as it was known, RMS in the air.
        held_out_after_V: of predictions of each quarter by a fit to the others.
        independent_samples: how many the flight counts for, the residuals being correlated.
    """

    pack: Pack
    ambient_K: float
    estimates: tuple[Estimate, ...]
    pulse: Estimate
    held_out_before_V: float
    held_out_after_V: float
    independent_samples: float


@dataclass(frozen=True, slots=True)
class NotFitted:
    """Why a flight was not fitted, in a sentence without its full stop."""

    reason: str


@dataclass(frozen=True, slots=True)
class Independent:
    """What is left of a fit counts as much as so many `samples` that are off by `sigma_V`."""

    sigma_V: float
    samples: float

    def each_V(self, samples: int) -> float:
        """Standard deviation of each of so many, for all of them to tell as much."""
        return self.sigma_V * float(np.sqrt(samples / self.samples))


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """Covariance (k, k) of the coordinates, and how many samples the flight counts for."""

    covariance: FloatArray
    samples: float

    @property
    def std(self) -> FloatArray:
        """(k,) of the coordinates."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def fit_flight(pack: Pack, flown: Flown, known: Known) -> FlightFit | NotFitted:
    """What `flown` tells of `pack`, whose numbers are the means of the priors."""
    if reason := _too_little(flown):
        return NotFitted(reason)
    free = quantities(pack, flown, known)
    flown, coarse = flown.averaged(FINE), flown.averaged(COARSE)
    q, independent = _first(pack, coarse, free)
    sigma_V, coarse_V = (independent.each_V(_samples(f)) for f in (flown, coarse))
    problem = FlightProblem(pack, flown, free, sigma_V)
    q = _least(problem, q)
    told = _knowledge(problem, q).std <= TOLD
    if not told.any():
        return NotFitted("its voltage tells nothing that was not known before")
    kept = [f for f, t in zip(free, told, strict=True) if t]
    q[~told] = 0.0
    untold = [f for f, t in zip(free, told, strict=True) if not t]
    guessed = [f for f in untold if f.parameter.name == "capacity_C"]
    stands = changed(pack, guessed, np.zeros(len(guessed)))
    if untold:
        q[told] = _least(FlightProblem(stands, flown, kept, sigma_V), q[told])
    before_V = _before_V(pack, coarse)
    after_V = _held_out_V(FlightProblem(stands, coarse, kept, coarse_V), q[told])
    if after_V > LEAST_GAIN * before_V:
        return NotFitted(
            f"a fit to a part of it predicts the rest no better ({1000 * after_V:.0f} mV) than "
            f"the pack as it was known ({1000 * before_V:.0f} mV)"
        )
    fitted = changed(stands, kept, q[told])
    knowledge = _knowledge(problem, q)
    return FlightFit(
        pack=fitted,
        ambient_K=problem.ambient_K(fitted),
        estimates=_estimates(problem, q, knowledge.std, told),
        pulse=_pulse(problem, q, knowledge.covariance),
        held_out_before_V=before_V,
        held_out_after_V=after_V,
        independent_samples=knowledge.samples,
    )


def _first(pack: Pack, flown: Flown, free: Sequence[Quantity]) -> tuple[FloatArray, "Independent"]:
    """(k,) a point near the least squares, from the best of a few all over the prior.

    Where a simulated pack runs empty long before the real one landed, nothing says by how much.
    """
    expected_V = FIRST_V * pack.series * max(_samples(flown) / FIRST_SAMPLES, 1.0) ** 0.5
    problem = FlightProblem(pack, flown, free, expected_V)
    low, high = problem.bounds
    spread = [SPREAD.get(f.parameter.name, (0.0,)) for f in free]
    points = np.clip(np.array(list(product(*spread))), low, high)
    q = points[int(np.argmin(problem.costs(points)))]
    for polished in polish(problem, q, most_steps=FIRST_STEPS):
        q = polished.q
    return q, _independent(problem, q)


def _independent(problem: FlightProblem, q: FloatArray) -> Independent:
    """What is left at `q`."""
    residuals_V = problem.residuals_V(problem.voltages_V(q[None])[0])[problem.weights > 0]
    left_V = max(_rms(residuals_V), LEAST_V * problem.series)
    return Independent(left_V, residuals_V.size / correlation_time(residuals_V))


def _samples(flown: Flown) -> int:
    """That have a voltage."""
    return int(np.count_nonzero(np.isfinite(flown.voltage_V)))


def _too_little(flown: Flown) -> str:
    """Why there is too little to fit to, or ""."""
    time_s = flown.load.time_s[flown.in_air & np.isfinite(flown.voltage_V)]
    if not time_s.size:
        return "the voltage was not measured"
    length_s = float(time_s[-1] - time_s[0])
    if length_s < LEAST_S or time_s.size < LEAST_SAMPLES:
        return (
            f"{time_s.size} samples of the voltage over {length_s:.0f} s in the air; at least "
            f"{LEAST_SAMPLES} over {LEAST_S:.0f} s tell a fall by charge from one by load"
        )
    median_A = min(flown.median_A, flown.averaged(FINE).median_A)
    if median_A <= 0:
        return f"in the air the median of the current is {median_A:.1f} A, and a fit needs a load"
    return ""


def _least(problem: FlightProblem, near: FloatArray) -> FloatArray:
    """(k,) the least squares, from a point that is near them."""
    q = near
    for polished in polish(problem, near, most_steps=MORE_STEPS, first_damping=NEAR):
        q = polished.q
    return q


def _knowledge(problem: FlightProblem, q: FloatArray) -> Knowledge:
    """At the least squares `q`, by the residuals that are left (as in `answer.py`)."""
    residuals, slopes = problem.linearised(q)
    data = np.flatnonzero(problem.weights)
    times = correlation_time(residuals[data])
    least = float(np.max(problem.weights)) * LEAST_V * problem.series
    square = max(float(np.mean(residuals[data] ** 2)), least**2)
    bread = np.linalg.inv(slopes.T @ slopes)
    told = slopes[data].T @ slopes[data]
    return Knowledge(bread @ (told * square * times + np.eye(q.size)) @ bread, data.size / times)


def _before_V(pack: Pack, flown: Flown) -> float:
    """Error of the pack as it was known, RMS in the air."""
    problem = FlightProblem(pack, flown, (), 1.0)
    simulated_V = problem.voltages_V(np.zeros((1, 0)))[0]
    return _rms(problem.residuals_V(simulated_V)[_judged(flown)])


def _held_out_V(problem: FlightProblem, q: FloatArray) -> float:
    """Of predictions of each quarter of the flight by a fit to the others, RMS in the air."""
    folds = np.array_split(np.flatnonzero(_judged(problem.flown)), FOLDS)
    points = np.array([_least(problem.without(fold), q) for fold in folds])
    missed_V = problem.residuals_V(problem.voltages_V(points))
    return _rms(np.concatenate([r[fold] for r, fold in zip(missed_V, folds, strict=True)]))


def _judged(flown: Flown) -> npt.NDArray[np.bool_]:
    return flown.in_air & np.isfinite(flown.voltage_V)


def _rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _estimates(
    problem: FlightProblem, q: FloatArray, std: FloatArray, told: npt.NDArray[np.bool_]
) -> tuple[Estimate, ...]:
    """Of all that is free, `told` (k,) or not; the latter widens what hangs together with it."""
    low, high = problem.bounds
    each = zip(problem.quantities, q, std, low, high, strict=True)
    found = (_estimate(quantity, c, error, (a, b)) for quantity, c, error, a, b in each)
    return tuple(
        e if is_told else replace(e, verdict=Verdict.PRIOR)
        for e, is_told in zip(found, told.tolist(), strict=True)
    )


def _pulse(problem: FlightProblem, q: FloatArray, covariance: FloatArray) -> Estimate:
    """What a pulse loses per ampere."""
    points, steps = problem.around(q)
    ohm, *others = problem.pulses_ohm(points).tolist()
    by_q = (np.array(others) - ohm) / steps
    (prior_ohm,) = problem.pulses_ohm(np.zeros((1, q.size)))
    error = float(np.sqrt(by_q @ covariance @ by_q))
    left = error / float(np.linalg.norm(by_q))
    return Estimate(
        name="pulse_ohm", unit="Ohm", value=ohm, std=error, lower=ohm - NINETY * error,
        upper=ohm + NINETY * error, prior=float(prior_ohm), left_of_prior=left,
        verdict=_verdict(left),
    )  # fmt: skip


def _estimate(quantity: Quantity, q: float, error: float, bounds: tuple[float, float]) -> Estimate:
    p = quantity.parameter
    value = p.value(q)
    verdict = _verdict(min(error, TOLD))  # it was fitted
    if min(q - bounds[0], bounds[1] - q) < AT_BOUND * error:
        verdict = Verdict.AT_BOUND
    return Estimate(
        name=p.name,
        unit=p.unit,
        value=value,
        std=error * p.std * (value if p.scale is Scale.LOG else 1.0),
        lower=p.value(max(q - NINETY * error, bounds[0])),
        upper=p.value(min(q + NINETY * error, bounds[1])),
        prior=p.mean,
        left_of_prior=error,
        verdict=verdict,
    )


def _verdict(left_of_prior: float) -> Verdict:
    if left_of_prior > TOLD:
        return Verdict.PRIOR
    return Verdict.IDENTIFIED if left_of_prior <= MOST_OF_PRIOR else Verdict.PARTLY
