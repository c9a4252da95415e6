"""PX4 ULogs from our own writer: what was written is read, what is damaged is said."""

import io
from dataclasses import replace
from datetime import UTC, datetime
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs.errors import LogDamaged, LogError, NotALog
from flightlogs.log import FlightLog, Vehicle
from flightlogs.read import read_log
from sample_logs import write_ulog as w
from tests.flightlogs import px4_flight as px4

FLOAT32 = 1e-6  # relative resolution of the fields of a ULog, with a margin
FOREIGN_V = 12.625


def read(content: bytes) -> FlightLog:
    return read_log(io.BytesIO(content), name="test.ulg")


def codes(log: FlightLog) -> list[str]:
    return [warning.code for warning in log.warnings]


def battery_rows(log: FlightLog) -> np.ndarray:
    battery = log.batteries[0]
    assert battery.current_A is not None
    assert battery.voltage_V is not None
    return np.column_stack([battery.time_s, battery.current_A, battery.voltage_V])


def test_what_was_written_is_read() -> None:
    log = read(px4.ulog())
    written = px4.trace(px4.times(5.0))
    battery = log.batteries[0]
    np.testing.assert_allclose(battery.time_s, px4.times(5.0), atol=1e-6)
    np.testing.assert_allclose(battery.current_A, written.current_A, rtol=FLOAT32)
    np.testing.assert_allclose(battery.voltage_V, written.voltage_V, rtol=FLOAT32)
    np.testing.assert_allclose(battery.charge_C, written.charge_C, rtol=FLOAT32)
    assert battery.temperature_K is None
    assert battery.series == px4.CELLS
    assert battery.capacity_C == pytest.approx(px4.CAPACITY_MAH * 3.6)
    assert (log.format, log.firmware, log.hardware) == ("ulog", "PX4 1.14.0", "TEST_BOARD")
    assert (log.vehicle, log.simulated) == (Vehicle.MULTIROTOR, False)
    assert log.start_utc == datetime.fromtimestamp(px4.UNIX_S, UTC)
    assert [(s.start_s, s.stop_s) for s in log.in_air or ()] == [(px4.TAKE_OFF_S, px4.LANDING_S)]
    assert [mode.name for mode in log.modes] == ["POSCTL"]
    assert log.duration_s == pytest.approx(px4.END_S, abs=0.03)
    assert log.recovered_fraction == 1.0
    assert log.warnings == ()


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    content = px4.ulog()
    read(content[:9000] + b"\xff" * 5000 + content[14000:])
    assert capfd.readouterr() == ("", "")


