"""What a fit ends with: what its tests do not tell is held at its prior, if it may be."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import NOISE_V, cell_pack, empty_tests
from twin.calibrate.run import problem_of
from twin.calibrate.settle import MINDED, Settled, held_back, least_squares

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
