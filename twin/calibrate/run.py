"""From tests to a calibrated cell: `fit` step by step, `conclude` at the end.

First the stoichiometry windows and the capacity from the slowest test, which shows little else;
then all parameters by least squares from there and from a second point, as if the twin missed each
test by some millivolts; where it misses one by far more, from points of the prior (`starts.py`).
Where it misses less, as if it were the cell. Where it is not, a search of the whole box, and least
squares from what it found. Then, where the tests demand it, a correction of the open-circuit curve.
Last `settle.py`: how much the tests weigh, and what they do not tell.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from twin.calibrate import starts
from twin.calibrate.advice import Advice, advise
from twin.calibrate.answer import Answer, answer
from twin.calibrate.cell_map import Infeasible
from twin.calibrate.checks import Fitted, fitted, predicted
from twin.calibrate.information import Information, information
from twin.calibrate.objective import Problem
from twin.calibrate.ocp_correction import Correction, correction_of, with_bumps
from twin.calibrate.polish import SMALL_GAIN
from twin.calibrate.reference import ReferenceTest, left_unknown
from twin.calibrate.remarks import of_starts, of_weights
from twin.calibrate.resample import sampled
from twin.calibrate.settle import (
    MISSED_V,
    Settled,
    least_squares,
    of_a_model,
    settled,
    weighed_and_held,
)
from twin.calibrate.single_cell import check_effects, labelled_C
from twin.calibrate.table import CalibrationError
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

LEAST_SQUARES, SEARCH = "least squares", "search"
CORRECTION = "open-circuit curve"
ADVICE = "further tests worth making"
FAR = 3.0  # times what a twin may miss of a test: that may be the wrong valley
SIGHTED = 3e-4
"""Of the cost, that a step has to gain from a start that may lead elsewhere: which valley is the
deepest shows long before its floor. By a Panasonic's tests least squares end in two valleys, from
four points at costs of 2151 to 2154, from two at 2279."""
EXPLAINED = 1.3  # mean square of the residuals over what was expected: nothing to search for


class Found(Protocol):
    """What a search yields."""

    @property
    def point(self) -> FloatArray:
        """(k,) of the unit cube."""
        ...

    @property
    def cost(self) -> float:
        """There."""
        ...

    @property
    def evaluations(self) -> int:
        """So far."""
        ...

    @property
    def algorithm(self) -> str:
        """At work."""
        ...


class Search(Protocol):
    """A minimiser on the unit cube."""

    def __call__(
        self, evaluate: Callable[[FloatArray], FloatArray], dimension: int, *, seed: int,
        evaluations: int, start: FloatArray,
    ) -> Iterator[Found]:  # fmt: skip
        """Ever better points; the first comes from `start` (k,)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Progress:
    """The best so far.

    Attributes:
        stage: what is being done, in a word or two.
        problem: whose coordinates they are; its tests weigh less where the twin is not the cell,
            and at the end what they do not tell is held.
        q: (k,) coordinates.
        cost: half the sum of squared residuals of `problem`.
        rms_V: measured minus simulated, root mean square over the compared samples.
        evaluations: of the search so far; 0 in other stages.
        algorithm: of the search that is at work, else empty.
    """

    stage: str
    problem: Problem
    q: FloatArray
    cost: float
    rms_V: float
    evaluations: int = 0
    algorithm: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """A calibrated cell and what is known of it.

    Attributes:
        problem: tests and parameters.
        q: (k,) coordinates of the estimate.
        numbers: of the kernel, by name.
        answer: parameters with their errors.
        fitted: every test in full.
        advice: further tests, the most informative first.
        remarks: what was detected in the tests, and what they leave unknown.
        information: of each test about each parameter.
        correction: of the open-circuit curve, if there is one.
        missing: what was not computed, in words.
    """

    problem: Problem
    q: FloatArray
    numbers: Mapping[str, float]
    answer: Answer
    fitted: tuple[Fitted, ...]
    advice: tuple[Advice, ...]
    remarks: tuple[str, ...]
    information: Information
    correction: Correction | None
    missing: tuple[str, ...]


def problem_of(
    pack: Pack, tests: Sequence[ReferenceTest], *, only: Sequence[str] | None = None
) -> Problem:
    """What is to be fitted; `only` names the parameters of the cell that are free, None all.

    CalibrationError without a test, with two of one name, or a pack that `check_effects` refuses.
    """
    if not tests:
        raise CalibrationError("no test to calibrate from")
    if len({t.name for t in tests}) < len(tests):
        raise CalibrationError("two tests have the same name: rename one")
    check_effects(pack)
    return Problem(pack, [sampled(t, labelled_C(pack)) for t in tests], only=only)


