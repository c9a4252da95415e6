"""Telemetry packed by pymavlink's own dialect, whole and broken on purpose."""

import io
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from flightlogs.errors import LogDamaged, LogError, NotALog
from flightlogs.log import FlightLog, Interval, Vehicle
from flightlogs.tlog import read_tlog
from flightlogs.tlog_battery import pack_voltage
from flightlogs.tlog_packets import read_packets, stop_of
from sample_logs import write_tlog as w
from sample_logs.pack_trace import PackTrace

UNIX_S = 1_700_000_000.0
T = np.arange(0.0, 40.0, 0.2)
CURRENT = 15.0 + 5.0 * np.sin(0.9 * T)
VOLTAGE = 15.0 - 0.02 * CURRENT
CHARGE = 15.0 * T
PACK = PackTrace(time_s=T, voltage_V=VOLTAGE, current_A=CURRENT, charge_C=CHARGE)
VELOCITY = np.column_stack([np.cos(T / 5), np.sin(T / 5), -0.5 * np.sin(T / 3)])
POSITION = np.column_stack([T, -T, -5 - T / 10])
COUNT_A, COUNT_V, COUNT_C = 0.0051, 0.00051, 1.81  # half of what one count of the message is worth
ARMED = (T >= 2) & (T < 38)
NEVER = np.zeros(T.size, dtype=bool)
ALTCTL, POSCTL, MISSION = 2 << 16, 3 << 16, 4 << 16 | 4 << 24
ANY = np.random.default_rng(3)


def flight(pack: PackTrace = PACK) -> list[w.Stream]:
    modes = np.where(T < 20, POSCTL, MISSION)
    wanted = np.where(T[:, None] < 10, np.nan, VELOCITY)
    return [
        w.heartbeat(T, ARMED, modes),
        w.extended_state(T, np.where((T >= 5) & (T < 35), 2, 1)),
        w.battery_status(pack),
        w.sys_status(T, VOLTAGE + 1, CURRENT + 1),
        w.local_position(T, POSITION, VELOCITY),
        w.velocity_target(T, wanted),
        w.parameter(0.0, "BAT1_CAPACITY", 2200.0),
    ]


def encode(streams: list[w.Stream]) -> bytes:
    out = io.BytesIO()
    w.write_tlog(out, streams, start_unix_s=UNIX_S)
    return out.getvalue()


@cache
def whole() -> bytes:
    return encode(flight())


def read(data: bytes) -> FlightLog:
    return read_tlog(io.BytesIO(data), name="flight.tlog")


def codes(log: FlightLog) -> set[str]:
    return {warning.code for warning in log.warnings}


def without(*messages: str) -> list[w.Stream]:
    return [s for s in flight() if s.message not in messages]


def test_gives_back_what_was_written() -> None:
    log = read(whole())
    (battery,) = log.batteries
    assert battery.label == "BATTERY_STATUS[0]"  # preferred to SYS_STATUS
    np.testing.assert_allclose(battery.time_s, T, atol=1e-6)
    np.testing.assert_allclose(battery.current_A, CURRENT, atol=COUNT_A)
    np.testing.assert_allclose(battery.voltage_V, VOLTAGE, atol=COUNT_V)
    np.testing.assert_allclose(battery.charge_C, CHARGE, atol=COUNT_C)
    assert (battery.temperature_K, battery.cell_voltage_V, battery.series) == (None, None, None)
    assert battery.capacity_C == pytest.approx(2200 * 3.6)
    np.testing.assert_allclose(log.velocity_m_s.values, VELOCITY, rtol=2e-7, atol=1e-9)
    np.testing.assert_allclose(log.altitude_m.values, T / 10, atol=1e-6)
    assert (log.duration_s, log.recovered_fraction) == (pytest.approx(T[-1]), 1.0)
    assert log.warnings == ()


