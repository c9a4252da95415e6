"""A correction of the open-circuit curve: where one is demanded, and how a cell carries it."""

import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import cell_pack, empty_tests, load_of, measured
from twin.at_rest import open_circuit_V
from twin.bpx_file import read_bpx
from twin.bpx_function import Constant, Expression, Table
from twin.bpx_out import plus, write_bpx
from twin.builtin import load_cell
from twin.bumps import bump_names, evenly, settled
from twin.calibrate.objective import Problem
from twin.calibrate.ocp_correction import (
    BUMPS,
    Correction,
    slow_test,
    with_bumps,
)
from twin.calibrate.out import cell_of
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import Calibration, Progress, conclude, fit, problem_of
from twin.cell import Cell, Function
from twin.effects import SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

FloatArray = npt.NDArray[np.float64]

X = ca.SX.sym("x")
BUMP = Expression("0.015 * exp(-((x - 0.5) / 0.07) ** 2) - 0.012 * exp(-((x - 0.62) / 0.05) ** 2)")


def values(function: Function, at: FloatArray) -> FloatArray:
    return np.asarray(ca.Function("f", [X], [function(X)])(at[None, :])).ravel()


def bumped(cell: Cell) -> tuple[Cell, dict[str, float]]:
    """With bumps of about 10 mV on its positive potential."""
    p = cell.positive
    ends = p.stoichiometry_min, p.stoichiometry_max
    own = replace(cell, positive=replace(p, ocp_V=evenly(p.ocp_V, *ends, BUMPS)))
    heights = np.random.default_rng(1).normal(0.0, 0.01, BUMPS)
    return own, dict(zip(bump_names(own), heights.tolist(), strict=True))


@pytest.mark.parametrize("name", ["lipo_2200", pytest.param("lg_m50", marks=pytest.mark.long)])
def test_bumps_as_numbers_of_the_kernel_are_the_potential_they_add_up_to(name: str) -> None:
    plain = load_cell(name)
    cell, heights = bumped(plain)
    rate_A = plain.nominal_capacity_C / 3600
    load = Load(time_s=np.arange(0.0, 1200.0, 5.0), current_A=np.full(240, 2.0 * rate_A))
    heated = Pack(cell=cell, effects=(SelfHeating(),))
    got = simulate(replace(heated, moved=tuple(heights.items())), load)
    expected = simulate(replace(heated, cell=settled(cell, heights)), load)
    assert got.voltage_V == pytest.approx(expected.voltage_V, abs=1e-9)
    assert got.temperature_K == pytest.approx(expected.temperature_K, abs=1e-9)
    without = simulate(replace(heated, cell=plain), load)
    assert np.abs(got.voltage_V - without.voltage_V).max() > 5e-3


def test_a_cell_without_bumps_has_no_number_more() -> None:
    cell = load_cell("lipo_2200")
    assert bump_names(cell) == ()
    assert settled(cell, {}) == cell


@pytest.mark.parametrize("name", ["lipo_2200", "lg_m50"])
def test_cells_with_bumps_rest_full_and_empty_where_they_did_and_are_written_as_bpx(
    name: str,
) -> None:
    problem, q = bumpy(name)
    after = cell_of(problem, q)
    for soc in (0.0, 1.0):
        at_end_V = open_circuit_V(problem.pack.cell, soc)
        assert open_circuit_V(after, soc) == pytest.approx(at_end_V, abs=1e-9)
        assert problem.rest_V(q, soc) == pytest.approx(at_end_V, abs=1e-9)
    again = read_bpx(write_bpx(after, description="a test"), name="again")
    assert again.positive == after.positive


def bumpy(name: str) -> tuple[Problem, FloatArray]:
    """A test, bumps free, and coordinates of a drawn cell with some."""
    tests, truth, _ = measured(cell_pack(name), 3, ("0.1C",))
    plain = problem_of(cell_pack(name), tests)
    problem = with_bumps(plain, truth)
    assert problem is not None
    heights = np.random.default_rng(2).normal(0.0, 0.5, BUMPS)
    heights_V = dict(zip(bump_names(problem.pack.cell), 0.01 * heights, strict=True))
    return problem, problem.coordinates(plain.values_by_name(truth) | heights_V)


@pytest.mark.parametrize("name", ["lipo_2200", pytest.param("lg_m50", marks=pytest.mark.long)])
def test_derivatives_by_heights_are_those_of_the_residuals(name: str) -> None:
    problem, q = bumpy(name)
    residuals, slopes = problem.linearised(q)
    assert residuals == pytest.approx(problem.residuals(q))
    names = [p.name for p in problem.parameters]
    for height in bump_names(problem.pack.cell)[::4]:
        step = np.zeros(q.size)
        step[names.index(height)] = 1e-4
        change = (problem.residuals(q + step) - problem.residuals(q - step)) / 2e-4
        got = slopes[:, names.index(height)]
        assert np.abs(got - change).max() < 1e-4 * np.abs(change).max()
    assert [p.name for p in problem.plain().parameters] == [n for n in names if "bump" not in n]


