"""From tests to a calibrated cell: `fit` step by step, `conclude` at the end.

First the stoichiometry windows and the capacity from the slowest test, which shows little else;
then all parameters by least squares from there, and once more with salt that lasts, as if the twin
missed each test by some millivolts. Where it misses less, as if it were the cell. Where it is not,
a search of the whole box, and least squares from what it found. Then `settle.py`. Last, where the
tests demand it, a correction of the open-circuit curve.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from twin.calibrate.advice import Advice, advise
from twin.calibrate.answer import Answer, answer
from twin.calibrate.cell_map import Infeasible
from twin.calibrate.checks import Fitted, fitted, predicted
from twin.calibrate.information import Information, information
from twin.calibrate.objective import Problem
from twin.calibrate.ocp_correction import Correction, correction_of, with_bumps
from twin.calibrate.parameters import EMPTY_ENDS
from twin.calibrate.polish import Polished, polish
from twin.calibrate.reference import ReferenceTest, left_unknown
from twin.calibrate.resample import sampled
from twin.calibrate.settle import (
    MISSED_V,
    Settled,
    held_back,
    least_squares,
    of_a_model,
    settled,
)
from twin.calibrate.single_cell import labelled_C
from twin.calibrate.table import CalibrationError
from twin.effects import OF_CELL
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

WINDOWS = ("negative.stoichiometry_max", *EMPTY_ENDS, "capacity_C", "series_resistance_ohm")
LEAST_SQUARES, SEARCH = "least squares", "search"
CORRECTION = "open-circuit curve"
ADVICE = "further tests worth making"
STARTS = (0.0, -1.5, 1.5)  # of the first of WINDOWS
EXPLAINED = 1.3  # mean square of the residuals over what was expected: nothing to search for
SALT, MORE_SALT = "electrolyte.diffusivity_factor", 1.5  # standard deviations, of a second start
WHOLE_TEST = 0.5  # of the capacity: a test that draws less shows no window


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

    CalibrationError without a test, with two of one name, or a pack whose cells differ.
    """
    if not tests:
        raise CalibrationError("no test to calibrate from")
    if len({t.name for t in tests}) < len(tests):
        raise CalibrationError("two tests have the same name: rename one")
    if pack.stressed or pack.weak or any(isinstance(e, OF_CELL) for e in pack.effects):
        raise CalibrationError(
            "the cells of this pack differ, stress enhances their diffusion, or an effect changes "
            "what is to be calibrated: calibrate without those effects in the pack file"
        )
    return Problem(pack, [sampled(t, labelled_C(pack)) for t in tests], only=only)