def test_knows_who_flew_and_when() -> None:
    log = read(whole())
    assert (log.firmware, log.vehicle, log.simulated) == ("PX4", Vehicle.MULTIROTOR, False)
    assert log.armed == (Interval(pytest.approx(2.0), pytest.approx(38.0)),)
    assert log.in_air == (Interval(pytest.approx(5.0), pytest.approx(35.0)),)
    assert [m.name for m in log.modes] == ["POSCTL", "AUTO_MISSION"]
    assert log.start_utc == datetime.fromtimestamp(UNIX_S, tz=UTC)


def test_the_type_mask_blanks_what_is_not_commanded() -> None:
    setpoint = read(whole()).velocity_setpoint_m_s
    np.testing.assert_array_equal(np.isnan(setpoint.values).all(axis=1), setpoint.time_s < 9.99)
    commanded = setpoint.time_s >= 10
    np.testing.assert_allclose(setpoint.values[commanded], VELOCITY[T >= 10], rtol=2e-7, atol=1e-9)
    assert read(whole()).position_setpoint_m is None  # masked throughout


def test_unknown_current_and_voltage_are_nan_and_a_known_temperature_is_kept() -> None:
    unknown = (T > 10) & (T < 12)
    pack = replace(
        PACK,
        current_A=np.where(unknown, np.nan, CURRENT),
        voltage_V=np.where(unknown, np.nan, VOLTAGE),
        temperature_K=300 + T / 10,
    )
    (battery,) = read(encode(flight(pack))).batteries
    np.testing.assert_array_equal(np.isnan(battery.current_A), unknown)
    np.testing.assert_array_equal(np.isnan(battery.voltage_V), unknown)
    np.testing.assert_allclose(battery.temperature_K, 300 + T / 10, atol=COUNT_A)


@pytest.mark.parametrize("volts", [12.6, 65.533, 65.535, 70.0, 140.0])
def test_a_total_voltage_of_any_size_survives_its_split(volts: float) -> None:
    (battery,) = read(encode(flight(replace(PACK, voltage_V=volts + 0 * T)))).batteries
    np.testing.assert_allclose(battery.voltage_V, volts, atol=COUNT_V)
    assert battery.cell_voltage_V is None


def test_cells_are_told_from_a_total() -> None:
    cells = VOLTAGE[:, None] / 4 + np.array([-0.03, -0.01, 0.01, 0.03])
    (battery,) = read(encode(flight(replace(PACK, cell_voltage_V=cells)))).batteries
    assert battery.series == 4
    np.testing.assert_allclose(battery.cell_voltage_V, cells, atol=COUNT_V)
    np.testing.assert_allclose(battery.voltage_V, VOLTAGE, atol=4 * COUNT_V)


def test_a_total_divided_evenly_gives_the_number_of_cells_but_no_cells() -> None:
    sent = np.full((5, 10), 65535.0)
    sent[:, :6] = 3900 - np.arange(5)[:, None]
    total, cells, series = pack_voltage(sent, np.zeros((5, 4)))
    np.testing.assert_allclose(total, 6 * (3.9 - np.arange(5) / 1e3))
    assert (cells, series) == (None, 6)


def test_cells_eleven_to_fourteen_count() -> None:
    sent = np.tile(np.linspace(3700, 3790, 10), (3, 1))
    extra = np.tile([3800.0, 3810.0, 0.0, 0.0], (3, 1))
    total, cells, series = pack_voltage(sent, extra)
    assert (series, cells.shape) == (12, (3, 12))
    np.testing.assert_allclose(total, (sent[0].sum() + extra[0].sum()) / 1e3)


def test_sys_status_serves_where_battery_status_has_no_current() -> None:
    for log in (
        read(encode(without("BATTERY_STATUS"))),
        read(
            encode(
                [*without("BATTERY_STATUS"), w.battery_status(replace(PACK, current_A=np.nan * T))]
            )
        ),
    ):
        (battery,) = log.batteries
        assert battery.label == "SYS_STATUS"
        np.testing.assert_allclose(battery.current_A, CURRENT + 1, atol=COUNT_A)
        np.testing.assert_allclose(battery.voltage_V, VOLTAGE + 1, atol=COUNT_V)