def fit(
    problem: Problem, *, start: Mapping[str, float] | None = None, search: Search | None = None,
    evaluations: int = 4000, seed: int = 0,
) -> Iterator[Progress]:  # fmt: skip
    """Ever better fits; stop iterating whenever it is good enough.

    `start` are values of an earlier fit to go on from, by name. `search` is used where least
    squares alone do not explain the tests; None leaves it at them. CalibrationError if no cell has
    the numbers that it starts from.
    """
    best = None
    begin = None if start is None else problem.coordinates(start)
    for best in _fresh(problem) if begin is None else _gone_on(problem, begin):
        yield best
    assert best is not None
    if search is None or _explained(best):
        yield from _finished(best)
        return
    # without what steps and mesh miss at one point: a search that is gone on with is the same one
    problem = problem.of_other_tests([t.as_expected() for t in best.problem.tests])
    best = _progress(problem, best.stage, best.q, problem.cost(best.q))
    low, high = problem.bounds
    unit = (best.q - low) / (high - low)
    for found in search(problem.costs, unit.size, seed=seed, evaluations=evaluations, start=unit):
        if found.cost < best.cost:
            best = _progress(problem, SEARCH, low + found.point * (high - low), found.cost)
        yield replace(best, stage=SEARCH, evaluations=found.evaluations, algorithm=found.algorithm)
    for polished in _polished(problem, best.q):
        if polished.problem is not problem or polished.cost <= best.cost:
            yield (best := polished)
    yield from _finished(best)


def fit_from_everywhere(problem: Problem) -> Iterator[Progress]:
    """The same by least squares from all points of `starts.py`, the best of them finished.

    Of a measured cell many valleys miss the tests by as little as a twin may, and the first to do
    so may have numbers that no cell has: the likeliest is wanted.
    """
    best = None
    for best in _fresh(problem, 0.0):
        yield best
    assert best is not None
    yield from _finished(best)


def _finished(best: Progress) -> Iterator[Progress]:
    """All again with bumps on the open-circuit curve, if the tests demand them; then settled.

    All again: losses that followed a wrong curve hide in other tests what the slow ones demand.
    """
    bumped = None if _explained(best) else with_bumps(best.problem, best.q)
    end = None
    if bumped is not None:
        with suppress(Infeasible):
            q = bumped.coordinates(best.problem.values_by_name(best.q))
            for step in settled(of_a_model(bumped), q):
                end = step
                yield replace(best, stage=CORRECTION)
    found = end and correction_of(end.problem, end.q, answer(end.problem, end.q))
    if end and found and found.demanded:
        yield _progress(end.problem, CORRECTION, end.q, end.cost)
        return
    for s in weighed_and_held(Settled(best.problem, best.q, best.cost)):
        yield _progress(s.problem, LEAST_SQUARES, s.q, s.cost)


def conclusions(
    problem: Problem, q: FloatArray, tests: Sequence[ReferenceTest]
) -> Iterator[Calibration]:
    """What the fit `q` of `problem` to `tests` tells, ever more of it; stop when it is enough.

    First all but what `Calibration.missing` says; then further tests worth making, and each test
    predicted by a fit to the others.
    """
    told = answer(problem, q)
    others = tuple(f"{t.name} predicted from the other tests" for t in tests if len(tests) > 1)
    remarks = [f"{t.name}: {r}" for t in tests for r in t.remarks]
    correction = correction_of(problem, q, told)
    remarks += [str(correction)] if correction else []
    remarks += [*of_weights(problem), *of_starts(problem, q, tests)]
    found = Calibration(
        problem=problem,
        q=q,
        numbers=problem.numbers(q),
        answer=told,
        information=information(problem, q),
        correction=correction,
        fitted=fitted(problem, q, tests),
        advice=(),
        remarks=(*remarks, *left_unknown(tuple(tests), problem.pack)),
        missing=(ADVICE, *others),
    )
    yield found
    found = replace(found, advice=advise(problem, q, told), missing=others)
    yield found
    for k in range(len(others)):
        for voltages_V in predicted(problem, q, tests, [k]):
            for voltage_V in voltages_V:
                shown = replace(found.fitted[k], held_out_V=voltage_V)
                after = (*found.fitted[:k], shown, *found.fitted[k + 1 :])
                found = replace(found, fitted=after, missing=others[k + 1 :])
            yield found


