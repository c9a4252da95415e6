"""What each test tells: against the whole, against the test alone, against differences."""

from functools import cache

import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import cell_pack, measured
from twin.calibrate.answer import excess_of
from twin.calibrate.information import Information, information
from twin.calibrate.objective import Problem
from twin.calibrate.run import problem_of

FloatArray = npt.NDArray[np.float64]


@cache
def told() -> tuple[Information, Problem, FloatArray]:
    pack = cell_pack()
    tests, truth, _ = measured(pack, 2, ("2C", "pulses"))
    problem = problem_of(pack, tests)
    return information(problem, truth), problem, truth


def test_the_tests_add_up_to_the_whole() -> None:
    _, problem, truth = told()
    q = 0.8 * truth  # off the truth, so that all residuals are above what noise alone leaves
    found = information(problem, q)
    residuals, slopes = problem.linearised(q)
    excess = excess_of(problem, residuals)
    data = sum(t.at.size for t in problem.tests)
    whole = slopes[:data].T @ slopes[:data]
    assert np.einsum("t,tij->ij", excess, found.by_test) == pytest.approx(
        whole, rel=1e-9, abs=1e-9 * np.abs(whole).max()
    )
    assert found.prior == pytest.approx(slopes[data:].T @ slopes[data:])


def test_a_test_alone_is_the_calibration_that_has_no_other() -> None:
    found, problem, q = told()
    cell = q.size - len(problem.tests)
    for k, test in enumerate(problem.tests):
        alone = information(problem.of_other_tests((test,)), np.append(q[:cell], q[cell + k]))
        assert alone.together[:cell] == pytest.approx(found.alone[k, :cell], rel=1e-6)


def test_all_tests_leave_no_more_than_each_and_none_more_than_the_prior() -> None:
    found, _, _ = told()
    assert (found.together <= found.alone.min(axis=0) * (1 + 1e-9)).all()
    assert (found.alone <= 1 + 1e-9).all()
    assert found.alone.min() < 0.05  # and some test tells a lot


def test_the_start_of_a_test_is_told_by_that_test_alone() -> None:
    found, _, _ = told()
    mine, other = (found.names.index(f"start_V:{t}") for t in found.tests)
    assert found.alone[0, other] == pytest.approx(1.0)
    assert found.alone[1, mine] == pytest.approx(1.0)
    assert found.effect_V[0, other] == 0.0


def test_the_effect_is_what_a_step_of_the_parameter_does() -> None:
    found, problem, q = told()
    step = 1e-3
    for name in ("capacity_C", "negative.exchange_current_A_m2"):
        k = found.names.index(name)
        for t in range(len(problem.tests)):
            up, down = (
                problem.simulated(q + s * np.eye(q.size)[k], t).voltage_V for s in (step, -step)
            )
            effect = np.sqrt(np.mean(((up - down) / (2 * step)) ** 2))
            assert found.effect_V[t, k] == pytest.approx(effect, rel=1e-2)