def fit(
    problem: Problem, *, start: Mapping[str, float] | None = None, search: Search | None = None,
    evaluations: int = 4000, seed: int = 0,
) -> Iterator[Progress]:  # fmt: skip
    """Ever better fits; stop iterating whenever it is good enough.

    `start` are values of an earlier fit to go on from, by name. `search` is used where least
    squares alone do not explain the tests; None leaves it at them.
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


def _finished(start: Progress) -> Iterator[Progress]:
    """`held_back`; then all again with bumps on the open-circuit curve, if the tests demand them.

    All again: losses that followed a wrong curve hide in other tests what the slow ones demand.
    """
    best = start
    for s in held_back(Settled(start.problem, start.q, start.cost)):
        yield (best := _progress(s.problem, LEAST_SQUARES, s.q, s.cost))
    bumped = None if _explained(start) else with_bumps(best.problem, best.q)
    if bumped is None:
        return
    end = None
    with suppress(Infeasible):
        for step in settled(bumped, bumped.coordinates(best.problem.values_by_name(best.q))):
            end = step
            yield replace(best, stage=CORRECTION)
    found = end and correction_of(end.problem, end.q, answer(end.problem, end.q))
    if end and found and found.demanded:
        yield _progress(end.problem, CORRECTION, end.q, end.cost)


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
    found = Calibration(
        problem=problem,
        q=q,
        numbers=problem.mapped(q, 0).numbers,
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


def _fresh(problem: Problem) -> Iterator[Progress]:
    best = None
    for best in _windows(problem):
        yield best
    assert best is not None
    yield from _followed(problem, [best.q, _plentiful(problem, best.q)])


def _gone_on(problem: Problem, q: FloatArray) -> Iterator[Progress]:
    """From an earlier fit."""
    if _explained(_progress(problem, LEAST_SQUARES, q, problem.cost(q))):
        yield from _polished(problem, q)
    else:
        yield from _followed(problem, [q])


def _followed(problem: Problem, starts: Sequence[FloatArray]) -> Iterator[Progress]:
    """Least squares from the best of `starts`, the twin taken for the cell only if it may be."""
    best = None
    for best in _loosely(problem, starts, None):
        yield best
    assert best is not None
    *_, close = _polished(problem, starts[0])
    if not _near(best):  # what noise alone leads to may lie in a better valley
        yield from _loosely(problem, [close.q], best)
        return
    if not _explained(close):
        *_, close = _polished(problem, best.q)
    if _explained(close):
        yield close


def _loosely(
    problem: Problem, starts: Sequence[FloatArray], best: Progress | None
) -> Iterator[Progress]:
    """As if the twin missed each test by some millivolts: what is better than `best`."""
    loose = of_a_model(problem)
    for start in starts:
        for other in _polished(loose, start):
            if best is None or other.cost < best.cost:
                yield (best := other)
        if best is not None and _near(best):
            return


def _near(best: Progress) -> bool:
    """Each test is missed by less than what a twin may miss."""
    tests = range(len(best.problem.tests))
    return max(best.problem.rms_V(best.q, k) for k in tests) < MISSED_V


def _explained(best: Progress) -> bool:
    """Little is left but noise, and nothing else was expected."""
    tests = best.problem.tests
    as_the_cell = not any(t.model_V for t in tests)
    return as_the_cell and best.cost < EXPLAINED * 0.5 * sum(t.at.size for t in tests)


def _plentiful(problem: Problem, q: FloatArray) -> FloatArray:
    """`q` with salt that lasts: least squares stop where it runs out, for there a run ends."""
    out = q.copy()
    for k, p in enumerate(problem.parameters):
        if p.name == SALT:
            out[k] += MORE_SALT
    return np.asarray(np.clip(out, *problem.bounds))


def _windows(problem: Problem) -> Iterator[Progress]:
    """Windows and capacity from the slowest whole test, all else at its prior."""
    slow = _slowest(problem)
    names = [p.name for p in problem.parameters]
    own = problem.with_only([name for name in names if name in WINDOWS], [slow])
    drawn_C = float(np.ptp(problem.tests[slow].drawn_C))
    results = [r for start in STARTS for r in _last(own, _window_start(own, start, drawn_C))]
    q = np.zeros(len(names))
    if results:
        best = min(results, key=lambda r: r.cost)
        for p, value in zip(own.parameters, best.q.tolist(), strict=True):
            q[names.index(p.name)] = value
    q = np.clip(q, *problem.bounds)
    yield _progress(problem, "windows and capacity", q, problem.cost(q))


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


def _polished(problem: Problem, q: FloatArray) -> Iterator[Progress]:
    for s in least_squares(problem, q):
        yield _progress(s.problem, LEAST_SQUARES, s.q, s.cost)


def _slowest(problem: Problem) -> int:
    """Position of the test with the least current of those that draw most of the charge."""
    spans = np.array([np.ptp(t.drawn_C) for t in problem.tests])
    mean_A = [spans[k] / t.load.time_s[-1] for k, t in enumerate(problem.tests)]
    whole = spans > WHOLE_TEST * problem.nominal_C
    return int(np.argmin(np.where(whole, mean_A, np.inf))) if whole.any() else int(spans.argmax())


def _progress(problem: Problem, stage: str, q: FloatArray, cost: float) -> Progress:
    error = problem.residuals(q)[: sum(t.at.size for t in problem.tests)]
    sigma_V = np.concatenate([t.sigma_V for t in problem.tests])
    rms_V = float(np.sqrt(np.mean((error * sigma_V) ** 2)))
    return Progress(stage=stage, problem=problem, q=q, cost=cost, rms_V=rms_V)
