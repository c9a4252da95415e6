"""DataFlash logs written by our own writer, whole and broken on purpose."""

import io
import time
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.DFReader import DFReader_binary

from flightlogs.dataflash import read_dataflash
from flightlogs.dataflash_binary import read_binary
from flightlogs.errors import LogDamaged, LogError, NotALog
from flightlogs.log import FlightLog, Interval, Vehicle
from sample_logs import write_dataflash as w
from sample_logs.pack_trace import PackTrace

BOOT_S = 20.0  # of the first sample, since boot
UNIX_S = 1_700_000_000.0  # of the first sample
DURATION_S = 60.0
FIRMWARE = "ArduCopter V4.5.7 (2a3dc4b7)"
SINGLE = 2e-7  # rounding of a 32-bit float, relative
ANY = np.random.default_rng(7)

T = np.arange(0.0, DURATION_S, 0.1)
CURRENT = 12.0 + 4.0 * np.sin(0.7 * T)
VOLTAGE = 16.0 - 0.02 * CURRENT
CHARGE = 12.0 * T + 4.0 / 0.7 * (1 - np.cos(0.7 * T))
PACK = PackTrace(time_s=T + BOOT_S, voltage_V=VOLTAGE, current_A=CURRENT, charge_C=CHARGE)
VELOCITY = np.column_stack([np.cos(T / 5), np.sin(T / 5), -0.5 * np.sin(T / 3)])


def flight(pack: PackTrace = PACK) -> list[w.Table]:
    boot = T + BOOT_S
    return [
        w.parameters({"BATT_CAPACITY": 2200.0, "BATT_SERIAL_NUM": 77.0, "FRAME_CLASS": 1.0}),
        w.texts(boot[:1], [FIRMWARE]),
        w.battery(pack),
        w.velocity(boot, VELOCITY),
        *w.velocity_setpoint(boot, VELOCITY + 0.25, VELOCITY),
        w.control(boot, 0.4 + 0 * T, 10 + T / 10, -VELOCITY[:, 2], -VELOCITY[:, 2]),
        w.events(BOOT_S + np.array([2.0, 5.0, 50.0, 55.0]), [10, 28, 18, 11]),
        w.modes(BOOT_S + np.array([0.0, 30.0]), [5, 2]),
        w.utc(boot[::10], UNIX_S + T[::10]),
    ]


def binary(tables: list[w.Table]) -> bytes:
    out = io.BytesIO()
    w.write_dataflash(out, tables)
    return out.getvalue()


def text(tables: list[w.Table], banner: tuple[str, ...] = ()) -> bytes:
    out = io.BytesIO()
    w.write_dataflash_text(out, tables, banner=banner)
    return out.getvalue()


@cache
def whole() -> bytes:
    return binary(flight())


def read(data: bytes) -> FlightLog:
    return read_dataflash(io.BytesIO(data), name="flight.bin")


def codes(log: FlightLog) -> set[str]:
    return {warning.code for warning in log.warnings}


def old_current(format_: str, scale: float, **columns: np.ndarray) -> w.Table:
    """CURR as ArduCopter 3 logs it; volts and amperes times `scale`."""
    values = {"Volt": VOLTAGE * scale, "Curr": CURRENT * scale, "CurrTot": CHARGE / 3.6}
    return w.Table(name="CURR", format=format_, columns={**columns, **values})


@pytest.mark.parametrize("encode", [binary, text])
def test_gives_back_what_was_written(encode) -> None:
    log = read(encode(flight()))
    (battery,) = log.batteries
    np.testing.assert_allclose(battery.time_s, T, atol=1e-6)  # stamps are whole microseconds
    np.testing.assert_allclose(battery.current_A, CURRENT, rtol=SINGLE)
    np.testing.assert_allclose(battery.voltage_V, VOLTAGE, rtol=SINGLE)
    np.testing.assert_allclose(battery.charge_C, CHARGE, rtol=SINGLE, atol=1e-9)
    assert battery.capacity_C == pytest.approx(2200 * 3.6)
    assert (battery.label, battery.serial, battery.series) == ("BAT[0]", "77", None)
    assert battery.temperature_K is None  # Temp is 0 throughout
    np.testing.assert_allclose(log.velocity_m_s.values, VELOCITY, rtol=SINGLE, atol=1e-9)
    np.testing.assert_allclose(log.thrust.values, 0.4, rtol=SINGLE)
    np.testing.assert_allclose(log.altitude_m.values, T / 10, atol=1e-5)
    assert log.duration_s == pytest.approx(T[-1])
    assert log.recovered_fraction == 1.0
    assert log.warnings == ()


