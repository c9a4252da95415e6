"""A whole calibration: what it recovers, what it says it does not know."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import cell_pack, empty_tests, measured
from twin.calibrate.advice import advise
from twin.calibrate.answer import Verdict
from twin.calibrate.checks import Fitted, predicted, rms
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.remarks import of_starts
from twin.calibrate.resample import LOADED_V
from twin.calibrate.run import (
    SEARCH,
    Calibration,
    conclude,
    fit,
    problem_of,
)
from twin.calibrate.search import Best, Stage
from twin.calibrate.settle import MISSED_V, STRETCHES, of_a_model
from twin.calibrate.table import CalibrationError
from twin.effects import (
    AnyEffect,
    ClockShift,
    ColdPack,
    CurrentGain,
    CurrentOffset,
    InitialSoc,
    Leakage,
    SelfHeating,
    SensorLag,
    SeriesResistance,
    VoltageGain,
    WeakCell,
)
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]


@cache
def calibrated() -> tuple[Calibration, FloatArray, Problem]:
    pack = cell_pack()
    tests, truth, blank = measured(pack, 1, ("0.1C", "2C"))
    problem = problem_of(pack, tests)
    *_, last = fit(problem)
    return conclude(last.problem, last.q, tests, cross_validate=True), truth, blank


def _as_test(shown: Fitted) -> ReferenceTest:
    return ReferenceTest(
        name=shown.name, time_s=shown.time_s, current_A=shown.current_A,
        voltage_V=shown.measured_V,
    )  # fmt: skip


@pytest.mark.long
def test_the_right_open_circuit_curve_is_not_corrected() -> None:
    assert calibrated()[0].correction is None


def test_the_fit_reaches_the_noise() -> None:
    for test in calibrated()[0].fitted:
        assert test.rms_V == pytest.approx(2e-3, rel=0.15)  # 600 samples: 3 % for one deviation
        assert test.noise_V == pytest.approx(2e-3, rel=0.2)
        assert np.nanmax(test.rms_by_soc_V()) < 3e-3


def test_a_held_out_test_is_predicted_far_better_than_by_the_cell_to_start_from() -> None:
    found = calibrated()[0]
    slow = found.fitted[0]
    start = found.problem.replayed(0 * found.q, _as_test(slow), 4.2) - slow.measured_V
    assert slow.held_out_rms_V is not None
    assert slow.held_out_rms_V < 0.5 * rms(start[np.isfinite(start)])


def test_the_truth_lies_within_the_errors_that_are_stated() -> None:
    found, truth, blank = calibrated()
    std = np.sqrt(np.diag(found.answer.covariance)).tolist()
    for estimate, parameter, q, error in zip(
        found.answer.estimates, blank.parameters, truth, std, strict=True
    ):
        assert estimate.name == parameter.name
        off = (parameter.coordinate(estimate.value) - q) / error
        assert abs(off) < 3.5, estimate.name  # of 19 normal numbers one in a hundred such sets
    for estimate, value in zip(found.answer.derived, blank.mapped(truth, 0).derived, strict=True):
        assert abs(estimate.value - value) < 3.5 * estimate.std, estimate.name


def test_what_the_tests_do_not_show_is_said_to_be_the_prior() -> None:
    found = calibrated()[0]
    verdicts = {e.name: e.verdict for e in found.answer.estimates}
    assert verdicts["negative.conductivity_S_m"] is Verdict.PRIOR
    assert verdicts["separator.porosity"] is Verdict.PRIOR
    assert verdicts["capacity_C"] is Verdict.IDENTIFIED
    assert verdicts["negative.stoichiometry_max"] is Verdict.IDENTIFIED
    assert "negative.conductivity_S_m" in found.answer.held
    for e in found.answer.estimates:
        if e.name in found.answer.held:
            assert e.verdict is Verdict.PRIOR
            assert (e.value, e.left_of_prior) == pytest.approx((e.prior, 1.0), rel=1e-9)
            assert e.lower < e.prior < e.upper
    assert len(found.answer.stiff) + len(found.answer.sloppy) == len(found.answer.names)
    assert found.answer.stiff[0].std < 0.01
    assert np.diag(found.answer.correlations) == pytest.approx(np.ones(len(found.q)))


def test_a_further_test_is_missed_by_a_twin_as_much_as_those_it_was_fitted_to() -> None:
    """By noise alone even a repetition would promise to tell nearly all."""
    found = calibrated()[0]
    exact, missed = (
        {a.name: a.gain for a in advise(of_a_model(found.problem, own_V), found.q, found.answer)}
        for own_V in (0.0, 5e-3)
    )
    assert exact.keys() == missed.keys()
    assert all(missed[name] < 0.8 * exact[name] for name in exact)


def test_advice_is_a_test_that_shows_what_is_not_known() -> None:
    advice = calibrated()[0].advice
    assert [a.gain for a in advice] == sorted((a.gain for a in advice), reverse=True)
    gain = {a.name: a.gain for a in advice}
    # 0.1C and 2C were made: pulses show what they cannot, the same again shows least
    assert gain["5C pulses at 50 %"] > gain["0.1C discharge"]
    assert min(gain.values()) > 0


def test_a_held_out_test_is_predicted_from_the_others_alone() -> None:
    found = calibrated()[0]
    tests = [_as_test(f) for f in found.fitted]
    slow, fast = found.problem.tests
    other = [replace(slow, sigma_V=3 * slow.sigma_V, missed_V=1e-3), fast]  # as of another fit
    weighed = found.problem.of_other_tests(other).holding(["capacity_C"])
    assert found.fitted[1].held_out_V is not None
    *_, (got,) = predicted(weighed, found.q, tests, [1])
    assert np.array_equal(got, found.fitted[1].held_out_V)


def test_a_held_out_test_starts_as_it_rested_or_under_load_as_the_fit_has_it() -> None:
    found = calibrated()[0]
    tests = [_as_test(f) for f in found.fitted]
    slow, fast = found.problem.tests
    lower = found.q.copy()
    place = [p.name for p in found.problem.parameters].index(f"start_V:{fast.name}")
    lower[place] -= 0.5

    def changed_V(problem: Problem) -> float:
        (*_, (before,)), (*_, (after,)) = (
            predicted(problem, q, tests, [1]) for q in (found.q, lower)
        )
        return float(np.abs(after - before).max())

    assert changed_V(found.problem) == 0.0
    loaded = replace(fast, start_sigma_V=LOADED_V)
    assert changed_V(found.problem.of_other_tests([slow, loaded])) > 5e-3


def test_an_earlier_fit_is_gone_on_from() -> None:
    found = calibrated()[0]
    steps = list(fit(found.problem, start=found.problem.values_by_name(found.q)))
    assert len(steps) <= 8  # three fits, of one step or two and the point they start from
    assert steps[-1].q == pytest.approx(found.q, abs=0.05)


def test_a_search_begins_where_least_squares_end_and_is_asked_only_if_they_miss() -> None:
    problem = calibrated()[0].problem
    start = problem.values_by_name(calibrated()[0].q)

    def never(*_: object, **__: object) -> object:
        raise AssertionError

    list(fit(problem, start=start, search=never))  # type: ignore[arg-type]


def test_what_a_search_finds_is_taken_if_it_is_better() -> None:
    pack = cell_pack()
    (fast,), _, _ = measured(pack, 1, ("2C",))
    wave_V = 0.02 * np.sin(fast.time_s / 20.0)  # of no cell
    short = replace(
        fast, time_s=fast.time_s[:150], current_A=fast.current_A[:150],
        voltage_V=(fast.voltage_V + wave_V)[:150],
    )  # fmt: skip
    problem = problem_of(pack, [short])
    asked: list[FloatArray] = []

    def two(  # says that its second point costs nothing
        evaluate: Callable[[FloatArray], FloatArray], dimension: int, *, start: FloatArray,
        **options: int,
    ) -> Iterator[Best]:  # fmt: skip
        assert (dimension, options) == (start.size, {"seed": 5, "evaluations": 7})
        asked.append(start)
        same, other = evaluate(np.array([start, 0.9 * start]))
        assert other > same
        for n, (share, cost) in enumerate([(0.9, float(other)), (0.8, 0.0)], start=1):
            yield Best(
                point=share * start, cost=cost, evaluations=n, algorithm="a", stage=Stage.LEAD
            )

    steps = fit(problem, start={}, search=two, evaluations=7, seed=5)
    seen = []
    for step in steps:
        seen.append(step)
        if step.evaluations == 2:
            break
    *before, worse, better = seen
    low, high = problem.bounds
    assert low + asked[0] * (high - low) == pytest.approx(before[-1].q)
    assert [(p.stage, p.evaluations, p.algorithm) for p in (worse, better)] == [
        (SEARCH, 1, "a"), (SEARCH, 2, "a"),
    ]  # fmt: skip
    assert worse.q is before[-1].q
    assert better.q == pytest.approx(low + 0.8 * asked[0] * (high - low))


@pytest.mark.long
def test_a_test_that_no_cell_explains_draws_nothing_to_its_bounds() -> None:
    pack = cell_pack()
    (slow, fast), _, _ = measured(pack, 1, ("0.1C", "2C"))
    wave_V = 0.05 * np.sin(fast.time_s / 200.0)  # of no cell
    odd = replace(fast, voltage_V=fast.voltage_V + wave_V)
    problem = problem_of(pack, [slow, odd])
    *_, last = fit(problem)
    assert np.abs(last.q).max() < 3  # by noise alone most parameters go to their bounds
    assert last.problem.even_rms_V(last.q, 0) < 6e-3  # the other test is followed nevertheless
    for t in last.problem.tests:  # 640 and 556 samples
        assert np.sum((MISSED_V / t.sigma_V) ** 2) <= STRETCHES


def test_a_pack_of_unlike_cells_and_no_test_are_refused() -> None:
    pack = cell_pack()
    with pytest.raises(CalibrationError, match="no test"):
        problem_of(pack, [])
    unlike = Pack(cell=pack.cell, series=2, effects=(WeakCell(capacity_factor=0.9),))
    tests, _, _ = measured(pack, 2, ("2C",))
    with pytest.raises(CalibrationError, match="differ"):
        problem_of(unlike, tests)
    with pytest.raises(CalibrationError, match="same name"):
        problem_of(pack, [*tests, *tests])
    outside = (SeriesResistance(resistance_ohm=0.01, outside=1.0),)
    with pytest.raises(CalibrationError, match="outside of the cells is not calibrated"):
        problem_of(replace(pack, effects=outside), tests)


@pytest.mark.parametrize(
    "effect",
    [
        CurrentGain(gain=1.1),
        CurrentOffset(offset_A=0.5),
        Leakage(current_A=0.5),
        SensorLag(lag_s=1.0),
        ClockShift(shift_s=0.5),
        VoltageGain(gain=1.02),
        ColdPack(start_offset_K=-10.0),
    ],
    ids=lambda e: e.id,
)
def test_what_was_wrong_in_flights_is_not_put_on_tests(effect: AnyEffect) -> None:
    """`twin explain --adopt` leaves it in a pack file; a cycler's data are as measured."""
    pack = replace(cell_pack(), effects=(SelfHeating(), effect))
    with pytest.raises(CalibrationError, match=f"^{effect.id} in the pack file.*explain"):
        problem_of(pack, empty_tests(pack, ("2C",)))