def test_a_current_beyond_what_mavlink_carries_is_counted_and_said() -> None:
    peak = replace(PACK, current_A=np.where(np.isin(np.arange(T.size), [40, 41]), 327.67, CURRENT))
    status = w.sys_status(T, VOLTAGE, peak.current_A)
    for stream in (w.battery_status(peak), status):
        log = read(encode([*without("BATTERY_STATUS", "SYS_STATUS"), stream]))
        (said,) = (w.message for w in log.warnings if w.code == "current_saturated")
        assert said.startswith("2 samples stand at the most that this log can carry")
        np.testing.assert_array_equal(np.isnan(log.batteries[0].current_A), peak.current_A > 300)


def test_a_vehicle_without_a_battery_monitor_measures_nothing() -> None:
    dead = w.sys_status(T, 0 * T, 0 * T - 0.01)
    log = read(encode([*without("BATTERY_STATUS", "SYS_STATUS"), dead]))
    assert (log.batteries[0].current_A, log.batteries[0].voltage_V) == (None, None)
    assert {"current_not_measured", "voltage_not_measured"} <= codes(log)


def test_batteries_are_told_by_their_id() -> None:
    second = w.battery_status(replace(PACK, current_A=CURRENT / 3), battery_id=1)
    log = read(encode([*flight(), second]))
    assert [b.label for b in log.batteries] == ["BATTERY_STATUS[0]", "BATTERY_STATUS[1]"]
    np.testing.assert_allclose(log.batteries[1].current_A, CURRENT / 3, atol=COUNT_A)


def test_the_ground_station_is_no_vehicle() -> None:
    station = replace(w.heartbeat(T, NEVER, 0, autopilot=8, vehicle=6), system=255)
    bystander = replace(w.heartbeat(T, NEVER, 0), system=2)
    assert read(encode([station, *flight()])).vehicle is Vehicle.MULTIROTOR
    log = read(encode([station, bystander, *flight()]))
    assert "several_vehicles" in codes(log)
    assert len(log.armed) == 1  # of the one that flew
    with pytest.raises(LogDamaged, match="heartbeat"):
        read(encode([station]))


@pytest.mark.parametrize(
    ("autopilot", "vehicle", "custom", "name", "kind"),
    [
        (12, 2, ALTCTL, "ALTCTL", Vehicle.MULTIROTOR),
        (12, 14, MISSION, "AUTO_MISSION", Vehicle.MULTIROTOR),
        (12, 22, POSCTL, "POSCTL", Vehicle.VTOL),
        (3, 2, 5, "LOITER", Vehicle.MULTIROTOR),
        (3, 13, 16, "POSHOLD", Vehicle.MULTIROTOR),
        (3, 4, 2, "ALT_HOLD", Vehicle.HELICOPTER),
        (3, 1, 10, "AUTO", Vehicle.FIXED_WING),
        (3, 10, 3, "STEERING", Vehicle.OTHER),
    ],
)
def test_modes_and_airframes_have_their_autopilots_names(
    autopilot: int, vehicle: int, custom: int, name: str, kind: Vehicle
) -> None:
    beat = w.heartbeat(T, ARMED, custom, autopilot=autopilot, vehicle=vehicle)
    log = read(encode([beat, *without("HEARTBEAT")]))
    assert [m.name for m in log.modes] == [name]
    assert log.vehicle is kind


def test_throttle_tells_the_flight_where_no_landed_state_is_sent() -> None:
    throttle = np.where((T > 8) & (T < 30), 45, 10)
    hud = dict.fromkeys(["airspeed", "groundspeed", "alt", "climb"], 0.0)
    stream = w.Stream(
        message="VFR_HUD", time_s=T, fields=hud | {"heading": 0, "throttle": throttle}
    )
    log = read(encode([*without("EXTENDED_SYS_STATE"), stream]))
    (span,) = log.in_air
    assert (span.start_s, span.stop_s) == (pytest.approx(8.2), pytest.approx(30.0))
    assert "in_air_inferred" in codes(log)
    assert read(encode(without("EXTENDED_SYS_STATE"))).in_air is None