def test_knows_who_flew_and_when() -> None:
    log = read(whole())
    assert (log.firmware, log.vehicle, log.simulated) == (
        "ArduCopter V4.5.7",
        Vehicle.MULTIROTOR,
        False,
    )
    assert log.armed == (Interval(pytest.approx(2.0), pytest.approx(55.0)),)
    assert log.in_air == (Interval(pytest.approx(5.0), pytest.approx(50.0)),)
    assert [(m.name, round(m.start_s), round(m.stop_s)) for m in log.modes] == [
        ("LOITER", 0, 30),
        ("ALT_HOLD", 30, 60),
    ]
    expected = datetime.fromtimestamp(UNIX_S, tz=UTC)
    assert abs((log.start_utc - expected).total_seconds()) < 2e-3  # GPS counts milliseconds


def test_desired_velocity_is_the_setpoint() -> None:
    log = read(whole())
    np.testing.assert_allclose(log.velocity_setpoint_m_s.values, VELOCITY + 0.25, rtol=1e-6)
    assert log.velocity_setpoint_m_s.source == "PSCN.DVN, PSCE.DVE, PSCD.DVD"


def test_horizontal_setpoint_is_unknown_where_the_controller_was_off() -> None:
    rest = [t for t in flight() if not t.name.startswith("PSC")]
    on = T < 20
    active = w.velocity_setpoint(T[on] + BOOT_S, VELOCITY[on], VELOCITY[on])[:2]
    setpoint = read(binary([*rest, *active])).velocity_setpoint_m_s
    known = np.isfinite(setpoint.values)
    assert known[setpoint.time_s < 19.95, 0].all()
    assert not known[setpoint.time_s > 20.5, 0].any()
    assert known[:, 2].all()  # the climb rate of CTUN


def test_no_climb_rate_is_commanded_in_stabilize() -> None:
    rest = [t for t in flight() if t.name not in ("MODE", "PSCN", "PSCE", "PSCD")]
    log = read(binary([*rest, w.modes([BOOT_S, BOOT_S + 10], [2, 0])]))
    setpoint = log.velocity_setpoint_m_s
    np.testing.assert_array_equal(np.isfinite(setpoint.values[:, 2]), setpoint.time_s < 10)


@pytest.mark.parametrize(("format_", "scale"), [("Qfff", 1.0), ("Qhhf", 100.0), ("QHHf", 100.0)])
@pytest.mark.parametrize("encode", [binary, text])
def test_the_type_of_the_column_tells_its_unit(format_: str, scale: float, encode) -> None:
    stamp = np.rint((T + BOOT_S) * 1e6)
    (battery,) = read(encode([old_current(format_, scale, TimeUS=stamp)])).batteries
    np.testing.assert_allclose(battery.current_A, CURRENT, atol=0.0051)  # half a count of 0.01
    np.testing.assert_allclose(battery.voltage_V, VOLTAGE, atol=0.0051)


def test_milliseconds_since_boot_are_a_clock_too() -> None:
    (battery,) = read(binary([old_current("Ihhf", 100.0, TimeMS=(T + BOOT_S) * 1e3)])).batteries
    np.testing.assert_allclose(battery.time_s, T, atol=1e-9)


def test_every_battery_is_kept_apart() -> None:
    other = replace(PACK, current_A=CURRENT / 2)
    names = {"BATT_CAPACITY": 2200.0, "BATT2_CAPACITY": 900.0}
    log = read(binary([w.parameters(names), w.battery(PACK), w.battery(other, instance=1)]))
    first, second = log.batteries
    assert [b.label for b in log.batteries] == ["BAT[0]", "BAT[1]"]
    assert [b.instance for b in log.batteries] == [0, 1]
    np.testing.assert_allclose(second.current_A, np.asarray(first.current_A) / 2, rtol=1e-6)
    assert second.capacity_C == pytest.approx(900 * 3.6)