def rested() -> ReferenceTest:
    """At 1C from rest to rest, six of them."""
    stages = ((0.0, 60.0, 10.0), (1.0, 600.0, 10.0), (0.0, 600.0, 30.0)) * 5
    time_s, current_A = load_of(stages, cell_pack().cell.nominal_capacity_C / 3600)
    return ReferenceTest(
        name="rests", time_s=time_s, current_A=current_A, voltage_V=np.full(time_s.size, 4.0)
    )


def test_slow_tests_and_rests_tell_the_curve_and_fast_ones_do_not() -> None:
    pack = cell_pack()
    tests = {t.name: t for t in empty_tests(pack)}
    names = list(tests)
    assert slow_test(problem_of(pack, list(tests.values()))) == names.index("0.1C")
    assert slow_test(problem_of(pack, [tests["2C"]])) is None
    assert with_bumps(problem_of(pack, [tests["2C"]]), np.zeros(20)) is None
    assert slow_test(problem_of(pack, [tests["2C"], rested()])) == 1


@pytest.mark.parametrize(
    "function",
    [Constant(3.3), Expression("4.2 - x"), Table((0.0, 0.2, 0.5, 1.0), (4.3, 4.0, 3.8, 3.0))],
)
def test_a_function_plus_an_expression_is_the_sum(function: Function) -> None:
    x = np.linspace(0.01, 0.99, 197)
    got = values(plus(function, BUMP, 0.005), x)
    assert got == pytest.approx(values(function, x) + values(BUMP, x), abs=2e-4)  # of a table


def told(**changes: float) -> Correction:
    potential = evenly(Constant(3.3), 0.2, 0.8, 3)
    given = {"rms_V": 0.02, "corrected_rms_V": 0.005, "gain": 50.0} | changes
    return Correction(
        potential=potential, heights_V=(0.0, 0.01, 0.0), stds_V=(1e-3,) * 3, test="C/10", **given
    )


def test_what_demands_a_correction_is_strong_evidence_also_in_the_slow_test() -> None:
    assert told().demanded
    assert not told(gain=9.0).demanded
    assert not told(corrected_rms_V=0.0199).demanded  # as much as a sensor drifts
    assert not told(corrected_rms_V=0.03).demanded  # it serves the fast tests
    assert "+10.0 mV at 50 %" in str(told())


@cache
def fitted() -> tuple[list[ReferenceTest], list[Progress]]:
    """The built-in cell, fitted to tests of one with another potential."""
    pack = cell_pack()
    positive = pack.cell.positive
    other = replace(positive, ocp_V=plus(positive.ocp_V, BUMP, 0.005))
    truth = replace(pack, cell=replace(pack.cell, positive=other))
    tests, _, _ = measured(truth, 1, ("0.1C", "2C"))
    return tests, list(fit(problem_of(pack, tests)))


@cache
def concluded() -> Calibration:
    tests, steps = fitted()
    return conclude(steps[-1].problem, steps[-1].q, tests, cross_validate=False)


@pytest.mark.long
def test_a_fit_finds_the_correction_of_a_cell_with_another_potential() -> None:
    before, after = fitted()[1][-2:]
    assert before.problem.unbumped is None
    assert after.problem.unbumped is not None
    assert with_bumps(after.problem, after.q) is None  # a fit that goes on lays none over these
    slow, fast = ([s.problem.rms_V(s.q, k) for s in (before, after)] for k in range(2))
    assert slow[1] < 0.6 * slow[0]
    assert fast[1] < 0.6 * fast[0]  # losses had followed the wrong curve
    found = concluded().correction
    assert found is not None
    assert (found.test, found.demanded) == ("0.1C", True)
    assert found.rms_V == pytest.approx(before.problem.even_rms_V(before.q, 0), rel=1e-3)
    assert any("open-circuit curve" in remark for remark in concluded().remarks)


@pytest.mark.long
def test_the_corrected_cell_rests_as_the_true_one_does() -> None:
    pack, found = cell_pack(), concluded()
    positive = pack.cell.positive
    truth = replace(positive, ocp_V=plus(positive.ocp_V, BUMP, 0.005))
    after = cell_of(found.problem, found.q).positive
    y = np.linspace(positive.stoichiometry_min + 0.05, positive.stoichiometry_max - 0.05, 60)
    off_V = values(after.ocp_V, y) - values(truth.ocp_V, y)
    plain_V = values(positive.ocp_V, y) - values(truth.ocp_V, y)
    assert np.std(off_V) < 0.5 * np.std(plain_V)


def test_other_tools_read_the_same_potential(tmp_path: Path) -> None:
    cell, heights = bumped(load_cell("lipo_2200"))
    after = settled(cell, heights)
    file = tmp_path / "cell.bpx.json"
    file.write_text(write_bpx(after, description="a test"), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pybamm = pytest.importorskip("pybamm")
        loaded = pybamm.ParameterValues.create_from_bpx(str(file))
    potential = loaded["Positive electrode OCP [V]"]
    x = np.linspace(0.25, 0.7, 10)
    theirs = [float(loaded.evaluate(potential(pybamm.Scalar(float(at))))) for at in x]
    assert theirs == pytest.approx(values(after.positive.ocp_V, x).tolist(), abs=1e-9)
