"""From check-ups to a pack that ages so: `fit_life`, `told_of_life`."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import numpy.typing as npt

from twin.ageing import Regime, age
from twin.calibrate.answer import MOST_OF_PRIOR, NINETY, Answer, Estimate, Verdict
from twin.calibrate.check_ups import CheckUps
from twin.calibrate.degradation import Course, LifeProblem
from twin.calibrate.known import known
from twin.calibrate.polish import polish
from twin.calibrate.table import CalibrationError
from twin.pack import Pack
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

STARTS = (0.0, -1.0, -2.0, -3.0)
"""Of the moduli: under a stress that is too high a life ends before it tells anything."""
LEAST_ERROR, MOST_ERROR = 0.01, 30.0  # of check-ups, over what was expected
ENOUGH = 0.02  # of the cost, half a chi square: a better fit says nothing that is worth a life
SPARE = 2.0  # residuals more than parameters: fewer do not tell by how much check-ups err


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LifeProgress:
    """The best so far.

    Attributes:
        problem: whose coordinates they are.
        q: (k,) coordinates.
        cost: half the sum of squares.
        error: rms of measured over simulated capacity less 1.
    """

    problem: LifeProblem
    q: FloatArray
    cost: float
    error: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AgedFit:
    """A pack whose ageing was fitted.

    Attributes:
        pack: that ages so.
        ups: what was measured.
        answer: parameters with their errors.
        measured_capacity: over that in equilibrium.
        course: at the check-ups, as the pack ages now,
        before: and as it was said to age.
        error: rms of measured over simulated capacity less 1.
    """

    pack: Pack
    ups: CheckUps
    answer: Answer
    measured_capacity: float
    course: Course
    before: Course
    error: float


def fit_life(pack: Pack, regime: Regime, ups: CheckUps) -> Iterator[LifeProgress]:
    """Ever better fits; stop iterating whenever it is good enough.

    By how much check-ups err is taken from what a first fit leaves.
    """
    problem = LifeProblem(pack, regime, ups)
    starts = [_start(problem, level) for level in STARTS]
    first = next((q for q in starts if problem.course(q).capacity_C.all()), None)
    if first is None:
        raise CalibrationError(_too_short(problem, starts[-1]))
    best = None
    for best in _polished(problem, first):
        yield best
    assert best is not None
    error = _error(problem, best.q)
    if error is not None:
        yield from _polished(problem.of_other_shares(error), best.q)


def told_of_life(best: LifeProgress) -> AgedFit:
    """What the fit tells."""
    problem, q = best.problem, best.q
    told = known(problem, q, problem.parameters, problem.parts, least=1.0)
    return AgedFit(
        pack=problem.pack_at(q),
        ups=problem.ups,
        answer=replace(told, derived=_stresses(problem, q, told)),
        measured_capacity=problem.values(q)["measured_capacity"],
        course=problem.course(q),
        before=problem.course(np.zeros(q.size)),
        error=best.error,
    )


def _start(problem: LifeProblem, level: float) -> FloatArray:
    moduli = [p.name.endswith("modulus_Pa") for p in problem.parameters]
    return np.where(moduli, level, 0.0)


def _too_short(problem: LifeProblem, q: FloatArray) -> str:
    for aged in islice(age(problem.pack_at(q), problem.regime), 1 + int(problem.ups.cycle[-1])):
        if aged.cycle.status is not Status.DONE:
            break
    ends = f"ends in cycle {aged.cycle.number}, in the {aged.cycle.stopped_in}"
    if aged.cycle.status is Status.DONE:  # cycle by cycle
        ends = "cannot be foreseen over many cycles at once"
    least = problem.values(q)
    return (
        f"the simulated life {ends}: "
        f"{aged.cycle.status.value}; also with moduli as small as {_moduli(least)}. "
        "Check the load, its sign and the charge; calibrate the cell of the pack first"
    )


def _moduli(values: Mapping[str, float]) -> str:
    found = [f"{v:.2g} Pa" for name, v in values.items() if name.endswith("modulus_Pa")]
    return " and ".join(found) or "they are"


def _polished(problem: LifeProblem, start: FloatArray) -> Iterator[LifeProgress]:
    before = np.inf
    for p in polish(problem, start):
        simulated_C = problem.values(p.q)["measured_capacity"] * problem.course(p.q).capacity_C
        off = simulated_C / problem.ups.capacity_C - 1
        yield LifeProgress(
            problem=problem, q=p.q, cost=p.cost, error=float(np.sqrt(np.mean(off**2)))
        )
        if before - p.cost < ENOUGH:
            return
        before = p.cost


def _error(problem: LifeProblem, q: FloatArray) -> float | None:
    """Of check-ups over what was expected; None where there are too few to tell."""
    residuals, slopes = problem.linearised(q)
    data = sum(problem.parts.values())
    bread = np.linalg.inv(slopes.T @ slopes)
    used = float(np.trace(bread @ (slopes[:data].T @ slopes[:data])))
    if data - used < SPARE:
        return None
    square = float(residuals[:data] @ residuals[:data]) / (data - used)
    return float(np.clip(np.sqrt(square), LEAST_ERROR, MOST_ERROR))


def _stresses(problem: LifeProblem, q: FloatArray, told: Answer) -> tuple[Estimate, ...]:
    """E Omega / (1 - nu) of each electrode that is strained: three times stress per lithium."""
    names, values, out = list(told.names), problem.values(q), []
    slopes = np.array([p.slope(float(c)) for p, c in zip(problem.parameters, q, strict=True)])
    for side in ("negative", "positive"):
        parts = [f"mechanics.{side}_{n}" for n in ("modulus_Pa", "poisson",
                                                   "partial_volume_m3_mol")]  # fmt: skip
        if not set(parts) <= set(names):
            continue
        modulus, poisson, volume = (values[n] for n in parts)
        by_q = np.zeros(q.size)
        for name, relative in zip(parts, (1 / modulus, 1 / (1 - poisson), 1 / volume), strict=True):
            k = names.index(name)
            by_q[k] = relative * slopes[k]
        error, before = float(np.sqrt(by_q @ told.covariance @ by_q)), float(np.linalg.norm(by_q))
        value = modulus * volume / (1 - poisson)
        identified = error <= MOST_OF_PRIOR * before
        out.append(Estimate(
            name=f"{side}.stress_per_lithium", unit="Pa m3/mol", value=value, std=error * value,
            lower=value * np.exp(-NINETY * error), upper=value * np.exp(NINETY * error),
            prior=float("nan"), left_of_prior=error / before,
            verdict=Verdict.IDENTIFIED if identified else Verdict.PARTLY,
        ))  # fmt: skip
    return tuple(out)