def test_cells_come_from_their_own_message() -> None:
    cells = np.column_stack([VOLTAGE / 4 + d for d in (-0.02, 0.0, 0.02)]) * 1e3
    used = {f"V{i + 1}": cells[:, i] for i in range(3)}
    columns = {"TimeUS": (T + BOOT_S) * 1e6, "Instance": 0 * T} | used | {"V4": 65535 + 0 * T}
    table = w.Table(name="BCL", format="QBHHHH", columns=columns)
    (battery,) = read(binary([w.battery(PACK), table])).batteries
    assert battery.series == 3
    np.testing.assert_allclose(battery.cell_voltage_V, cells / 1e3, atol=0.00051)


@pytest.mark.parametrize(
    ("current", "voltage", "code", "missing"),
    [
        (0 * T, VOLTAGE, "current_not_measured", "current_A"),
        (0 * T - 0.01, VOLTAGE, "current_not_measured", "current_A"),
        (CURRENT, 0 * T, "voltage_not_measured", "voltage_V"),
        (CURRENT, 0.1 + 0 * T, "voltage_not_measured", "voltage_V"),
        (0 * T, 6.0 + 0.05 * np.sin(T), "voltage_doubtful", "current_A"),
    ],
)
def test_a_dead_sensor_is_not_a_measurement(current, voltage, code: str, missing: str) -> None:
    log = read(binary([w.battery(replace(PACK, current_A=current, voltage_V=voltage))]))
    assert getattr(log.batteries[0], missing) is None
    assert code in codes(log)


def test_what_no_sensor_can_have_said_is_left_out_and_counted() -> None:
    struck = np.isin(np.arange(T.size), [100, 200])
    log = read(binary([w.battery(replace(PACK, current_A=np.where(struck, 1e30, CURRENT)))]))
    np.testing.assert_array_equal(np.isnan(log.batteries[0].current_A), struck)
    assert "impossible_values" in codes(log)


def test_velocity_of_gps_takes_its_climb_from_the_barometer_where_it_has_none() -> None:
    columns = {"TimeUS": (T + BOOT_S) * 1e6, "Status": np.where(T < 10, 1, 3)}
    course = np.mod(np.degrees(np.arctan2(VELOCITY[:, 1], VELOCITY[:, 0])), 360)
    columns |= {"Spd": np.hypot(VELOCITY[:, 0], VELOCITY[:, 1]), "GCrs": course}
    gps = w.Table(name="GPS", format="QBff", columns=columns)
    climb = w.control(T + BOOT_S, 0 * T, T, -VELOCITY[:, 2], 0 * T)
    velocity = read(binary([gps, climb])).velocity_m_s
    assert velocity.source == "GPS.Spd,GCrs; CTUN.CRt"
    assert np.isnan(velocity.values[T < 10]).all()  # no fix yet
    fixed = T >= 10
    np.testing.assert_allclose(velocity.values[fixed, :2], VELOCITY[fixed, :2], atol=1e-6)
    np.testing.assert_allclose(velocity.values[fixed, 2], VELOCITY[fixed, 2], atol=0.0051)


def test_one_core_of_the_navigation_filter_is_taken() -> None:
    core = np.tile([1.0, 0.0], T.size)
    moving = np.repeat(VELOCITY, 2, axis=0) + 9 * core[:, None]
    both = w.velocity(np.repeat(T, 2) + BOOT_S, moving)
    both = replace(both, columns={**both.columns, "C": core})
    velocity = read(binary([both])).velocity_m_s
    np.testing.assert_allclose(velocity.values, VELOCITY, rtol=SINGLE, atol=1e-9)


def test_parameters_dumped_long_before_the_data_are_no_part_of_its_time() -> None:
    log = read(binary([w.parameters({"FRAME": 1.0}), *flight()[2:]]))
    assert (log.duration_s, log.warnings) == (pytest.approx(T[-1]), ())


def test_a_temperature_that_moves_is_kept() -> None:
    warm = replace(PACK, temperature_K=290 + T / 10)
    (battery,) = read(binary([w.battery(warm)])).batteries
    np.testing.assert_allclose(battery.temperature_K, 290 + T / 10, atol=0.0051)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, len(whole())))