def test_velocity_of_the_global_position_serves_where_no_local_one_is_sent() -> None:
    zero = dict.fromkeys(["lat", "lon", "alt", "hdg"], 0)
    fields = zero | {"time_boot_ms": (T * 1e3).astype(int), "relative_alt": (T * 100).astype(int)}
    fields |= {
        k: np.rint(VELOCITY[:, i] * 100).astype(int) for i, k in enumerate(("vx", "vy", "vz"))
    }
    stream = w.Stream(message="GLOBAL_POSITION_INT", time_s=T, fields=fields)
    log = read(encode([*without("LOCAL_POSITION_NED"), stream]))
    np.testing.assert_allclose(log.velocity_m_s.values, VELOCITY, atol=0.0051)
    np.testing.assert_allclose(log.altitude_m.values, T / 10, atol=0.0011)


def test_px4_sends_integer_parameters_as_bits() -> None:
    bits = float(np.array([6], dtype=np.int32).view(np.float32)[0])
    fields = {"param_id": "BAT1_N_CELLS", "param_value": bits, "param_type": 6}
    fields |= {"param_count": 1, "param_index": 0}
    cells = w.Stream(message="PARAM_VALUE", time_s=[0.0], fields=fields)
    log = read(encode([*flight(), cells]))
    assert dict(log.parameters)["BAT1_N_CELLS"] == 6
    assert log.batteries[0].series == 6


def test_a_smart_battery_is_known_by_its_serial_number() -> None:
    info = {"id": 0, "battery_function": 1, "type": 1, "capacity_full_specification": 5000}
    info |= {"capacity_full": 4800, "cycle_count": 7, "weight": 300, "discharge_minimum_voltage": 0}
    info |= {"charging_minimum_voltage": 0, "resting_minimum_voltage": 0}
    texts = {"serial_number": "SN-0815", "device_name": "pack"}
    stream = w.Stream(message="SMART_BATTERY_INFO", time_s=[1.0], fields=info | texts)
    assert read(encode([*flight(), stream])).batteries[0].serial == "SN-0815"


def test_a_simulated_vehicle_is_recognised() -> None:
    parameter = w.parameter(0.0, "SIM_BATT_VOLTAGE", 12.6)
    beat = w.heartbeat(T, ARMED, 5, autopilot=w.ARDUPILOT)
    assert read(encode([beat, *without("HEARTBEAT"), parameter])).simulated


def test_a_stream_without_stamps_is_read_on_its_boot_times() -> None:
    records, at = [], 0
    while at < len(whole()):
        size = 12 + whole()[at + 9]
        records.append(whole()[at + 8 : at + 8 + size])
        at += 8 + size
    log = read(b"".join(records))
    assert "time_base_reconstructed" in codes(log)
    np.testing.assert_allclose(log.velocity_m_s.time_s, T, atol=1e-9)
    assert np.max(np.abs(log.batteries[0].time_s - T[-log.batteries[0].time_s.size :])) < 0.21


@pytest.mark.parametrize("cut", range(1, 10))
def test_a_log_that_lost_its_first_bytes_keeps_the_times_of_the_others(cut: int) -> None:
    log = read(whole()[cut:])
    assert "time_base_reconstructed" not in codes(log)
    assert log.batteries[0].time_s == pytest.approx(T, abs=1e-6)
    assert log.recovered_fraction > 1 - 100 / len(whole())


@settings(max_examples=60, deadline=None)
@given(st.integers(0, len(whole())))
def test_a_log_cut_anywhere_gives_its_beginning_or_says_why_not(size: int) -> None:
    full = read(whole()).batteries[0]
    try:
        log = read(whole()[:size])
    except LogError:
        assert size < 200
        return
    for battery in log.batteries:
        if battery.label == full.label:
            n = battery.time_s.size
            np.testing.assert_array_equal(battery.voltage_V, full.voltage_V[:n])


