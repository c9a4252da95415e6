"""How cold the autopilot's barometer was, in each format."""

from pathlib import Path

import numpy as np
import pytest

from flightlogs.board import coldest_K
from flightlogs.read import read_log

FLIGHTS = Path(__file__).parents[2] / ".." / "shared" / "flights"


@pytest.mark.parametrize(
    ("celsius", "expected"),
    [
        (None, None),
        ([0.0, np.nan], None),  # no answer
        ([31.0, 26.5, 0.0, np.nan], 299.65),
        ([-5.0, 300.0, -200.0], 268.15),  # none that a sensor can have
    ],
)
def test_the_coldest_that_a_sensor_can_have(
    celsius: list[float] | None, expected: float | None
) -> None:
    found = coldest_K(None if celsius is None else np.array(celsius))
    assert found == (None if expected is None else pytest.approx(expected))


@pytest.mark.skipif(not FLIGHTS.is_dir(), reason="needs the public logs in ../shared/flights")
@pytest.mark.parametrize(
    ("path", "celsius"),
    [
        ("dronekit__dronekit-la-testdata/log171.bin", 26.44),
        ("FSYR-H__PX4_Ulog_Tools/log_123_2024-3-1-14-47-02.ulg", 22.7),
        ("ahmadkhanfar__TLOG/test.tlog", 25.46),
        ("1002victor__ardupilot/underpowered.log", None),
    ],
)
def test_real_logs_say_it(path: str, celsius: float | None) -> None:
    with (FLIGHTS / path).open("rb") as stream:
        found = read_log(stream, name=path).board_K
    assert found == (None if celsius is None else pytest.approx(celsius + 273.15, abs=0.01))