def test_a_log_cut_anywhere_gives_its_beginning_or_says_why_not(size: int) -> None:
    full = read(whole()).batteries[0]
    try:
        log = read(whole()[:size])
    except LogError:
        assert size < 12_000  # the records that describe the others and the parameters
        return
    assert 0 < log.recovered_fraction <= 1
    for battery in log.batteries:
        n = battery.time_s.size
        np.testing.assert_array_equal(battery.time_s, full.time_s[:n])
        np.testing.assert_array_equal(battery.voltage_V, full.voltage_V[:n])


@settings(max_examples=30, deadline=None)
@given(st.integers(2_000, len(whole()) - 600), st.integers(1, 500), st.integers(0, 2**32 - 1))
def test_what_lies_behind_a_damaged_stretch_is_recovered(at: int, size: int, seed: int) -> None:
    noise = np.random.default_rng(seed).bytes(size)
    log = read(whole()[:at] + noise + whole()[at + size :])
    assert log.recovered_fraction > 0.97 - size / len(whole())
    (battery,) = [b for b in log.batteries if b.label == "BAT[0]"]  # noise can number another
    assert battery.time_s.size >= T.size - 1 - size // 20
    assert battery.time_s[-1] == pytest.approx(T[-1])


def test_bytes_lost_inside_a_record_cost_that_record_and_make_up_none() -> None:
    full = read(whole()).batteries[0]
    for at in range(len(whole()) // 2, len(whole()) // 2 + 200, 3):
        log = read(whole()[:at] + whole()[at + 7 :])
        (battery,) = log.batteries
        assert T.size - 1 <= battery.time_s.size <= T.size
        assert set(battery.time_s) <= set(full.time_s)
        assert set(battery.voltage_V) <= set(full.voltage_V)
        assert log.recovered_fraction > 0.99


def test_a_head_that_noise_imitates_is_not_believed() -> None:
    fake = b"\xa3\x95" + bytes([131]) + bytes(20)  # of the battery's type, followed by nothing
    log = read(whole()[:20_000] + b"\x00" + fake + whole()[20_000:])
    assert log.recovered_fraction < 1
    np.testing.assert_array_equal(log.batteries[0].voltage_V, read(whole()).batteries[0].voltage_V)


@pytest.mark.parametrize("data", [b"", b"hello\n" * 50, ANY.bytes(5000), b"\0" * 5000])
def test_what_is_no_log_is_said_to_be_none(data: bytes) -> None:
    with pytest.raises(NotALog):
        read(data)


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=400))
def test_noise_behind_a_log_head_raises_nothing_but_our_errors(noise: bytes) -> None:
    for head in (whole()[:1100], b"FMT, 150, 20, CURR, QBff, TimeUS,I,Volt,Curr\nCURR, "):
        with suppress(LogError):
            read(head + noise)


def test_a_log_that_only_describes_itself_is_damaged() -> None:
    with pytest.raises(LogDamaged, match=r"flight\.bin"):
        read(whole()[:500])


def test_the_one_hertz_of_a_text_log_without_times_is_proved_by_its_charge_counter() -> None:
    every = slice(None, None, 10)
    untimed = {"Volt": VOLTAGE[every] * 100, "Curr": CURRENT[every] * 100}
    table = w.Table(
        name="CURR",
        format="hhf",
        columns=untimed | {"CurrTot": CHARGE[every] / 3.6},
        order_s=T[every],
    )
    climb = w.Table(name="CTUN", format="hh", columns={"ThrOut": 0 * T, "CRate": 0 * T}, order_s=T)
    log = read(text([table, climb], banner=("", "ArduCopter V3.0.1", "Free RAM: 1", "APM 2")))
    assert (log.firmware, log.hardware) == ("ArduCopter V3.0.1", "APM 2")
    np.testing.assert_array_equal(log.batteries[0].time_s, T[every])
    assert "time_base_reconstructed" in codes(log)
    between = log.velocity_m_s.time_s  # of CTUN, ten rows to one of CURR
    assert np.max(np.abs(between[:-10] - T[: between.size][:-10])) < 0.11
    assert "velocity_vertical_only" in codes(log)


