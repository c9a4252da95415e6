"""Where a recording asks for more than the tests of a calibration did."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from twin.calibrate.asked import Asked, asked_by, asked_from, beyond, most_A
from twin.constants import ZERO_CELSIUS_K
from twin.load import Between, Load


def steady(current_A: float, lasts_s: float, celsius: float = 25.0) -> Load:
    return Load(time_s=np.array([0.0, lasts_s]), current_A=np.full(2, current_A),
                ambient_K=celsius + ZERO_CELSIUS_K)  # fmt: skip


PULSE = Load(time_s=np.array([0.0, 50.0, 55.0, 300.0]), current_A=np.array([0.0, 10.0, 0.0, 0.0]),
             between=Between.HOLD)  # fmt: skip


@pytest.mark.parametrize(
    ("load", "window_s", "mean_A"),
    [
        (steady(3.0, 1200.0), 10.0, 3.0),
        (steady(3.0, 300.0), 600.0, 1.5),  # nothing flows after it
        (PULSE, 10.0, 5.0),
        (PULSE, 600.0, 50.0 / 600.0),
        (steady(-3.0, 1200.0), 10.0, 0.0),  # a charge is no discharge
        (Load(time_s=np.zeros(1), current_A=np.ones(1)), 10.0, 0.0),
    ],
)
def test_the_largest_mean_over_a_while(load: Load, window_s: float, mean_A: float) -> None:
    assert most_A(load, window_s) == pytest.approx(mean_A)


def test_what_tests_asked_is_read_as_it_was_written() -> None:
    own = asked_by([steady(1.0, 3600.0), PULSE, steady(0.5, 3600.0, celsius=10.0)])
    assert own == Asked((5.0, 1.0), 10.0 + ZERO_CELSIUS_K, 298.15)
    assert asked_from(json.loads(json.dumps(asdict(own)))) == own
    with pytest.raises(ValueError, match="1 currents of 2"):
        asked_from({"most_A": [1.0], "coldest_K": 280.0, "warmest_K": 300.0})


@pytest.mark.parametrize(
    ("load", "parallel", "celsius", "said"),
    [
        (steady(2.4, 600.0), 2, 25.0, ""),
        (steady(2.6, 600.0), 2, 25.0, "1.3 A a cell over 600 s (tests: 1 A)."),
        (steady(13.0, 20.0), 2, 25.0, "6.5 A a cell over 10 s (tests: 5 A)."),
        (steady(1.0, 600.0), 1, 2.5, ""),
        (steady(1.0, 600.0), 1, 1.0, "a start at 1 °C (tests: 10 to 25 °C)."),
        (steady(1.0, 600.0), 1, 34.0, "a start at 34 °C (tests: 10 to 25 °C)."),
        (steady(2.0, 600.0), 1, 40.0, "2 A a cell over 600 s (tests: 1 A), a start at 40 °C"),
    ],
)
def test_what_goes_beyond_them_is_said(
    load: Load, parallel: int, celsius: float, said: str
) -> None:
    tests = Asked((5.0, 1.0), 10.0 + ZERO_CELSIUS_K, 298.15)
    text = beyond(tests, load, parallel=parallel, initial_K=celsius + ZERO_CELSIUS_K)
    assert said in text
    assert bool(text) == bool(said)