def test_a_charge_that_was_told_wrong_of_flights_changes_no_test() -> None:
    """Each has its own, by the voltage at its start: this one may stay in a pack file."""
    pack = cell_pack()
    test = empty_tests(pack, ("2C",))[0]
    told_wrong = replace(pack, effects=(InitialSoc(offset=-0.1),))
    own, other = (problem_of(p, [test]) for p in (pack, told_wrong))
    q = np.zeros(len(own.free))
    assert np.array_equal(own.replayed(q, test, 4.1), other.replayed(q, test, 4.1), equal_nan=True)


@pytest.mark.parametrize(("by_rest", "count"), [(False, 1), (True, 0)])
def test_a_test_that_began_with_another_charge_than_a_replay_is_said(
    *, by_rest: bool, count: int
) -> None:
    own = replace(cell_pack(), soc_by_rest=by_rest)
    starts = [0.976, 0.998]
    problem = SimpleNamespace(
        pack=own, mapped=lambda _, k: SimpleNamespace(numbers={"initial_soc": starts[k]})
    )
    tests = [SimpleNamespace(name=name) for name in ("0.1C", "2C")]
    said = of_starts(problem, np.zeros(1), tests)  # type: ignore[arg-type]
    told = "0.1C: began with 97.6% of its charge, as fitted; a pack starts with 100.0%"
    assert said == [told] * count
