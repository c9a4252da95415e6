"""Lines that a logger repeated are no samples; a steady discharge has none, however rounded."""

import numpy as np
import pytest

from twin.load_csv import LoadTable
from twin.renewed import renewed

N = 600


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(5)


def table(current_A: np.ndarray, voltage_V: np.ndarray, step_s: float = 0.5) -> LoadTable:
    time_s = step_s * np.arange(current_A.size)
    return LoadTable(time_s=time_s, current_A=current_A, voltage_V=voltage_V)


def flight(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    current_A = random.normal(10.0, 2.0, N)
    return current_A, 16.0 - 0.02 * current_A + random.normal(0.0, 5e-3, N)


@pytest.mark.parametrize("step_V", [1e-3, 0.025])
def test_a_telemetry_slower_than_its_log(random: np.random.Generator, step_V: float) -> None:
    current_A, voltage_V = flight(random)
    held = np.repeat(np.arange(N // 2), 2)
    own = table(current_A[held], np.round(voltage_V[held] / step_V) * step_V)
    kept = renewed(own)
    assert np.array_equal(kept.time_s, own.time_s[::2])
    assert kept.remarks == (
        "Lines that repeat current and voltage of the one before: 300 of 600; they were left out.",
    )


def test_a_rest_keeps_its_lines_and_the_charge_its_sum(random: np.random.Generator) -> None:
    current_A, voltage_V = flight(random)
    held = np.repeat(np.arange(N // 2), 2)
    current_A, voltage_V = current_A[held], voltage_V[held]
    rest = np.r_[0 : N // 4, N - N // 4 : N]
    current_A[rest], voltage_V[rest] = 0.0, 16.2
    own = table(current_A, voltage_V)
    kept = renewed(own)
    assert np.isin(own.time_s[rest], kept.time_s).all()
    charge_C = [np.trapezoid(of.current_A, of.time_s) for of in (own, kept)]
    assert charge_C[1] == pytest.approx(charge_C[0], rel=0.01)


@pytest.mark.parametrize(("step_A", "step_V"), [(0.01, 1e-3), (0.5, 0.025), (2.0, 0.1)])
def test_rounding_repeats_a_line_now_and_then(
    random: np.random.Generator, step_A: float, step_V: float
) -> None:
    current_A, voltage_V = flight(random)
    own = table(np.round(current_A / step_A) * step_A, np.round(voltage_V / step_V) * step_V)
    assert renewed(own) is own


def test_a_steady_discharge_of_a_cycler_stays(random: np.random.Generator) -> None:
    voltage_V = np.round(np.linspace(4.1, 3.4, N) + random.normal(0.0, 1e-4, N), 2)
    steady = table(np.full(N, 3.0), voltage_V, step_s=5.0)
    assert renewed(steady) is steady
    pulses = table(np.where(np.arange(N) % 60 < 10, 6.0, 3.0), voltage_V, step_s=5.0)
    assert renewed(pulses) is pulses
