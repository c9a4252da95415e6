"""A flight of one minute as a DataFlash log, and how the tests of its reader write and read it."""

import io
from functools import cache

import numpy as np

from flightlogs.dataflash import read_dataflash
from flightlogs.log import FlightLog
from sample_logs import write_dataflash as w
from sample_logs.pack_trace import PackTrace

BOOT_S = 20.0  # of the first sample, since boot
UNIX_S = 1_700_000_000.0  # of the first sample
DURATION_S = 60.0
FIRMWARE = "ArduCopter V4.5.7 (2a3dc4b7)"
SINGLE = 2e-7  # rounding of a 32-bit float, relative

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
