"""Real ArduPilot, telemetry and sdlog2 logs against what their catalogue says of them.

The numbers are the catalogue's own (duration, range of current and voltage, charge), each with the
tolerance of its printed digits; the catalogue counts as in the air what has throttle or current,
the reader what the autopilot says, hence the wider bound there.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from pymavlink import mavutil

from flightlogs.dataflash import WANTED, read_dataflash
from flightlogs.dataflash_binary import read_binary
from flightlogs.log import BatteryLog, FlightLog, Vehicle
from flightlogs.px4log import read_px4log
from flightlogs.tlog import read_tlog

FLIGHTS = Path(__file__).parents[2] / ".." / "shared" / "flights"
pytestmark = pytest.mark.skipif(not FLIGHTS.is_dir(), reason="the real logs are not here")
READERS = {".px4log": read_px4log, ".tlog": read_tlog}
AIR_S = 12.0
DIGITS = 0.0051


@dataclass(frozen=True, kw_only=True)
class Said:
    """What the catalogue says of a file; None where it says nothing."""

    path: str
    firmware: str
    vehicle: Vehicle = Vehicle.MULTIROTOR
    duration_s: float | None = None
    air_s: float | None = None
    current_A: tuple[float, float] | None = None
    current_digit: float = DIGITS
    voltage_V: tuple[float, float] | None = None
    coulomb: float | None = None
    velocity: str | None = None
    codes: set[str] = field(default_factory=set)


CATALOGUE = [
    Said(
        path="dronecrew__px4tools/01_07_59.px4log",
        firmware="PX4 git 44d2c4a1",
        duration_s=70.5,
        air_s=67.2,
        current_A=(0.33, 50.8),
        current_digit=0.051,
        voltage_V=(18.33, 24.31),
        coulomb=1.0,
        velocity="LPOS.VX,VY,VZ",
    ),
    Said(
        path="BeastAyyG__ardupilot-log-diagnosis/log_0036_mechanical_failure.bin",
        firmware="ArduCopter V3.4.4-rc1",
        air_s=139.9,
        current_A=(0, 21.27),
        voltage_V=(15.40, 16.70),
        coulomb=0.9999,
        velocity="NKF1.VN,VE,VD",
    ),
    Said(
        path="BeastAyyG__ardupilot-log-diagnosis/log_0039_mechanical_failure.bin",
        firmware="ArduCopter V3.4.6",
        air_s=84.5,
        current_A=(0.18, 55.21),
        voltage_V=(10.48, 12.53),
        coulomb=0.9999,
        velocity="NKF1.VN,VE,VD",
    ),
    Said(
        path="dronekit__dronekit-la-testdata/log171.bin",
        firmware="ArduCopter V3.3-dev",
        duration_s=242.0,
        air_s=170.0,
        current_A=(0.52, 27.44),
        voltage_V=(14.91, 16.54),
        coulomb=0.941,
        velocity="EKF1.VN,VE,VD",
    ),
    Said(
        path="1002victor__ardupilot/underpowered.log",
        firmware="ArduCopter V3.0.1",
        duration_s=430.0,
        air_s=379.0,
        current_A=(0, 32.40),
        voltage_V=(8.94, 12.13),
        coulomb=0.998,
        velocity="CTUN.CRate",
        codes={"time_base_reconstructed", "in_air_inferred", "velocity_vertical_only"},
    ),
    Said(
        path="diaven__ardupilot-LogAnalyzer/sample02.bin",
        firmware="ArduCopter V4.0.2",
        duration_s=196.0,
        air_s=54.8,
        current_A=(0.33, 14.71),
        voltage_V=(13.21, 15.39),
        coulomb=0.9999,
        velocity="GPS.Spd,GCrs,VZ",
    ),
    Said(
        path="erlerobot__logs/MS5611_SPI.BIN",
        firmware="ArduCopter V3.4-dev",
        air_s=116.5,
        current_A=(0.28, 3.0),
        voltage_V=(10.84, 12.17),
        velocity="EKF1.VN,VE,VD",
    ),
    Said(
        path="erlerobot__logs/Erle-Brain3.BIN",
        firmware="ArduCopter V3.4-rc2",
        air_s=250.9,
        voltage_V=(5.93, 6.05),
        velocity="NKF1.VN,VE,VD",
        codes={"current_not_measured", "voltage_doubtful"},
    ),
    Said(
        path="erlerobot__logs/25.BIN",
        firmware="ArduCopter V3.3-dev",
        velocity="EKF1.VN,VE,VD",
        codes={"current_not_measured", "voltage_not_measured"},
    ),
    Said(
        path="1002victor__ardupilot/tradheli_brownout.log",
        firmware="ArduCopter V3.0.1",
        vehicle=Vehicle.HELICOPTER,
        voltage_V=(11.24, 12.40),
        velocity="GPS.Spd,GCrs; CTUN.CRate",
        codes={"time_base_reconstructed", "current_not_measured"},
    ),
    Said(
        path="1002victor__ardupilot/nan.log",
        firmware="ArduCopter V3.1.1",
        air_s=5.4,
        current_A=(0.5, 7.74),
        current_digit=0.051,
        voltage_V=(15.16, 15.34),
        coulomb=1.18,
        velocity="GPS.Spd,GCrs,VZ",
    ),
    Said(
        path="mbiuki__Phoenix/2018-09-25_15-36-53.tlog",
        firmware="ArduCopter V3.5.7",
        duration_s=1393.8,
        velocity="LOCAL_POSITION_NED.vx,vy,vz",
        codes={"current_not_measured", "voltage_not_measured", "in_air_inferred"},
    ),
    Said(
        path="jschall__magfit_scaling/test.tlog",
        firmware="ArduCopter V3.2-dev",
        air_s=0.0,
        codes={"current_not_measured", "voltage_not_measured"},
    ),
    Said(
        path="ahmadkhanfar__TLOG/test.tlog",
        firmware="ArduCopter V4.5.5",
        current_A=(0, 34.33),
        voltage_V=(12.6, 12.6),
        velocity="LOCAL_POSITION_NED.vx,vy,vz",
        codes={"in_air_inferred"},
    ),
]
BY_PATH = pytest.mark.parametrize("said", CATALOGUE, ids=lambda said: said.path)


def read(path: str) -> FlightLog:
    file = FLIGHTS / path
    if not file.is_file():
        pytest.skip(f"{path} is not here")
    with file.open("rb") as stream:
        return READERS.get(file.suffix, read_dataflash)(stream, name=file.name)


def span(values: np.ndarray | None) -> tuple[float, float] | None:
    return None if values is None else (float(np.nanmin(values)), float(np.nanmax(values)))


def coulomb(battery: BatteryLog) -> float:
    charge_C = battery.charge_C
    return float(np.trapezoid(battery.current_A, battery.time_s) / (charge_C[-1] - charge_C[0]))


@BY_PATH
def test_the_battery_is_what_the_catalogue_says(said: Said) -> None:
    (battery,) = read(said.path).batteries
    for mine, theirs, digit in (
        (span(battery.current_A), said.current_A, said.current_digit),
        (span(battery.voltage_V), said.voltage_V, DIGITS),
    ):
        assert (mine is None) == (theirs is None)
        assert mine is None or mine == pytest.approx(theirs, abs=digit)
    if said.coulomb is not None:
        assert coulomb(battery) == pytest.approx(said.coulomb, abs=DIGITS)
    assert battery.temperature_K is None


@BY_PATH
def test_the_flight_is_what_the_catalogue_says(said: Said) -> None:
    log = read(said.path)
    assert (log.firmware, log.vehicle) == (said.firmware, said.vehicle)
    assert log.simulated == said.path.startswith("ahmadkhanfar")
    if said.duration_s is not None:
        assert log.duration_s == pytest.approx(said.duration_s, abs=1.0)
    if said.air_s is not None:
        assert sum(s.duration_s for s in log.in_air) == pytest.approx(said.air_s, abs=AIR_S)
    if said.velocity is not None:
        assert log.velocity_m_s.source == said.velocity
    assert said.codes <= {w.code for w in log.warnings}
    assert log.recovered_fraction > 0.9999


def test_the_armed_time_of_six_flights_in_one_file_is_found() -> None:
    log = read("mbiuki__Phoenix/2018-09-25_15-36-53.tlog")
    assert len(log.armed) == 6
    assert sum(a.duration_s for a in log.armed) == pytest.approx(7.2 * 60, abs=3)


def test_a_second_flight_after_a_pause_of_four_seconds_is_one_of_its_own() -> None:
    log = read("erlerobot__logs/MS5611_SPI.BIN")
    armed = [(round(a.start_s), round(a.stop_s)) for a in log.armed]
    assert armed == [(1, 45), (55, 78), (82, 85), (226, 294), (299, 362)]


def test_unphysical_velocities_are_left_for_the_choice_of_channels() -> None:
    assert np.max(np.abs(read("erlerobot__logs/25.BIN").velocity_m_s.values)) > 400


def test_a_fall_at_the_end_is_seen() -> None:
    down = read("dronekit__dronekit-la-testdata/log171.bin").velocity_m_s.values[:, 2]
    assert down.max() == pytest.approx(13, abs=0.5)


@pytest.mark.parametrize(
    "path",
    [s.path for s in CATALOGUE if s.path.lower().endswith(".bin")][:3],
)
def test_columns_agree_with_pymavlinks_reader(path: str) -> None:
    if not (FLIGHTS / path).is_file():
        pytest.skip(f"{path} is not here")
    raw = read_binary((FLIGHTS / path).read_bytes(), wanted=WANTED, clocks=frozenset())
    names = ["BAT", "CURR", "CTUN", "NKF1", "EKF1", "GPS", "PSC"]
    theirs = mavutil.mavlink_connection(str(FLIGHTS / path))
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in names}
    while (message := theirs.recv_match(type=names)) is not None:
        rows[message.get_type()].append(message.to_dict())
    theirs.filehandle.close()
    for name in (n for n in names if rows[n]):
        for label, values in raw.tables[name].numbers.items():
            np.testing.assert_array_equal(values, [row[label] for row in rows[name]])
