"""The sign of a current, by the voltage beside it: of tests, and where the clocks disagree."""

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import cell_pack
from tests.twin.mismatch.recordings import flown
from twin.load import Load
from twin.pack import Pack
from twin.sign import discharge_sign
from twin.simulate import simulate


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_voltage_tells_the_sign_of_the_current(sign: float) -> None:
    time_s = np.arange(7.0)
    pulse = np.array([0, 0, 2, 2, 2, 0, 0], dtype=float)
    voltage = np.array([4.1, 4.1, 4.0, 3.98, 3.97, 4.05, 4.06])
    assert discharge_sign(time_s, sign * pulse, voltage) == sign
    assert discharge_sign(time_s, np.full(7, sign), np.linspace(4.1, 3.9, 7)) == sign
    some = np.where(np.arange(7) == 3, np.nan, voltage)
    assert discharge_sign(time_s, sign * pulse, some) == sign


def test_where_nothing_answers_there_is_none() -> None:
    time_s = np.arange(5.0)
    assert discharge_sign(time_s, np.zeros(5), np.linspace(4.1, 3.9, 5)) == 0.0
    assert discharge_sign(time_s, np.ones(5), np.full(5, 3.7)) == 0.0
    assert discharge_sign(time_s, np.ones(5), np.full(5, np.nan)) == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("late", [-1, 0, 1])
def test_the_sign_is_told_though_the_voltage_is_read_a_row_late(sign: float, late: int) -> None:
    time_s = np.arange(0.0, 600.0, 1.0)
    current_A = np.where(time_s % 120 < 30, 4.4, 0.0)
    own = Pack(cell=cell_pack().cell, initial_soc=0.9)
    voltage_V = simulate(own, Load(time_s=time_s, current_A=current_A)).require().voltage_V
    read_V = np.interp(time_s - late, time_s, voltage_V)
    assert discharge_sign(time_s, sign * current_A, read_V) == sign
    flows = np.append(np.full(50, sign), 0.0)  # the last row has the voltage of before
    assert discharge_sign(np.arange(51.0), flows, np.linspace(4.1, 3.9, 51)) == sign


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("late", [0, 1, 7])
def test_the_sign_of_a_flight_is_seen_though_the_clocks_disagree(sign: float, late: int) -> None:
    own = flown(seed=1, seconds=60.0)
    voltage_V = np.roll(own.voltage_V, late)
    assert discharge_sign(own.time_s, sign * own.load.current_A, voltage_V) == sign


@pytest.mark.parametrize("late", [0, 2, 3, 4])
def test_the_sign_in_gusts_is_seen_though_the_voltage_comes_late(late: int) -> None:
    """By its jumps alone each of these flights was turned round at 0.3 and at 0.4 s."""
    for seed in range(10):
        white = np.random.default_rng(seed).standard_normal(1200)
        current_A = np.maximum(20.0 + 8.0 * np.convolve(white, np.ones(3) / 3**0.5, "same"), 0.0)
        drawn_C = 0.1 * np.cumsum(current_A)
        voltage_V = 16.4 - 0.02 * np.roll(current_A, late) - 2.5e-4 * drawn_C
        assert discharge_sign(0.1 * np.arange(1200.0), current_A, voltage_V) == 1.0
