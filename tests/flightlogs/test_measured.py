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
