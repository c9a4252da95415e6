"""Public PX4 logs: what each is known to be, and what becomes of it."""

import io
import random
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from flightlogs.assemble import assemble
from flightlogs.errors import LogError, NotALog, Refusal
from flightlogs.log import FlightLog
from flightlogs.read import read_log
from flightlogs.resample import within

FLIGHTS = Path(__file__).parents[2] / ".." / "shared" / "flights"
pytestmark = pytest.mark.skipif(
    not FLIGHTS.is_dir(), reason="needs the public flight logs in ../shared/flights"
)


@dataclass(frozen=True, slots=True)
class Flown:
    """A log that is analysed, and what is known of it independently of this program."""

    path: str
    firmware: str
    duration_s: float
    in_air_s: float
    cells: int
    current_A: tuple[float, float, float]  # least, median in the air, most
    voltage_V: tuple[float, float]
    coulomb: float
    resistance_mohm: float
    warned: frozenset[str]


FLOWN = (
    Flown(
        "FSYR-H__PX4_Ulog_Tools/log_123_2024-3-1-14-47-02.ulg",
        "PX4 1.14.0",
        55.7,
        51.9,
        6,
        (0.50, 40.3, 69.8),
        (22.96, 24.82),
        1.002,
        21.0,
        frozenset({"capacity_unknown"}),
    ),
    Flown(
        "PX4__flight-review-rs/ekf_failure.ulg",
        "PX4 1.15.0-beta",
        79.6,
        74.1,
        6,
        (0.19, 8.4, 36.8),
        (22.96, 24.89),
        1.0004,
        43.0,
        frozenset({"capacity_unknown", "velocity_impossible"}),
    ),
    Flown(
        "AscendEngineering__UpgradeEnergy/test.ulg",
        "PX4 1.15.0-dev",
        33.0,
        28.5,
        6,
        (0.0, 4.5, 5.9),
        (22.36, 24.16),
        0.993,
        252.0,
        frozenset({"capacity_unknown", "current_scale_doubtful"}),
    ),
)
REFUSED = {
    "FSYR-H__PX4_Ulog_Tools/log_61_2024-2-6-16-27-02.ulg": "no_current",
    "PX4__flight-review-rs/battery_brownout.ulg": "no_battery",
    "roboto-ai__robologs-px4-actions/test.ulg": "too_short",
    "PX4__pyulog/sample_log_small.ulg": "vtol",
    "PX4__pyulog/sample_unordered.ulg": "no_flight",
    "PX4__pyulog/sample_appended_multiple.ulg": "no_flight",
    "Chainplain__PX4_ulog_2_xlsx/log_9_2024-10-14-15-00-06.ulg": "fixed_wing",
}


def read(path: str) -> FlightLog:
    with (FLIGHTS / path).open("rb") as stream:
        return read_log(stream, name=Path(path).name)


def codes(log: FlightLog) -> set[str]:
    return {w.code for w in log.warnings}


@pytest.mark.parametrize("flown", FLOWN, ids=lambda f: Path(f.path).stem)
def test_a_real_flight_gives_what_is_known_of_it(flown: Flown) -> None:
    log = read(flown.path)
    got = assemble(log)
    assert log.firmware == flown.firmware
    assert log.recovered_fraction == 1.0
    assert log.duration_s == pytest.approx(flown.duration_s, abs=0.1)
    in_air_s = sum(s.duration_s for s in log.in_air or ())
    assert in_air_s == pytest.approx(flown.in_air_s, abs=0.3)
    assert (got.series, got.series_inferred) == (flown.cells, False)
    flying = got.current_A[got.in_air]
    low, middle, high = flown.current_A
    assert got.current_A.min() == pytest.approx(low, abs=0.01)
    assert got.current_A.max() == pytest.approx(high, abs=0.1)
    assert np.median(got.current_A) == pytest.approx(middle, abs=0.5)
    assert np.median(flying) >= np.median(got.current_A) - 0.1
    assert np.nanmin(got.voltage_V) == pytest.approx(flown.voltage_V[0], abs=0.01)
    assert np.nanmax(got.voltage_V) == pytest.approx(flown.voltage_V[1], abs=0.01)
    assert got.coulomb_check == pytest.approx(flown.coulomb, abs=0.005)
    assert got.resistance_ohm is not None
    # The other figure was fitted to the whole flight at once, drift included.
    assert 1e3 * got.resistance_ohm == pytest.approx(flown.resistance_mohm, rel=0.15)
    assert {w.code for w in got.warnings} == flown.warned
    assert log.start_utc is not None


