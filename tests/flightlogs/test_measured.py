"""What a battery channel says is judged: what nothing can have measured is left out and counted."""

import numpy as np
import pytest

from flightlogs.errors import LogWarning
from flightlogs.log import BatteryLog
from flightlogs.measured import CELSIUS_K, RawBattery, battery_log

T = np.arange(0.0, 10.0, 0.1)


def judged(celsius: np.ndarray) -> tuple[BatteryLog, dict[str, LogWarning]]:
    """A battery in order but for its temperature (n,), and the warnings by code."""
    raw = RawBattery(
        label="battery 0",
        source="battery.current",
        time_s=T,
        current_A=10 + np.sin(T),
        voltage_V=16 - 0.02 * np.sin(T),
        temperature_K=celsius + CELSIUS_K,
    )
    battery, warnings = battery_log(raw, 0)
    return battery, {w.code: w for w in warnings}


@pytest.mark.parametrize("wrong", [2600.0, 32767.0, -CELSIUS_K, np.inf])
def test_a_temperature_no_pack_can_have_is_left_out_and_counted(wrong: float) -> None:
    battery, said = judged(np.where(T < 0.95, wrong, 26.0))
    np.testing.assert_allclose(battery.temperature_K, np.where(T < 0.95, np.nan, 299.15))
    assert said["impossible_values"].message.startswith("10 temperatures outside -60 to 120 degC")


def test_a_temperature_in_the_wrong_unit_throughout_is_none() -> None:
    battery, said = judged(np.full(T.size, 2600.0))
    assert battery.temperature_K is None
    assert list(said) == ["impossible_values"]


@pytest.mark.parametrize("celsius", [-20.0, 0.5, 85.0])
def test_a_cold_or_a_hot_pack_is_believed(celsius: float) -> None:
    battery, said = judged(np.full(T.size, celsius))
    np.testing.assert_allclose(battery.temperature_K, celsius + CELSIUS_K)
    assert not said


def test_zeros_before_the_first_answer_are_left_out_and_counted() -> None:
    battery, said = judged(np.where(T < 1.95, 0.0, 26.0 + T / 10))
    np.testing.assert_array_equal(np.isnan(battery.temperature_K), T < 1.95)
    assert said["temperature_not_measured"].message.startswith("20 samples of exactly 0 degC")


def test_a_pack_that_warms_through_zero_keeps_its_zeros() -> None:
    battery, said = judged(np.round((T - 5) / 2, 1))
    np.testing.assert_allclose(battery.temperature_K, np.round((T - 5) / 2, 1) + CELSIUS_K)
    assert not said


def test_zeros_beside_nothing_but_impossible_values_are_no_temperature() -> None:
    battery, said = judged(np.where(T < 1.95, 0.0, 2600.0))
    assert battery.temperature_K is None
    assert list(said) == ["impossible_values"]


def with_current(current_A: np.ndarray, voltage_V: np.ndarray) -> tuple[BatteryLog, list[str]]:
    raw = RawBattery(
        label="battery 0",
        source="battery.current",
        time_s=T,
        current_A=current_A,
        voltage_V=voltage_V,
    )
    battery, warnings = battery_log(raw, 0)
    return battery, [w.code for w in warnings]


DRAWN_A = 15 + 5 * np.sin(T)


@pytest.mark.parametrize("offset_A", [0.0, 12.0])  # positive at times, or never
def test_a_reversed_current_that_the_voltage_follows_is_turned_and_said(offset_A: float) -> None:
    battery, said = with_current(offset_A - DRAWN_A, 16 - 0.02 * DRAWN_A)
    np.testing.assert_allclose(battery.current_A, DRAWN_A - offset_A)
    assert said == ["current_sign_turned"]


@pytest.mark.parametrize(
    ("current_A", "voltage_V"),
    [
        (-DRAWN_A, 16 + 0.02 * DRAWN_A),  # charging: the more current, the more voltage
        (-DRAWN_A, 16 + 0 * T),  # nothing tells it from a zero that is off
        (-0.02 * DRAWN_A, 16 - 0.02 * DRAWN_A),
    ],
)
def test_a_negative_current_that_is_no_discharge_is_not_turned(
    current_A: np.ndarray, voltage_V: np.ndarray
) -> None:
    battery, said = with_current(current_A, voltage_V)
    assert battery.current_A is None
    assert "current_sign_turned" not in said
    assert "current_not_measured" in said


def test_a_regular_current_keeps_its_sign() -> None:
    battery, said = with_current(DRAWN_A, 16 - 0.02 * DRAWN_A)
    np.testing.assert_array_equal(battery.current_A, DRAWN_A)
    assert not said