@pytest.mark.parametrize("gap", [8, 0])
def test_a_log_that_ends_inside_a_packet_says_so(gap: int) -> None:
    data, stops = whole(), [0]
    while stops[-1] < len(data):
        stops.append(stop_of(data, stops[-1] + 8) or 0)
    packets = [data[at + 8 - gap : stop] for at, stop in pairwise(stops)]
    data = b"".join(packets)
    for lost in range(len(packets[-1])):
        assert ("log_truncated" in codes(read(data[: len(data) - lost]))) == bool(lost), lost
    assert "log_truncated" not in codes(read(data[: -len(packets[-1])]))
    assert "log_truncated" not in codes(read(data + bytes(gap + 100)))


@settings(max_examples=30, deadline=None)
@given(st.integers(2_000, len(whole()) - 2_000), st.integers(1, 500), st.integers(0, 2**32 - 1))
def test_what_lies_behind_a_damaged_stretch_is_recovered(at: int, size: int, seed: int) -> None:
    noise = np.random.default_rng(seed).bytes(size)
    log = read(whole()[:at] + noise + whole()[at + size :])
    lost = 200 + size  # the packets that are hit at either end
    assert log.recovered_fraction > 1 - 2 * lost / len(whole())
    (battery,) = log.batteries
    assert battery.time_s.size >= T.size - 2 - size // 60
    assert battery.time_s[-1] == pytest.approx(T[-1])
    # checksums let nothing false through
    assert set(battery.voltage_V) <= set(read(whole()).batteries[0].voltage_V)


def test_a_packet_with_a_flipped_bit_is_left_out() -> None:
    table = read_packets(whole(), 8, "BATTERY_STATUS".__eq__).tables["BATTERY_STATUS"]
    data = bytearray(whole())
    data[int(table.offset[50]) + 20] ^= 4
    log = read(bytes(data))
    np.testing.assert_allclose(log.batteries[0].time_s, np.delete(T, 50), atol=1e-6)
    (said,) = (w.message for w in log.warnings if w.code == "damaged")
    assert said.startswith("damaged places: 1; ")
    assert 0.99 < log.recovered_fraction < 1


@pytest.mark.parametrize("data", [b"", b"hello\n" * 50, ANY.bytes(5000), b"\xfd" * 5000])
def test_what_is_no_log_is_said_to_be_none(data: bytes) -> None:
    with pytest.raises(NotALog, match=r"flight\.tlog"):
        read(data)


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=400))
def test_noise_behind_a_log_head_raises_nothing_but_our_errors(noise: bytes) -> None:
    with suppress(LogError):
        read(whole()[:700] + noise)


def test_a_stray_stamp_does_not_stretch_the_log() -> None:
    data = bytearray(whole())
    data[0:8] = (5_000_000_000_000_000).to_bytes(8, "big")
    log = read(bytes(data))
    assert "stray_stamps" in codes(log)
    assert log.duration_s == pytest.approx(T[-1])


def test_a_clock_set_back_in_flight_is_closed_up() -> None:
    out = io.BytesIO()
    early = [replace(s, time_s=np.asarray(s.time_s)) for s in flight()]
    w.write_tlog(out, early, start_unix_s=UNIX_S)
    w.write_tlog(out, early, start_unix_s=UNIX_S - 3600)
    log = read(out.getvalue())
    assert "clock_stepped_back" in codes(log)
    assert log.duration_s == pytest.approx(2 * T[-1], abs=0.3)


def test_columns_agree_with_pymavlinks_decoder() -> None:
    link = mavlink.MAVLink(None)
    names = ("BATTERY_STATUS", "LOCAL_POSITION_NED", "HEARTBEAT", "SYS_STATUS")
    raw = read_packets(whole(), 8, names.__contains__)
    for name in names:
        table = raw.tables[name]
        for row in (0, 17, len(table) - 1):
            at = int(table.offset[row])
            size = 12 + whole()[at + 1]
            theirs = link.decode(bytearray(whole()[at : at + size]))
            for label, values in table.numbers.items():
                if label in theirs.fieldnames:
                    np.testing.assert_array_equal(values[row], getattr(theirs, label))


def test_nothing_is_printed(capfd) -> None:
    read(whole()[:9000] + ANY.bytes(300) + whole()[9300:])
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")