@pytest.mark.parametrize("path", REFUSED)
def test_what_cannot_be_analysed_is_refused_with_its_reason(path: str) -> None:
    log = read(path)
    with pytest.raises(Refusal) as caught:
        assemble(log)
    assert caught.value.code == REFUSED[path]
    assert str(caught.value).startswith(log.name)


def test_a_real_temperature_is_measured_and_the_others_are_none() -> None:
    for flown in FLOWN:
        kelvin = read(flown.path).batteries[0].temperature_K
        if "ekf_failure" in flown.path:
            assert kelvin is not None
            assert kelvin.min() == pytest.approx(273.15 + 10.1, abs=0.05)
            assert kelvin.max() == pytest.approx(273.15 + 11.9, abs=0.05)
        else:
            assert kelvin is None


def test_a_diverged_estimator_is_not_used_and_a_sound_one_is() -> None:
    assert assemble(read(FLOWN[1].path)).velocity_m_s is None
    for flown in (FLOWN[0], FLOWN[2]):
        assert assemble(read(flown.path)).velocity_m_s is not None


def test_horizontal_setpoints_are_unknown_in_altitude_mode() -> None:
    log = read(FLOWN[0].path)
    assert [m.name for m in log.modes] == ["STAB", "ALTCTL"]
    assert log.velocity_setpoint_m_s is not None
    assert np.isnan(log.velocity_setpoint_m_s.values[1:, :2]).all()  # after the switch
    assert np.isfinite(log.velocity_setpoint_m_s.values[:, 2]).mean() > 0.9


def test_two_packs_are_two_batteries() -> None:
    log = read("PX4__pyulog/sample_log_small.ulg")
    assert [b.series for b in log.batteries] == [6, 12]
    assert [b.capacity_C for b in log.batteries] == [30 * 3600, 6 * 3600]
    assert log.duration_s == pytest.approx(6.6, abs=0.1)  # not the 1194 s of a stray record


def test_stamps_that_go_back_and_appended_data_are_counted() -> None:
    unordered = read("PX4__pyulog/sample_unordered.ulg")
    assert codes(unordered) == {"log_dropouts", "stray_stamps"}
    assert unordered.dropouts_s == pytest.approx(0.119, abs=1e-6)
    assert unordered.duration_s == pytest.approx(69.0, abs=0.1)
    appended = read("PX4__pyulog/sample_appended_multiple.ulg")
    assert "log_appended_data" in codes(appended)
    assert appended.recovered_fraction == 1.0


def test_a_pointer_to_a_log_is_no_log() -> None:
    with pytest.raises(NotALog, match="git lfs pull"):
        read("foxglove__ulog/truncated.ulg")


@pytest.mark.parametrize("path", [f.path for f in FLOWN] + list(REFUSED))
def test_a_damaged_real_log_is_an_error_of_ours_or_a_recording(path: str) -> None:
    content = (FLIGHTS / path).read_bytes()
    rng = random.Random(path)  # the same damage in every run
    for size in (1, 30, 3000):
        damaged = bytearray(content)
        for _ in range(8):
            at = rng.randrange(len(damaged))
            damaged[at : at + size] = rng.randbytes(size)
        del damaged[rng.randrange(len(damaged) // 2, len(damaged)) :]
        try:
            log = read_log(io.BytesIO(bytes(damaged)), name="damaged")
            got = assemble(log)
        except LogError:
            continue
        assert got.time_s[-1] <= log.duration_s
        assert within(got.time_s, (got.flight,)).sum() >= 10
