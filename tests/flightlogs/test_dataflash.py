"""DataFlash logs written by our own writer give back what was written."""

import time
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from pymavlink.DFReader import DFReader_binary

from flightlogs.ardupilot import mode_name
from flightlogs.dataflash_binary import read_binary
from flightlogs.errors import LogDamaged, NotALog
from flightlogs.log import Interval, Vehicle
from sample_logs import write_dataflash as w
from sample_logs.pack_trace import PackTrace
from tests.flightlogs.dataflash_flight import (
    BOOT_S,
    CHARGE,
    CURRENT,
    PACK,
    SINGLE,
    UNIX_S,
    VELOCITY,
    VOLTAGE,
    T,
    binary,
    codes,
    flight,
    old_current,
    read,
    text,
    whole,
)


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


def test_the_cells_beyond_twelve_come_in_a_second_message() -> None:
    rows = {"TimeUS": (T + BOOT_S) * 1e6, "Instance": 0 * T}
    cells = {f"V{k}": VOLTAGE / 4 * 1e3 + k for k in range(1, 14)}
    first = rows | {k: v for k, v in cells.items() if k != "V13"}
    second = rows | {"V13": cells["V13"], "V14": 65535 + 0 * T}
    tables = [
        w.Table(name="BCL", format="QB" + 12 * "H", columns=first),
        w.Table(name="BCL2", format="QBHH", columns=second),
    ]
    large = replace(PACK, voltage_V=13 / 4 * VOLTAGE)
    (battery,) = read(binary([w.battery(large), *tables])).batteries
    assert battery.series == 13
    expected = np.column_stack(list(cells.values())) / 1e3
    np.testing.assert_allclose(battery.cell_voltage_V, expected, atol=0.00051)


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


def test_a_temperature_that_moves_is_kept() -> None:
    warm = replace(PACK, temperature_K=290 + T / 10)
    (battery,) = read(binary([w.battery(warm)])).batteries
    np.testing.assert_allclose(battery.temperature_K, 290 + T / 10, atol=0.0051)


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


@pytest.mark.parametrize("digits", [6, 0])  # the counter's
def test_rows_missing_in_a_text_log_without_times_leave_a_gap_and_the_period(digits: int) -> None:
    every = slice(None, None, 10)
    kept = (T[every] < 20) | (T[every] >= 38)
    columns = {"Volt": VOLTAGE * 100, "Curr": CURRENT * 100, "CurrTot": CHARGE / 3.6}
    rows = {name: np.round(values[every][kept], digits) for name, values in columns.items()}
    order_s = np.arange(kept.sum())
    log = read(text([w.Table(name="CURR", format="hhf", columns=rows, order_s=order_s)]))
    found_s = log.batteries[0].time_s
    before = T[every][kept] < 20
    np.testing.assert_array_equal(found_s[before], T[every][kept][before])
    # the gap's current is taken as that at its edges, and swings by a third of its mean
    assert found_s[~before] == pytest.approx(T[every][kept][~before], abs=18 / 3)
    said = next(w.message for w in log.warnings if w.code == "time_base_reconstructed")
    assert "CURR rows every 1 s" in said
    assert "s are missing in 1 places" in said


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


@pytest.mark.parametrize(
    ("pauses", "events", "armed"),
    [
        ([(20, 40)], {0: 10, 40: 10}, [(0, 19.9), (40, 59.9)]),
        ([(20, 23)], {0: 10, 23: 10}, [(0, 19.9), (23, 59.9)]),
        ([(10, 14), (30, 33)], {0: 10, 25: 18, 33: 10}, [(0, 29.9), (33, 59.9)]),
        ([(10, 14)], {0: 10, 12: 11, 14: 10}, [(0, 12), (14, 59.9)]),
    ],
)
def test_what_is_armed_again_was_disarmed_where_the_log_pauses(pauses, events, armed) -> None:
    kept = T[~np.any([(a <= T) & (b > T) for a, b in pauses], axis=0)]
    pack = PackTrace(
        time_s=kept + BOOT_S,
        voltage_V=np.interp(kept, T, VOLTAGE),
        current_A=np.interp(kept, T, CURRENT),
        charge_C=np.interp(kept, T, CHARGE),
    )
    events_s = BOOT_S + np.array(list(events), dtype=float)
    log = read(binary([w.battery(pack), w.events(events_s, list(events.values()))]))
    assert [(round(a.start_s, 1), round(a.stop_s, 1)) for a in log.armed] == armed


def test_throttle_tells_the_flight_where_no_event_does() -> None:
    throttle = np.where((T > 10) & (T < 45), 0.45, 0.12)
    rest = [t for t in flight() if t.name not in ("EV", "CTUN")]
    log = read(binary([*rest, w.control(T + BOOT_S, throttle, T, T, T)]))
    (span,) = log.in_air
    assert (span.start_s, span.stop_s) == (pytest.approx(10.1), pytest.approx(45.0))
    assert "in_air_inferred" in codes(log)
    assert read(binary([w.battery(PACK)])).in_air is None


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


@pytest.mark.parametrize("mode", ["5²", "9" * 400, "5.0.0"])
def test_a_mode_that_is_no_number_is_a_name(mode: str) -> None:
    assert mode_name("ArduCopter", mode) == mode


def test_current_rows_without_their_counter_have_no_rhythm() -> None:
    table = w.Table(name="CURR", format="h", columns={"Volt": VOLTAGE * 100}, order_s=T)
    with pytest.raises(LogDamaged, match="without a single data row that has a time"):
        read(text([table]))


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


def test_ten_megabytes_are_read_in_a_few_seconds() -> None:
    t = np.arange(0, 1800, 0.05)
    pack = PackTrace(time_s=t, voltage_V=15 + 0 * t, current_A=10 + 0 * t, charge_C=10 * t)
    v = np.zeros((t.size, 3))
    data = binary([w.battery(pack), w.velocity(t, v), *w.velocity_setpoint(t, v, v)])
    data *= 1 + 10_000_000 // len(data)
    began = time.perf_counter()
    read(data)
    assert time.perf_counter() - began < 5
