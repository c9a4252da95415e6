"""A correction of the open-circuit curve: where one is demanded, and how a cell carries it."""

import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import cell_pack, empty_tests, measured
from twin.bpx_file import open_circuit_V, read_bpx
from twin.bpx_function import Constant, Expression, Table
from twin.bpx_out import plus, write_bpx
from twin.builtin import load_cell
from twin.calibrate.ocp_correction import Correction
from twin.calibrate.ocp_evidence import correction_of, slow_discharge
from twin.calibrate.run import Progress, fit, problem_of
from twin.cell import Function

FloatArray = npt.NDArray[np.float64]

X = ca.SX.sym("x")
BUMP = Expression("0.015 * exp(-((x - 0.5) / 0.07) ** 2) - 0.012 * exp(-((x - 0.62) / 0.05) ** 2)")


def values(function: Function, at: FloatArray) -> FloatArray:
    return np.asarray(ca.Function("f", [X], [function(X)])(at[None, :])).ravel()


def of_residual(seed: int, *, bump: bool, colour: float = 0.0) -> Correction | None:
    """600 samples with 1 mV of noise, `colour` of each handed on to the next."""
    y, random = np.linspace(0.25, 0.74, 600), np.random.default_rng(seed)
    noise = random.standard_normal(y.size)
    for k in range(1, y.size):
        noise[k] = colour * noise[k - 1] + (1 - colour**2) ** 0.5 * noise[k]
    residual_V = 1e-3 * noise + (values(BUMP, y) if bump else 0.0)
    return correction_of("slow", y, residual_V, np.full(y.size, 1e-3))


@pytest.mark.parametrize("seed", range(3))
def test_what_is_concealed_in_the_potential_is_found(seed: int) -> None:
    found = of_residual(seed, bump=True)
    assert found is not None
    y = np.linspace(0.25, 0.74, 100)
    assert found.at_V(y) == pytest.approx(values(BUMP, y), abs=2e-3)  # narrower than the bumps
    assert found.at_V(y) == pytest.approx(values(found.added, y), abs=1e-12)
    assert found.corrected_rms_V == pytest.approx(1e-3, rel=0.2)
    assert max(found.stds_V) < 1e-3


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_noise_demands_no_correction(colour: float) -> None:
    assert not any(of_residual(seed, bump=False, colour=colour) for seed in range(20))


def test_a_test_with_pulses_is_no_slow_discharge_however_long_it_rests() -> None:
    pack = cell_pack()
    tests = empty_tests(pack)
    slow = [t.name for t in tests].index("0.1C")
    assert slow_discharge(problem_of(pack, tests)) == slow
    assert slow_discharge(problem_of(pack, [t for t in tests if t.name != "0.1C"])) is None


@pytest.mark.parametrize(
    "function",
    [Constant(3.3), Expression("4.2 - x"), Table((0.0, 0.2, 0.5, 1.0), (4.3, 4.0, 3.8, 3.0))],
)
def test_a_function_plus_an_expression_is_the_sum(function: Function) -> None:
    x = np.linspace(0.01, 0.99, 197)
    got = values(plus(function, BUMP, 0.005), x)
    assert got == pytest.approx(values(function, x) + values(BUMP, x), abs=2e-4)  # of a table


def corrected() -> Correction:
    found = of_residual(0, bump=True)
    assert found is not None
    return found


def test_a_corrected_cell_rests_full_and_empty_where_it_did_and_is_written_as_bpx() -> None:
    cell = load_cell("lipo_2200")
    after = corrected().of_cell(cell)
    for soc in (0.0, 1.0):
        assert open_circuit_V(after, soc) == pytest.approx(open_circuit_V(cell, soc), abs=1e-9)
    assert open_circuit_V(after, 0.5) - open_circuit_V(cell, 0.5) == pytest.approx(0.015, abs=3e-3)
    again = read_bpx(write_bpx(after, description="a test"), name="again")
    assert again.positive == after.positive
    assert "+14.7 mV at 49 %" in str(corrected())


@pytest.mark.slow
def test_other_tools_read_the_same_potential(tmp_path: Path) -> None:
    after = corrected().of_cell(load_cell("lipo_2200"))
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


@cache
def fitted() -> list[Progress]:
    """The built-in cell, fitted to tests of one with another potential."""
    pack = cell_pack()
    positive = pack.cell.positive
    other = replace(positive, ocp_V=plus(positive.ocp_V, BUMP, 0.005))
    truth = replace(pack, cell=replace(pack.cell, positive=other))
    tests, _, _ = measured(truth, 1, ("0.1C", "2C"))
    return list(fit(problem_of(pack, tests)))


def rms_V(step: Progress) -> list[float]:
    """Of each test."""
    voltages = [step.problem.simulated(step.q, k).voltage_V for k in range(2)]
    return [
        float(np.sqrt(np.mean((t.voltage_V - v) ** 2)))
        for t, v in zip(step.problem.tests, voltages, strict=True)
    ]


@pytest.mark.slow
def test_a_fit_finds_the_correction_of_a_cell_with_another_potential() -> None:
    steps = fitted()
    before, after = steps[-2:]
    assert before.problem.correction is None
    assert after.problem.correction is not None
    assert after.problem.correction.test == "0.1C"
    slow, fast = zip(rms_V(before), rms_V(after), strict=True)
    assert slow[1] < 0.6 * slow[0]
    assert fast[1] < 0.6 * fast[0]  # fitted again: losses had followed the wrong curve