def test_a_charge_counter_that_disagrees_with_one_hertz_is_believed() -> None:
    columns = {"Volt": VOLTAGE * 100, "Curr": CURRENT * 100, "CurrTot": CHARGE / 3.6}
    log = read(text([w.Table(name="CURR", format="hhf", columns=columns, order_s=T)]))
    assert log.duration_s == pytest.approx(T[-1], rel=0.01)  # ten rows a second


def test_the_time_of_week_orders_a_text_log_without_other_times() -> None:
    place = np.arange(T.size)
    gps = w.Table(
        name="GPS", format="BI", columns={"Status": 3 + 0 * T, "Time": T * 2e3}, order_s=place
    )
    columns = {"Volt": VOLTAGE * 100, "Curr": CURRENT * 100, "CurrTot": CHARGE / 3.6}
    table = w.Table(name="CURR", format="hhf", columns=columns, order_s=place + 0.5)
    log = read(text([gps, table]))
    assert log.duration_s == pytest.approx(2 * T[-1])
    assert "GPS" in next(w.message for w in log.warnings if w.code == "time_base_reconstructed")


def test_an_empty_format_a_comma_and_a_torn_line_do_no_harm_to_a_text_log() -> None:
    lines = text(flight()).decode().splitlines()
    strange = ["FMT, 10, 3, STRT, , ", "STRT, ", "MSG, 20000000, one, two, three", "BAT, 2000"]
    log = read("\r\n".join([*lines[:20], *strange, *lines[20:]]).encode())
    assert log.batteries[0].time_s.size == T.size
    assert 0.999 < log.recovered_fraction < 1


@pytest.mark.parametrize("encode", [binary, text])
def test_a_type_described_anew_keeps_the_layout_with_more_rows(encode) -> None:
    short = w.Table(name="BAT", format="Qf", columns={"TimeUS": [9e7, 9.1e7], "Volt": [1.0, 1.0]})
    for data in (encode(flight()) + encode([short]), encode([short]) + encode(flight())):
        np.testing.assert_allclose(read(data).batteries[0].voltage_V, VOLTAGE, rtol=SINGLE)


def test_a_pause_of_the_logger_between_two_armings_is_a_disarming() -> None:
    late = T[T >= 40]
    kept = np.concatenate([T[T < 20], late])
    pack = PackTrace(
        time_s=kept + BOOT_S,
        voltage_V=np.interp(kept, T, VOLTAGE),
        current_A=np.interp(kept, T, CURRENT),
        charge_C=np.interp(kept, T, CHARGE),
    )
    log = read(binary([w.battery(pack), w.events([BOOT_S, BOOT_S + 40], [10, 10])]))
    assert [(round(a.start_s, 1), round(a.stop_s, 1)) for a in log.armed] == [(0, 19.9), (40, 59.9)]


def test_throttle_tells_the_flight_where_no_event_does() -> None:
    throttle = np.where((T > 10) & (T < 45), 0.45, 0.12)
    rest = [t for t in flight() if t.name not in ("EV", "CTUN")]
    log = read(binary([*rest, w.control(T + BOOT_S, throttle, T, T, T)]))
    (span,) = log.in_air
    assert (span.start_s, span.stop_s) == (pytest.approx(10.1), pytest.approx(45.0))
    assert "in_air_inferred" in codes(log)
    assert read(binary([w.battery(PACK)])).in_air is None


@pytest.mark.parametrize("ahead_s", [5.0, 9e8])
def test_a_stray_stamp_is_left_out_and_counted(ahead_s: float) -> None:
    stamps = (T + BOOT_S + ahead_s * (np.arange(T.size) == 300)) * 1e6
    log = read(binary([replace(old_current("Qfff", 1.0, TimeUS=stamps), order_s=T)]))
    assert "stray_stamps" in codes(log)
    assert log.batteries[0].time_s.size == T.size - 1
    assert log.duration_s == pytest.approx(T[-1])


def test_a_clock_that_steps_back_goes_on_from_there() -> None:
    stamps = (T + BOOT_S - 15 * (T >= 30)) * 1e6
    log = read(binary([replace(old_current("Qfff", 1.0, TimeUS=stamps), order_s=T)]))
    assert "clock_stepped_back" in codes(log)
    assert log.duration_s == pytest.approx(T[-1], abs=0.11)  # one period is lost at the seam