def test_a_file_cut_anywhere_gives_a_prefix_and_says_so() -> None:
    content = px4.ulog()
    whole = battery_rows(read(content))
    ends = np.unique(np.linspace(0, len(content) - 1, 160).astype(int)).tolist()
    rows = []
    for end in ends:
        try:
            log = read(content[:end])
        except LogError:
            rows.append(0)
            continue
        got = battery_rows(log) if log.batteries else np.zeros((0, 3))
        np.testing.assert_array_equal(got, whole[: len(got)])
        assert log.recovered_fraction <= 1.0
        assert log.recovered_fraction == 1.0 or codes(log).count("log_truncated") == 1
        rows.append(len(got))
    assert all(a <= b for a, b in pairwise(rows))
    assert rows[-1] >= len(whole) - 1
    assert rows[len(rows) // 2] > len(whole) / 3


def test_every_cut_inside_the_header_is_an_error_of_ours() -> None:
    content = px4.ulog()
    for end in range(200):
        with pytest.raises(LogError):
            read(content[:end])


@settings(max_examples=60, deadline=None)
@given(at=st.floats(0, 1), garbage=st.binary(min_size=1, max_size=3000), replaced=st.booleans())
def test_damage_anywhere_is_an_error_of_ours_or_leaves_true_samples(
    at: float,
    garbage: bytes,
    replaced: bool,  # noqa: FBT001
) -> None:
    content = px4.ulog()
    place = int(at * len(content))
    damaged = content[:place] + garbage + content[place + len(garbage) * replaced :]
    try:
        log = read(damaged)
    except LogError:
        return
    assert 0.0 <= log.recovered_fraction <= 1.0
    assert log.duration_s < 2 * px4.END_S or codes(log)
    if log.batteries and log.batteries[0].current_A is not None:
        assert len(untrue(log)) <= 1  # the one that the damage begins in


def untrue(log: FlightLog) -> list[tuple[float, ...]]:
    """Samples of current and voltage that were not written."""
    written = {tuple(row) for row in battery_rows(read(px4.ulog()))[:, 1:].tolist()}
    got = battery_rows(log)[:, 1:]
    return [
        tuple(row)
        for row in got[np.isfinite(got).all(axis=1)].tolist()
        if tuple(row) not in written
    ]


@pytest.mark.parametrize("row", range(20, 240, 20))
def test_a_record_amid_noise_is_not_taken_though_it_is_well_formed(row: int) -> None:
    """A piece of another log, say: it fits by itself, and nothing that follows it does."""
    content, random, t = px4.ulog(), np.random.default_rng(row), px4.times(5.0)
    other = px4.pack(time_s=px4.BOOT_S + t + 0.1, voltage_V=np.full(t.size, FOREIGN_V))
    _, foreign = other.rows(0)[row]
    at = content.index(px4.pack().rows(0)[row + 1][1])
    log = read(content[:at] + random.bytes(300) + foreign + random.bytes(300) + content[at:])
    assert "log_corrupt" in codes(log)
    np.testing.assert_array_equal(battery_rows(log), battery_rows(read(content)))


def test_what_follows_a_damaged_place_is_recovered_and_the_loss_is_counted() -> None:
    content = px4.ulog()
    middle, lost = len(content) // 2, 4000
    log = read(content[:middle] + bytes(lost) + content[middle + lost :])
    assert "log_corrupt" in codes(log)
    assert log.recovered_fraction == pytest.approx(1 - lost / len(content), abs=0.01)
    assert log.batteries[0].time_s[-1] == pytest.approx(px4.END_S, abs=0.3)
    assert log.batteries[0].time_s.size > 0.8 * px4.END_S * 5


def test_a_damaged_length_costs_one_message() -> None:
    content = bytearray(px4.ulog(extras=w.Extras(texts=[(px4.BOOT_S + 20, 6, "hello")])))
    at = content.index(b"hello") - w.struct.calcsize("<BQ") - 3
    content[at : at + 2] = (900).to_bytes(2, "little")  # it claims to be 900 bytes long
    log = read(bytes(content))
    assert log.batteries[0].time_s.size == px4.times(5.0).size
    assert "log_corrupt" in codes(log)


def test_dropouts_and_appended_data_are_reported() -> None:
    extras = w.Extras(
        dropouts=[(px4.BOOT_S + 10, 0.25), (px4.BOOT_S + 30, 0.5)],
        appended=[w.message("L", b"6" + bytes(8) + b"crash"), b"\x40\x00L6cut"],
    )
    log = read(px4.ulog(extras=extras))
    assert log.dropouts_s == pytest.approx(0.75)
    assert codes(log) == ["log_truncated", "log_appended_data", "log_dropouts"]
    assert log.recovered_fraction > 0.999
    assert log.batteries[0].time_s.size == px4.times(5.0).size


def test_sync_messages_are_no_damage() -> None:
    log = read(px4.ulog(extras=w.Extras(sync_every=50)))
    assert (log.recovered_fraction, log.warnings) == (1.0, ())


def test_an_unknown_incompatible_flag_is_refused() -> None:
    content = bytearray(px4.ulog())
    content[16 + 3 + 8] |= 0x80
    with pytest.raises(LogDamaged, match="flags"):
        read(bytes(content))


def test_a_log_without_any_topic_of_use_says_so() -> None:
    out = io.BytesIO()
    w.write_ulog(out, [w.Topic(name="cpuload", time_s=[1.0], fields={"float load": 0.5})])
    with pytest.raises(LogDamaged, match="without a single sample"):
        read(out.getvalue())


def test_sentinels_never_become_numbers() -> None:
    t = px4.times(5.0)
    written = px4.trace(t)
    amps, volts = np.array(written.current_A), np.array(written.voltage_V)
    amps[100:110], volts[120] = np.nan, np.nan  # written as -1 and 0
    log = read(px4.ulog({"battery": px4.pack(current_A=amps, voltage_V=volts)}))
    battery = log.batteries[0]
    assert np.flatnonzero(np.isnan(battery.current_A)).tolist() == list(range(100, 110))
    assert np.flatnonzero(np.isnan(battery.voltage_V)).tolist() == [120]


def test_values_no_pack_can_give_are_damage() -> None:
    amps = np.array(px4.trace(px4.times(5.0)).current_A)
    amps[100:102] = [1e20, -5e4]
    log = read(px4.ulog({"battery": px4.pack(current_A=amps)}))
    assert np.flatnonzero(np.isnan(log.batteries[0].current_A)).tolist() == [100, 101]
    assert codes(log) == ["impossible_values"]


@pytest.mark.parametrize("amps", [0.0, np.nan])
def test_a_current_that_is_always_0_or_unknown_was_not_measured(amps: float) -> None:
    silent = px4.pack(current_A=np.full(px4.times(5.0).size, amps))
    log = read(px4.ulog({"battery": silent}))
    assert log.batteries[0].current_A is None
    assert "current_not_measured" in codes(log)


@pytest.mark.parametrize(("celsius", "measured"), [(0.0, False), (np.nan, False), (31.0, True)])
def test_only_a_temperature_that_was_measured_is_one(
    celsius: float,
    measured: bool,  # noqa: FBT001
) -> None:
    kelvin = np.full(px4.times(5.0).size, celsius + 273.15)
    battery = read(px4.ulog({"battery": px4.pack(temperature_K=kelvin)})).batteries[0]
    if measured:
        np.testing.assert_allclose(battery.temperature_K, 304.15)
    else:
        assert battery.temperature_K is None


def test_cells_and_their_count_are_read() -> None:
    cells = np.tile([4.1, 4.0, 3.9, 3.8], (px4.times(5.0).size, 1))
    battery = read(px4.ulog({"battery": px4.pack(cell_voltage_V=cells)})).batteries[0]
    np.testing.assert_allclose(battery.cell_voltage_V, cells, rtol=FLOAT32)


def test_old_and_new_layouts_give_the_same_channels() -> None:
    t = px4.BOOT_S + px4.times(5.0)
    move = np.column_stack([np.sin(t), np.cos(t), 0 * t])
    lever = np.column_stack([0.1 + 0 * t, -0.2 + 0 * t, 0.3 + 0 * t, 0.75 + 0 * t])
    flat = dict(zip(("float vx", "float vy", "float vz"), move.T, strict=True))
    names = ("float roll", "float pitch", "float yaw", "float throttle")
    old_names = ("float y", "float x", "float r", "float z")
    new_lever = lever * [1, 1, 1, 2] - [0, 0, 0, 1]
    new = px4.ulog(
        {"setpoint": w.trajectory_setpoint(t, move)},
        more=[
            w.Topic(
                name="manual_control_setpoint",
                time_s=t,
                fields=dict(zip(names, new_lever.T, strict=True)),
            )
        ],
    )
    old = px4.ulog(
        {"setpoint": w.Topic(name="trajectory_setpoint", time_s=t, fields=flat)},
        more=[
            w.Topic(
                name="manual_control_setpoint",
                time_s=t,
                fields=dict(zip(old_names, lever.T, strict=True)),
            )
        ],
    )
    for log in (read(new), read(old)):
        assert log.velocity_setpoint_m_s is not None
        assert log.sticks is not None
        np.testing.assert_allclose(log.velocity_setpoint_m_s.values, move, atol=1e-6)
        np.testing.assert_allclose(log.sticks.values, lever, atol=1e-6)


def test_velocity_the_estimator_calls_invalid_is_unknown() -> None:
    position = px4.topics()["position"]
    valid = np.ones(px4.times(10.0).size, bool)
    valid[50:60] = False
    fields = dict(position.fields) | {"bool v_xy_valid": valid}
    log = read(px4.ulog({"position": replace(position, fields=fields)}))
    assert log.velocity_m_s is not None
    unknown = np.isnan(log.velocity_m_s.values)
    assert np.flatnonzero(unknown[:, 0]).tolist() == list(range(50, 60))
    assert not unknown[:, 2].any()


def test_setpoints_stay_nan_where_nothing_is_commanded() -> None:
    t = px4.times(5.0)
    command = np.column_stack([np.full(t.size, np.nan), np.full(t.size, np.nan), np.sin(t)])
    log = read(px4.ulog({"setpoint": w.trajectory_setpoint(px4.BOOT_S + t, command)}))
    assert log.velocity_setpoint_m_s is not None
    assert np.isnan(log.velocity_setpoint_m_s.values[:, :2]).all()
    assert np.isfinite(log.velocity_setpoint_m_s.values[:, 2]).all()


THRUSTS = {
    "vehicle_attitude_setpoint.thrust_body[2]": ("float[3] thrust_body", [0.0, 0.0, -1.0]),
    "vehicle_attitude_setpoint.thrust": ("float thrust", 1.0),
    "actuator_controls_0.control[3]": ("float[8] control", [0, 0, 0, 1.0, 0, 0, 0, 0]),
    "actuator_motors.control": ("float[12] control", [1.0] * 4 + [np.nan] * 8),
}


@pytest.mark.parametrize("source", THRUSTS)
def test_thrust_is_found_wherever_it_was_logged(source: str) -> None:
    key, pattern = THRUSTS[source]
    t = px4.times(10.0)
    level = np.where(px4.flying(t), 0.5, 0.1)
    values = level[:, None] * np.array(pattern) if "[" in key else level
    topic = w.Topic(name=source.split(".")[0], time_s=px4.BOOT_S + t, fields={key: values})
    log = read(px4.ulog({"thrust": None}, more=[topic]))
    assert log.thrust is not None
    assert log.thrust.source == source
    np.testing.assert_allclose(log.thrust.values, level, atol=1e-6)


@pytest.mark.parametrize(
    ("status", "parameters", "vehicle"),
    [
        ({"vehicle_type": 2}, {"SYS_AUTOSTART": 2100}, Vehicle.FIXED_WING),
        ({"vehicle_type": 1, "is_vtol": True}, {"SYS_AUTOSTART": 4001}, Vehicle.VTOL),
        ({"vehicle_type": 1}, {"MAV_TYPE": 21}, Vehicle.VTOL),
        ({"vehicle_type": 1}, {"MAV_TYPE": 4}, Vehicle.HELICOPTER),
        ({"vehicle_type": 1}, {"MAV_TYPE": 13}, Vehicle.MULTIROTOR),
        ({"vehicle_type": 1}, {}, Vehicle.MULTIROTOR),
        ({"vehicle_type": 0}, {"SYS_AUTOSTART": 16001}, Vehicle.HELICOPTER),
        ({"vehicle_type": 0}, {}, Vehicle.UNKNOWN),
    ],
)
def test_the_airframe_is_told_by_what_the_log_declares(
    status: dict[str, int], parameters: dict[str, float], vehicle: Vehicle
) -> None:
    topic = w.status([px4.BOOT_S], [True], [2], **status)  # type: ignore[arg-type]
    log = read(px4.ulog({"status": topic}, parameters=parameters))
    assert log.vehicle is vehicle
    assert bool(log.vehicle_label) == (vehicle is not Vehicle.UNKNOWN)


def test_the_old_field_of_vehicle_status_tells_a_multirotor() -> None:
    fields = {"uint8_t arming_state": 2, "bool is_rotary_wing": True}
    old = w.Topic(name="vehicle_status", time_s=[px4.BOOT_S], fields=fields)
    log = read(px4.ulog({"status": old}, parameters={}))
    assert (log.vehicle, log.vehicle_label) == (
        Vehicle.MULTIROTOR,
        "vehicle_status.is_rotary_wing",
    )


@pytest.mark.parametrize(
    ("info", "parameters"), [({"ver_hw": "PX4_SITL"}, {}), ({}, {"SYS_HITL": 1})]
)
def test_a_simulated_log_is_recognised(
    info: dict[str, str | int], parameters: dict[str, float]
) -> None:
    assert read(px4.ulog(info=info, parameters=parameters)).simulated


def test_a_value_from_before_the_log_is_no_sample_of_it() -> None:
    parts = px4.topics()
    old = w.Topic(
        name="trajectory_setpoint",
        time_s=np.concatenate([[px4.BOOT_S - 70], px4.BOOT_S + 10 + px4.times(5.0)[:50]]),
        fields={"float[3] velocity": 1.0},
        order_s=np.concatenate([[px4.BOOT_S], px4.BOOT_S + 10 + px4.times(5.0)[:50]]),
    )
    log = read(px4.ulog(parts | {"setpoint": old}))
    assert log.velocity_setpoint_m_s is not None
    assert log.velocity_setpoint_m_s.time_s[0] == pytest.approx(10.0, abs=1e-3)
    assert log.duration_s == pytest.approx(px4.END_S, abs=0.03)
    assert log.warnings == ()


def test_a_stray_stamp_does_not_stretch_the_log() -> None:
    landed = w.land_detected(
        px4.BOOT_S + np.array([0.0, px4.TAKE_OFF_S, px4.LANDING_S, 1194.0]),
        [True, False, True, True],
    )
    log = read(px4.ulog({"landed": landed}))
    assert log.duration_s == pytest.approx(px4.END_S, abs=0.03)
    assert "stray_stamps" in codes(log)


def test_no_ulog_is_no_ulog() -> None:
    with pytest.raises(NotALog):
        read(b"UL0g" + px4.ulog()[4:])
