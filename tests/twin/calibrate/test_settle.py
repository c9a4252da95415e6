"""What a fit ends with.

Tests weigh as much as the twin misses them, what they do not tell is held at its prior if it may.
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import NOISE_V, cell_pack, empty_tests
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import READ_K, sampled
from twin.calibrate.run import conclusions, problem_of
from twin.calibrate.settle import (
    MINDED,
    MISSED_V,
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


def of_what_no_twin_has(wave_V: float) -> tuple[Problem, ReferenceTest]:
    """A fast discharge of the cell that the fit starts from, and a wave that no parameter makes."""
    only = ("capacity_C", TOLD, "positive.particle_radius_m", "electrolyte.diffusivity_factor")
    (blank,) = empty_tests(cell_pack(), ("2C",))
    problem = problem_of(cell_pack(), [blank], only=only)
    voltage_V = problem.replayed(np.zeros(len(problem.free)), blank, float(blank.voltage_V[0]))
    n = int(np.isfinite(voltage_V).sum())
    wave_V *= np.sin(4 * np.pi * blank.time_s[:n] / blank.time_s[n - 1])
    test = replace(
        blank, time_s=blank.time_s[:n], current_A=blank.current_A[:n],
        voltage_V=voltage_V[:n] + wave_V,
    )  # fmt: skip
    return of_a_model(problem_of(cell_pack(), [test], only=only)), test


def test_tests_that_a_twin_misses_much_weigh_less() -> None:
    problem, test = of_what_no_twin_has(0.03)
    *_, loud = least_squares(problem, np.zeros(len(problem.free)))
    *_, end = weighed(loud)
    assert np.abs(loud.q).max() > 2.0  # standard deviations of the prior from the cell's own
    assert np.abs(end.q).max() < 1.0
    assert end.problem.rms_V(end.q, 0) < 1.1 * loud.problem.rms_V(loud.q, 0)
    assert taken_V(end.problem) == pytest.approx(end.problem.rms_V(end.q, 0), rel=0.1)
    found = next(conclusions(end.problem, end.q, [test]))
    assert any("more than the 5 mV that one may" in r for r in found.remarks)


def test_tests_that_a_twin_follows_weigh_what_they_did() -> None:
    problem, test = of_what_no_twin_has(0.003)
    *_, end = least_squares(problem, np.zeros(len(problem.free)))
    assert list(weighed(end)) == []
    found = next(conclusions(end.problem, end.q, [test]))
    assert not any("that one may" in r for r in found.remarks)


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
