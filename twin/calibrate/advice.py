"""Which further test would tell most: expected information of a few candidates.

A candidate is simulated with the calibrated cell, its sensitivities are taken, and what it would
add to the information at hand is counted, the open-circuit voltage at its start being free as well.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.calibrate.answer import Answer
from twin.calibrate.cell_map import Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.parameters import of_tests
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import sampled
from twin.calibrate.settle import STRETCHES, taken_V

FloatArray = npt.NDArray[np.float64]

Stage = tuple[float, float, float]
"""C-rate (discharge positive), duration [s], period of the samples [s]."""

SHOWN = 3  # parameters that a candidate helps most
HELPED = 0.9  # standard error after over before: more is no help
START_AT_EMPTY = 0.05  # state of charge
BEYOND_UPPER_V = 5e-3  # at rest when full


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A test one could make; it starts at rest at state of charge `soc`."""

    name: str
    soc: float
    stages: tuple[Stage, ...]


def _pulses(rate: float) -> tuple[Stage, ...]:
    return (
        (0.0, 30.0, 1.0), (rate, 10.0, 0.1), (0.0, 60.0, 0.5), (-rate, 10.0, 0.1),
        (0.0, 120.0, 1.0),
    )  # fmt: skip


CANDIDATES = (
    Candidate(name="0.1C discharge", soc=1.0, stages=((0.0, 60.0, 10.0), (0.1, 32400.0, 10.0))),
    Candidate(
        name="0.1C charge",
        soc=START_AT_EMPTY,
        stages=((0.0, 60.0, 10.0), (-0.1, 30600.0, 10.0)),
    ),
    Candidate(
        name="1C discharge and rest",
        soc=1.0,
        stages=((0.0, 60.0, 10.0), (1.0, 3000.0, 1.0), (0.0, 3600.0, 10.0)),
    ),
    Candidate(
        name="2C discharge and rest",
        soc=1.0,
        stages=((0.0, 60.0, 10.0), (2.0, 1440.0, 1.0), (0.0, 3600.0, 10.0)),
    ),
    Candidate(name="2C pulses at 80 %", soc=0.8, stages=_pulses(2.0)),
    Candidate(name="2C pulses at 50 %", soc=0.5, stages=_pulses(2.0)),
    Candidate(name="2C pulses at 20 %", soc=0.2, stages=_pulses(2.0)),
    Candidate(name="5C pulses at 50 %", soc=0.5, stages=_pulses(5.0)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Advice:
    """What a further test would bring.

    Attributes:
        name: of the candidate.
        gain: information it adds: half the logarithm of how much smaller the volume of the
            confidence region becomes [nats].
        helps: (parameter, standard error after over before) it helps most.
    """

    name: str
    gain: float
    helps: tuple[tuple[str, float], ...]


def advise(problem: Problem, q: FloatArray, found: Answer) -> tuple[Advice, ...]:
    """The CANDIDATES that this cell completes, the most informative first."""
    noise_V = float(np.median([t.noise_V for t in problem.tests]))
    missed_V = float(np.median(taken_V(problem)))
    cell = [k for k, name in enumerate(found.names) if not of_tests(name)]
    before = found.covariance[np.ix_(cell, cell)]
    out = []
    for candidate in CANDIDATES:
        information = _information(problem, q[cell], candidate, noise_V, missed_V)
        if information is None:
            continue
        after = np.linalg.inv(np.linalg.inv(before) + information)
        ratio = np.sqrt(np.diag(after) / np.diag(before))
        gain = 0.5 * float(np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])
        best = [i for i in np.argsort(ratio)[:SHOWN].tolist() if ratio[i] < HELPED]
        helps = tuple((found.names[cell[i]], float(ratio[i])) for i in best)
        out.append(Advice(name=candidate.name, gain=gain, helps=helps))
    return tuple(sorted(out, key=lambda a: -a.gain))


def _information(
    problem: Problem, q: FloatArray, candidate: Candidate, noise_V: float, missed_V: float
) -> FloatArray | None:
    """(k, k) about the cell's parameters; None where the cell does not complete the test.

    By noise and by what the twin misses of the tests there are: so it will of this one.
    """
    test = _reference(problem, candidate)
    try:
        start_V = problem.rest_V(q, candidate.soc)
        voltage_V = problem.replayed(q, test, start_V)
        if not np.isfinite(voltage_V).all() or not _within(problem, voltage_V):
            return None
        few = sampled(replace(test, voltage_V=voltage_V), problem.nominal_C)
        few = replace(few, noise_V=noise_V).of_a_model(missed_V, STRETCHES)
        whole = problem.of_other_tests((few,))
        _, slopes = whole.linearised(np.append(q, 0.0))
    except Infeasible:
        return None
    data = slopes[: few.at.size]
    joint = data.T @ data
    start = joint[-1, -1] + 1.0  # of its prior
    return np.asarray(joint[:-1, :-1] - np.outer(joint[:-1, -1], joint[-1, :-1]) / start)


def _within(problem: Problem, voltage_V: FloatArray) -> bool:
    cell = problem.pack.cell
    low, high = cell.lower_cut_off_V, cell.upper_cut_off_V + BEYOND_UPPER_V
    return bool(voltage_V.min() >= low and voltage_V.max() <= high)


def _reference(problem: Problem, candidate: Candidate) -> ReferenceTest:
    """The candidate as it would be measured, its voltage not known yet."""
    times, currents, start_s = [], [], 0.0
    for rate, duration_s, period_s in candidate.stages:
        count = round(duration_s / period_s)
        times.append(start_s + period_s * np.arange(count))
        currents.append(np.full(count, rate * problem.nominal_C / 3600))
        start_s += duration_s
    time_s = np.append(np.concatenate(times), start_s)
    current_A = np.append(np.concatenate(currents), currents[-1][-1])
    voltage_V = np.zeros(time_s.size)
    return ReferenceTest(
        name=candidate.name, time_s=time_s, current_A=current_A, voltage_V=voltage_V
    )
