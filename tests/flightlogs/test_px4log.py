"""sdlog2 files: framed as DataFlash, timed by the TIME records between the others."""

import io
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs.errors import LogDamaged, LogError, NotALog
from flightlogs.log import FlightLog, Interval, Vehicle
from flightlogs.px4log import read_px4log
from sample_logs.write_dataflash import Table, parameters, write_dataflash

BOOT_S, UNIX_S = 500.0, 1_434_000_000.0
T = np.arange(0.0, 30.0, 0.05)
CURRENT = 26.0 + 8.0 * np.sin(0.8 * T)
VOLTAGE = 23.0 - 0.02 * CURRENT
CHARGE_MAH = 1614.0 + 26.0 * T / 3.6
VELOCITY = np.column_stack([np.cos(T / 5), np.sin(T / 5), -0.5 * np.sin(T / 3)])
SINGLE = 2e-7
MODES = np.where(T < 5, 0, np.where(T < 20, 3, 1))  # manual, mission, altitude control


def record(name: str, format_: str, after_s: float = 0.001, **columns: np.ndarray) -> Table:
    """A message of every cycle, right behind its TIME record."""
    return Table(name=name, format=format_, columns=columns, order_s=T + after_s)


def flight(**battery: np.ndarray) -> list[Table]:
    zero = 0 * T
    logged = {"V": VOLTAGE, "VFilt": VOLTAGE, "C": CURRENT, "Discharged": CHARGE_MAH} | battery
    return [
        parameters({"MAV_TYPE": 14, "SYS_AUTOSTART": 12001, "BAT_N_CELLS": 6, "BAT_CAPACITY": -1}),
        record("TIME", "Q", 0.0, StartTime=(T + BOOT_S) * 1e6),
        record("BATT", "ffff", **logged),
        record("LPOS", "ffffff", X=zero, Y=zero, Z=-T, **vector(VELOCITY)),
        record("LPSP", "ffffff", X=zero, Y=zero, Z=-T, **vector(VELOCITY + 1)),
        record("STAT", "BBB", MainState=MODES, ArmS=np.where(T < 25, 2, 1), Landed=T < 2),
        record("GPS", "QB", GPSTime=(UNIX_S + T) * 1e6, Fix=zero + 3),
    ]


def vector(v: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(("VX", "VY", "VZ"), v.T, strict=True))


def encode(tables: list[Table]) -> bytes:
    out = io.BytesIO()
    write_dataflash(out, tables)
    return out.getvalue()


@cache
def whole() -> bytes:
    return encode(flight())


def read(data: bytes) -> FlightLog:
    return read_px4log(io.BytesIO(data), name="flight.px4log")


def test_gives_back_what_was_written() -> None:
    log = read(whole())
    (battery,) = log.batteries
    np.testing.assert_allclose(battery.time_s, T, atol=1e-6)
    np.testing.assert_allclose(battery.current_A, CURRENT, rtol=SINGLE)
    np.testing.assert_allclose(battery.voltage_V, VOLTAGE, rtol=SINGLE)
    np.testing.assert_allclose(battery.charge_C, CHARGE_MAH * 3.6, rtol=SINGLE)
    assert (battery.series, battery.capacity_C) == (6, None)
    np.testing.assert_allclose(log.velocity_m_s.values, VELOCITY, rtol=SINGLE, atol=1e-9)
    np.testing.assert_allclose(log.altitude_m.values, T, rtol=SINGLE)
    assert (log.duration_s, log.recovered_fraction) == (pytest.approx(T[-1]), 1.0)
    assert log.warnings == ()


def test_knows_who_flew_and_when() -> None:
    log = read(whole())
    assert (log.vehicle, log.simulated) == (Vehicle.MULTIROTOR, False)
    assert log.armed == (Interval(0.0, pytest.approx(25.0)),)
    assert log.in_air == (Interval(pytest.approx(2.0), pytest.approx(T[-1])),)
    assert [m.name for m in log.modes] == ["MANUAL", "AUTO_MISSION", "ALTCTL"]
    assert log.start_utc == datetime.fromtimestamp(UNIX_S, tz=UTC)


def test_setpoints_count_only_in_the_modes_that_follow_them() -> None:
    known = np.isfinite(read(whole()).velocity_setpoint_m_s.values)
    np.testing.assert_array_equal(known[:, 0], MODES == 3)
    np.testing.assert_array_equal(known[:, 2], MODES != 0)


def test_an_unknown_current_is_not_a_measurement() -> None:
    log = read(encode(flight(C=0 * T - 1, Discharged=0 * T - 1)))
    assert (log.batteries[0].current_A, log.batteries[0].charge_C) == (None, None)
    assert "current_not_measured" in [w.code for w in log.warnings]


def test_single_unknown_samples_are_nan() -> None:
    unknown = (T > 10) & (T < 11)
    (battery,) = read(encode(flight(C=np.where(unknown, -1, CURRENT)))).batteries
    np.testing.assert_array_equal(np.isnan(battery.current_A), unknown)


def test_without_time_records_nothing_can_be_placed() -> None:
    with pytest.raises(LogDamaged, match="TIME"):
        read(encode([t for t in flight() if t.name != "TIME"]))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, len(whole())))
def test_a_log_cut_anywhere_gives_its_beginning_or_says_why_not(size: int) -> None:
    full = read(whole()).batteries[0]
    try:
        log = read(whole()[:size])
    except LogError:
        assert size < 1_500
        return
    for battery in log.batteries:
        n = battery.time_s.size
        np.testing.assert_array_equal(battery.time_s, full.time_s[:n])
        np.testing.assert_array_equal(battery.voltage_V, full.voltage_V[:n])


def test_a_log_that_ends_inside_a_message_says_so() -> None:
    assert "log_truncated" in {w.code for w in read(whole()[:-1]).warnings}
    assert "log_truncated" not in {w.code for w in read(whole()).warnings}


def test_a_damaged_place_is_counted() -> None:
    at = whole().index(b"\xa3\x95", len(whole()) // 2)
    (said,) = (w.message for w in read(whole()[:at] + b"x" + whole()[at:]).warnings)
    assert said == f"damaged places: 1; 1 of {len(whole()) + 1} bytes (0.00%) could not be decoded"


@settings(max_examples=40, deadline=None)
@given(st.integers(1_000, len(whole()) - 600), st.binary(min_size=1, max_size=300))
def test_damage_raises_nothing_but_our_errors(at: int, noise: bytes) -> None:
    with suppress(LogError):
        read(whole()[:at] + noise + whole()[at + len(noise) // 2 :])


@pytest.mark.parametrize("data", [b"", b"hello\n" * 50, bytes(5000)])
def test_what_is_no_log_is_said_to_be_none(data: bytes) -> None:
    with pytest.raises(NotALog, match=r"flight\.px4log"):
        read(data)
