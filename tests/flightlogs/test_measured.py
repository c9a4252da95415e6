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
