"""What single topics of a PX4 log say, and do not say."""

import io

import numpy as np

from flightlogs.log import FlightLog
from flightlogs.read import read_log
from sample_logs import write_ulog as w
from tests.flightlogs import px4_flight as px4


def log(data: bytes) -> FlightLog:
    return read_log(io.BytesIO(data), name="test.ulg")


def test_packs_are_told_by_the_battery_info_with_their_id() -> None:
    """Whatever instance it has; where only the other pack's is there, this one has no serial."""
    second = px4.other_pack(12.0, 16.0)
    both = log(px4.ulog(more=[second, info(0, 2, "SNB"), info(1, 1, "SNA")]))
    assert [b.serial for b in both.batteries] == ["SNA", "SNB"]
    only = log(px4.ulog(more=[second, info(0, 2, "SNB")]))
    assert [b.serial for b in only.batteries] == ["", "SNB"]


def test_zeros_of_an_old_altitude_mode_command_no_standstill() -> None:
    """Firmware until 1.7 writes 0 for the velocity that it leaves to the pilot."""
    t = px4.times(5.0)
    wanted = np.column_stack([0 * t, 0 * t, -0.5 + 0 * t])
    for nav_state, left in ((1, True), (2, False)):
        mode = w.status(px4.BOOT_S + px4.times(2.0), np.ones(px4.times(2.0).size, bool), nav_state)
        setpoint = w.trajectory_setpoint(px4.BOOT_S + t, wanted)
        got = log(px4.ulog({"status": mode, "setpoint": setpoint})).velocity_setpoint_m_s
        assert got is not None
        assert np.isnan(got.values[5:, :2]).all() == left
        assert np.isfinite(got.values[5:, 2]).all()


def info(instance: int, number: int, serial: str) -> w.Topic:
    code = np.frombuffer(serial.encode().ljust(32, b"\0"), dtype=np.uint8)
    fields = {"uint8_t id": number, "char[32] serial_number": code[None, :]}
    return w.Topic(
        name="battery_info", time_s=np.array([px4.BOOT_S]), fields=fields, instance=instance
    )