@pytest.mark.parametrize(
    ("line", "parameters", "vehicle"),
    [
        ("ArduCopter V4.5.7", {"FRAME_CLASS": 1.0}, Vehicle.MULTIROTOR),
        ("APM:Copter V3.4.6 (e707341b)", {"FRAME": 1.0}, Vehicle.MULTIROTOR),
        ("ArduCopter V4.0.3", {"FRAME_CLASS": 6.0}, Vehicle.HELICOPTER),
        ("ArduCopter V3.0.1", {"FRAME": 0.0, "H_SWASH_TYPE": 0.0}, Vehicle.HELICOPTER),
        ("ArduPlane V4.4.0", {"Q_ENABLE": 0.0}, Vehicle.FIXED_WING),
        ("ArduPlane V4.4.0", {"Q_ENABLE": 1.0}, Vehicle.VTOL),
        ("ArduRover V4.2.3", {}, Vehicle.OTHER),
        ("hello", {}, Vehicle.UNKNOWN),
    ],
)
def test_the_airframe_is_what_the_log_declares(line: str, parameters, vehicle: Vehicle) -> None:
    tables = [w.parameters(parameters), w.texts([BOOT_S], [line]), w.battery(PACK)]
    assert read(binary(tables)).vehicle is vehicle


def test_a_simulated_log_is_recognised() -> None:
    assert read(binary([w.parameters({"SIM_BATT_VOLTAGE": 12.6}), w.battery(PACK)])).simulated


def test_sticks_are_scaled_by_the_radio_calibration() -> None:
    pulses = {"C1": 1900, "C2": 1100, "C3": 1300, "C4": 1500} | {f"C{i}": 0 for i in range(5, 9)}
    columns = {"TimeUS": (T + BOOT_S) * 1e6} | {k: v + 0 * T for k, v in pulses.items()}
    table = w.Table(name="RCIN", format="Q" + 8 * "H", columns=columns)
    calibration = {f"RC{i}_{k}": v for i in range(1, 5) for k, v in LIMITS.items()}
    log = read(binary([w.parameters(calibration), table]))
    np.testing.assert_allclose(log.sticks.values[0], [1.0, 1.0, 0.0, 0.25])


LIMITS = {"MIN": 1100.0, "TRIM": 1500.0, "MAX": 1900.0}


def test_px4s_older_format_is_left_to_its_own_reader() -> None:
    time_ = w.Table(name="TIME", format="Q", columns={"StartTime": T * 1e6}, order_s=T)
    with pytest.raises(NotALog, match="sdlog2"):
        read(binary([time_]))


def test_columns_agree_with_pymavlinks_reader(tmp_path) -> None:
    path = tmp_path / "flight.bin"
    path.write_bytes(whole())
    raw = read_binary(whole(), wanted=frozenset(["BAT", "CTUN", "XKF1"]), clocks=frozenset())
    theirs = DFReader_binary(str(path))
    seen: dict[str, list[dict[str, float]]] = {"BAT": [], "CTUN": [], "XKF1": []}
    while (message := theirs.recv_match(type=list(seen))) is not None:
        seen[message.get_type()].append(message.to_dict())
    theirs.close() if hasattr(theirs, "close") else theirs.filehandle.close()
    for name, rows in seen.items():
        for label, values in raw.tables[name].numbers.items():
            np.testing.assert_array_equal(values, [row[label] for row in rows])


def test_nothing_is_printed(capfd) -> None:
    read(whole()[:9000] + ANY.bytes(300) + whole()[9300:])
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")


@pytest.mark.slow
def test_ten_megabytes_are_read_in_a_few_seconds() -> None:
    t = np.arange(0, 1800, 0.05)
    pack = PackTrace(time_s=t, voltage_V=15 + 0 * t, current_A=10 + 0 * t, charge_C=10 * t)
    v = np.zeros((t.size, 3))
    data = binary([w.battery(pack), w.velocity(t, v), *w.velocity_setpoint(t, v, v)])
    data *= 1 + 10_000_000 // len(data)
    began = time.perf_counter()
    read(data)
    assert time.perf_counter() - began < 5
