"""A short PX4 flight as ULog bytes, built from plain arrays; the tests bend single parts of it."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from sample_logs import write_ulog as w
from sample_logs.pack_trace import PackTrace

BOOT_S = 100.0  # the log starts this long after boot
TAKE_OFF_S, LANDING_S, END_S = 5.0, 45.0, 50.0
CELLS, RESISTANCE_OHM, CAPACITY_MAH = 4, 0.030, 5000.0
INFO = {"ver_hw": "TEST_BOARD", "ver_sw_release": 0x010E00FF, "sys_name": "PX4"}
PARAMETERS = {"SYS_AUTOSTART": 4001, "MAV_TYPE": 2, "BAT1_CAPACITY": CAPACITY_MAH}
UNIX_S = 1_700_000_000.0


def times(rate_hz: float, start_s: float = 0.0, stop_s: float = END_S) -> npt.NDArray[np.float64]:
    """Sample times since the start of the log."""
    return np.arange(start_s, stop_s, 1 / rate_hz)


def flying(t: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    return (t >= TAKE_OFF_S) & (t < LANDING_S)


def current(t: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """0.5 A on the ground, 15 A with manoeuvres in flight."""
    return np.where(flying(t), 15 + 3 * np.sin(1.3 * t) + np.sin(0.31 * t), 0.5)


def trace(t: npt.NDArray[np.float64]) -> PackTrace:
    amps = current(t)
    charge = np.concatenate([[0.0], np.cumsum((amps[1:] + amps[:-1]) / 2 * np.diff(t))])
    volts = 16.4 - RESISTANCE_OHM * amps - charge / 5000
    return PackTrace(time_s=BOOT_S + t, voltage_V=volts, current_A=amps, charge_C=900 + charge)


def pack(**changes: object) -> w.Topic:
    """battery_status[0]; `changes` replace fields of its trace."""
    return w.battery(replace(trace(times(5.0)), **changes), cells=CELLS)  # type: ignore[arg-type]


def other_pack(amps: float, volts: float) -> w.Topic:
    t = times(5.0)
    steady = PackTrace(
        time_s=BOOT_S + t,
        voltage_V=np.full(t.size, volts),
        current_A=amps + 0.01 * np.sin(t),
        charge_C=amps * t,
    )
    return w.battery(steady, instance=1, cells=round(volts / 4))


def topics() -> dict[str, w.Topic]:
    """The parts of the flight by name."""
    t10, t50 = times(10.0), times(50.0)
    climb = np.where((t10 > 5) & (t10 < 8), -1.0, np.where((t10 > 42) & (t10 < 45), 1.0, 0.0))
    ned = np.column_stack([0 * t10, 0 * t10, climb])
    down = np.concatenate([[0.0], np.cumsum(climb[:-1]) * 0.1])
    thrust = np.where(flying(t50), 0.4 + 0.08 * np.sin(1.3 * t50), 0.02)
    return {
        "battery": pack(),
        "position": w.local_position(BOOT_S + t10, np.column_stack([0 * t10, 0 * t10, down]), ned),
        "setpoint": w.trajectory_setpoint(BOOT_S + times(5.0), np.zeros((times(5.0).size, 3))),
        "thrust": w.thrust(BOOT_S + t50, thrust),
        "landed": w.land_detected(
            BOOT_S + np.array([0.0, TAKE_OFF_S, LANDING_S]), [True, False, True]
        ),
        "status": w.status(BOOT_S + times(2.0), np.ones(times(2.0).size, bool), 2),
        "gps": w.gps(BOOT_S + times(5.0), UNIX_S + times(5.0)),
    }


def ulog(
    changed: Mapping[str, w.Topic | None] | None = None,
    *,
    more: Sequence[w.Topic] = (),
    extras: w.Extras | None = None,
    parameters: Mapping[str, float] = PARAMETERS,
    info: Mapping[str, str | int] = INFO,
) -> bytes:
    """The flight as a file; `changed` replaces parts, None leaves one out."""
    parts = topics() | dict(changed or {})
    extras = replace(extras or w.Extras(), info=info, parameters=dict(parameters))
    out = io.BytesIO()
    w.write_ulog(
        out, [t for t in parts.values() if t is not None] + [*more], extras, start_s=BOOT_S
    )
    return out.getvalue()
