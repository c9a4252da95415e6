"""What a fit ends with.

Tests weigh as much as the twin misses them, what they do not tell is held at its prior if it may.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import NOISE_V, cell_pack, empty_tests
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import READ_K, sampled
from twin.calibrate.run import conclusions, problem_of
from twin.calibrate.settle import (
    MINDED,
    MISSED_V,
    MUCH,
    STRETCHES,
    Settled,
    held_back,
    least_squares,
    of_a_model,
    taken_V,
    weighed,
)
from twin.effects import SelfHeating

TOLD, UNTOLD = "positive.diffusivity_m2_s", "negative.conductivity_S_m"


@pytest.fixture(scope="module")
def fitted() -> Settled:
    """To a fast discharge of a cell that differs from its prior in how slow diffusion is."""
    (blank,), only = empty_tests(cell_pack(), ("2C",)), ("capacity_C", TOLD, UNTOLD)
    problem = problem_of(cell_pack(), [blank], only=only)
    truth = np.array([-2.0 if p.name == TOLD else 0.0 for p in problem.parameters])
    voltage_V = problem.replayed(truth, blank, float(blank.voltage_V[0]))
    n = int(np.isfinite(voltage_V).sum())
    noise_V = NOISE_V * np.random.default_rng(1).standard_normal(n)
    test = replace(
        blank, time_s=blank.time_s[:n], current_A=blank.current_A[:n],
        voltage_V=voltage_V[:n] + noise_V,
    )  # fmt: skip
    problem = problem_of(cell_pack(), [test], only=only)
    *_, end = least_squares(problem, 0.0 * truth)
    return end


def held(fitted: Settled, name: str, monkeypatch: pytest.MonkeyPatch) -> list[Settled]:
    """Steps with `name` taken to be what the tests do not tell."""
    monkeypatch.setattr("twin.calibrate.settle.not_identified", lambda *_: (name,))
    return list(held_back(fitted))


def test_what_does_not_matter_is_held(fitted: Settled, monkeypatch: pytest.MonkeyPatch) -> None:
    *_, end = held(fitted, UNTOLD, monkeypatch)
    names = [p.name for p in end.problem.parameters]
    assert end.q[names.index(UNTOLD)] == 0.0
    assert end.cost < fitted.cost + MINDED


def test_what_the_tests_need_is_not(fitted: Settled, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [p.name for p in fitted.problem.parameters]
    assert abs(fitted.q[names.index(TOLD)]) > 1.0
    assert held(fitted, TOLD, monkeypatch) == []


Missed = Callable[[npt.NDArray[np.float64]], npt.NDArray[np.float64]]
ONLY = ("capacity_C", TOLD, "positive.particle_radius_m", "electrolyte.diffusivity_factor")


def of_what_no_twin_has(**missed_V: Missed) -> tuple[Problem, list[ReferenceTest]]:
    """Tests of the cell that the fit starts from, and what no parameter makes.

    By names of protocols, of the share of the time.
    """
    tests = []
    for blank, own_V in zip(
        empty_tests(cell_pack(), tuple(missed_V)), missed_V.values(), strict=True
    ):
        problem = problem_of(cell_pack(), [blank], only=ONLY)
        voltage_V = problem.replayed(np.zeros(len(problem.free)), blank, float(blank.voltage_V[0]))
        n = int(np.isfinite(voltage_V).sum())
        tests.append(
            replace(
                blank, time_s=blank.time_s[:n], current_A=blank.current_A[:n],
                voltage_V=voltage_V[:n] + own_V(blank.time_s[:n] / blank.time_s[n - 1]),
            )
        )  # fmt: skip
    return of_a_model(problem_of(cell_pack(), tests, only=ONLY)), tests


def wave(height_V: float) -> Missed:
    """Twice up and down."""
    return lambda share: height_V * np.sin(4 * np.pi * share)


def of_cell(end: Settled) -> npt.NDArray[np.float64]:
    """Coordinates without those of the starts."""
    return np.abs(end.q[: len(ONLY)])


def test_tests_that_a_twin_misses_much_weigh_less() -> None:
    problem, tests = of_what_no_twin_has(**{"2C": wave(0.03)})
    *_, loud = least_squares(problem, np.zeros(len(problem.free)))
    *_, end = weighed(loud)
    assert np.abs(loud.q).max() > 2.0  # standard deviations of the prior from the cell's own
    assert np.abs(end.q).max() < 1.0
    assert end.problem.rms_V(end.q, 0) < 1.1 * loud.problem.rms_V(loud.q, 0)
    assert taken_V(end.problem) == pytest.approx(end.problem.rms_V(end.q, 0), rel=0.1)
    found = next(conclusions(end.problem, end.q, tests))
    assert any("more than the 5 mV allowed" in r for r in found.remarks)


def test_tests_that_a_twin_follows_weigh_what_they_did() -> None:
    problem, tests = of_what_no_twin_has(**{"2C": wave(0.003)})
    *_, end = least_squares(problem, np.zeros(len(problem.free)))
    assert list(weighed(end)) == []
    found = next(conclusions(end.problem, end.q, tests))
    assert not any("mV allowed" in r for r in found.remarks)


def test_a_test_that_a_twin_misses_by_far_more_than_the_others_weighs_less_than_they_do() -> None:
    problem, tests = of_what_no_twin_has(
        **{"0.1C": wave(0.0), "pulses": wave(0.0), "2C": wave(0.03)}
    )  # fmt: skip
    *_, alike = least_squares(problem, np.zeros(len(problem.free)))
    *_, end = weighed(alike)
    assert taken_V(end.problem)[:2] == pytest.approx([MISSED_V, MISSED_V])
    own_V = end.problem.rms_V(end.q, 2)
    assert taken_V(end.problem)[2] == pytest.approx(own_V / MUCH, rel=0.15)
    assert of_cell(end).max() < 0.7 * of_cell(alike).max()
    found = next(conclusions(end.problem, end.q, tests))
    assert [r for r in found.remarks if "far more than the others" in r] == [
        "the twin misses 2C by far more than the others: beside them it counts for less"
    ]


def test_a_knee_that_comes_a_little_early_does_not_move_the_cell() -> None:
    """By the last half percent of the time, in which the voltage falls by half a volt more."""
    early: Missed = lambda share: -0.5 * np.exp((share - 1.0) / 0.002)  # noqa: E731
    problem, _ = of_what_no_twin_has(**{"0.1C": early})
    *_, end = least_squares(problem, np.zeros(len(problem.free)))
    assert of_cell(end).max() < 0.1


def test_temperatures_weigh_what_stretches_of_them_tell() -> None:
    (blank,) = empty_tests(cell_pack(), ("2C",))
    test = sampled(replace(blank, temperature_K=np.full(blank.time_s.size, 300.0)), 8000.0)
    assert test.sigma_K == READ_K
    assert test.at.size > STRETCHES
    weight = test.at.size / test.of_a_model(MISSED_V, STRETCHES).sigma_K ** 2
    assert weight == pytest.approx(STRETCHES / READ_K**2)


def test_residuals_of_temperatures_are_over_what_is_expected_of_them() -> None:
    (blank,) = empty_tests(cell_pack(), ("2C",))
    pack = replace(cell_pack(), effects=(SelfHeating(heat_transfer_W_m2_K=20.0),))
    test = replace(blank, temperature_K=np.full(blank.time_s.size, 310.0))
    problem = problem_of(pack, [test], only=("heat_capacity_J_K",))
    loose, q = of_a_model(problem), np.zeros(len(problem.free))
    n, share = problem.tests[0].at.size, loose.tests[0].sigma_K / READ_K
    assert share > 1.0
    both = zip(problem.linearised(q), loose.linearised(q), strict=True)
    for each_sample, in_stretches in both:
        assert in_stretches[-n:] == pytest.approx(each_sample[-n:] / share)