def conclude(
    problem: Problem, q: FloatArray, tests: Sequence[ReferenceTest], *, cross_validate: bool
) -> Calibration:
    """The last of `conclusions`; without `cross_validate` no test is predicted from the others."""
    steps = conclusions(problem, q, tests)
    if not cross_validate:
        return next(c for c in steps if ADVICE not in c.missing)
    *_, last = steps
    return last


def _fresh(problem: Problem, enough_V: float = MISSED_V) -> Iterator[Progress]:
    """From points of `starts.py`, until a fit misses each test by less than `enough_V`."""
    q = starts.of_windows(problem)
    yield _progress(problem, "windows and capacity", q, problem.cost(q))
    first = None
    for first in _loosely(problem, [q, starts.plentiful(problem, q)], None, enough_V):
        yield first
    more = iter(()) if _near(first, FAR * enough_V) else starts.drawn(of_a_model(problem), q)
    best = first
    for best in _loosely(problem, more, first, enough_V):
        yield best
    yield from _closer(problem, q, _of_a_cell(best))


def _gone_on(problem: Problem, q: FloatArray) -> Iterator[Progress]:
    """From an earlier fit."""
    if _explained(_progress(problem, LEAST_SQUARES, q, problem.cost(q))):
        yield from _polished(problem, q)
        return
    best = None
    for best in _loosely(problem, [q], None):
        yield best
    yield from _closer(problem, q, _of_a_cell(best))


def _of_a_cell(best: Progress | None) -> Progress:
    """It; CalibrationError if there is none."""
    if best is None:
        raise CalibrationError("no cell has the numbers that the fit starts from")
    return best


def _closer(problem: Problem, start: FloatArray, best: Progress) -> Iterator[Progress]:
    """What is better than `best`, the twin taken for the cell, from `start`; if it may be.

    If not, the floor of the valley that `best` is in.
    """
    close, near = best, _near(best)
    with suppress(Infeasible):
        *_, close = _polished(problem, start, SMALL_GAIN if near else SIGHTED)
    if near and not _explained(close):
        *_, close = _polished(problem, best.q)
    if near and _explained(close):
        yield close
        return
    if not near:  # what noise alone leads to may lie in a better valley
        for better in _loosely(problem, [close.q], best):
            yield (best := better)
    yield from _polished(best.problem, best.q)


def _loosely(
    problem: Problem, points: Iterable[FloatArray], best: Progress | None,
    enough_V: float = MISSED_V,
) -> Iterator[Progress]:  # fmt: skip
    """As if the twin missed each test by some millivolts: what is better than `best`.

    Until one is `_near`; as far down as `SIGHTED`. Points whose values no cell has are left out.
    """
    loose = of_a_model(problem)
    for start in points:
        with suppress(Infeasible):
            for other in _polished(loose, start, SIGHTED):
                if best is None or other.cost < best.cost:
                    yield (best := other)
        if _near(best, enough_V):
            return


def _near(best: Progress | None, most_V: float = MISSED_V) -> bool:
    """Each test is missed by less, as it is by default by what a twin may miss."""
    if best is None:
        return False
    tests = range(len(best.problem.tests))
    return max(best.problem.rms_V(best.q, k) for k in tests) < most_V


def _explained(best: Progress) -> bool:
    """Little is left but noise, and nothing else was expected."""
    tests = best.problem.tests
    as_the_cell = not any(t.model_V for t in tests)
    return as_the_cell and best.cost < EXPLAINED * 0.5 * sum(t.at.size for t in tests)


def _polished(
    problem: Problem, q: FloatArray, small_gain: float = SMALL_GAIN
) -> Iterator[Progress]:
    for s in least_squares(problem, q, small_gain=small_gain):
        yield _progress(s.problem, LEAST_SQUARES, s.q, s.cost)


def _progress(problem: Problem, stage: str, q: FloatArray, cost: float) -> Progress:
    error = problem.residuals(q)[: sum(t.at.size for t in problem.tests)]
    sigma_V = np.concatenate([t.sigma_V for t in problem.tests])
    rms_V = float(np.sqrt(np.mean((error * sigma_V) ** 2)))
    return Progress(stage=stage, problem=problem, q=q, cost=cost, rms_V=rms_V)
