"""A flown sample as the files of an autopilot, a ground station and a current sensor."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from flightlogs.log import Interval
from sample_logs import write_dataflash, write_tlog, write_ulog
from sample_logs.flown import Flown
from sample_logs.instruments import SensorFlaws, sensor

FloatArray = npt.NDArray[np.float64]

START_UNIX_s = 1778578200.0  # 2026-05-12 09:30 UTC
BOOT_s = 63.2  # the log starts this long after the autopilot
FIRST_STAMP_ms = 812
AUTO_TAKEOFF, POSCTL, AUTO_LAND = "AUTO_TAKEOFF", "POSCTL", "AUTO_LAND"


def _inside(time_s: FloatArray, spans: Sequence[Interval]) -> npt.NDArray[np.bool_]:
    out = np.zeros(time_s.size, dtype=bool)
    for span in spans:
        out |= (time_s >= span.start_s) & (time_s < span.stop_s)
    return out


def ulog(flown: Flown, path: Path, besides: Sequence[write_ulog.Topic] = ()) -> None:
    """As PX4 1.15 logs it: battery at 5 Hz, motion at 10 Hz; and the topics `besides`."""
    seen = flown.seen(0.2, 0.1)
    t, slow = seen.motion_time_s, np.arange(0.0, seen.motion_time_s[-1], 0.5)
    numbers = {AUTO_TAKEOFF: 17, POSCTL: 2, AUTO_LAND: 18}
    down_s = np.concatenate([[0.0], [e for s in seen.in_air for e in (s.start_s, s.stop_s)]])
    topics = [
        write_ulog.battery(flown.trace(seen, BOOT_s), cells=flown.sample.airframe.series),
        write_ulog.local_position(BOOT_s + t, seen.position_m, seen.velocity_m_s),
        write_ulog.trajectory_setpoint(BOOT_s + t, seen.velocity_setpoint_m_s),
        write_ulog.thrust(BOOT_s + t, seen.thrust),
        write_ulog.land_detected(BOOT_s + down_s, np.arange(down_s.size) % 2 == 0),
        write_ulog.status(BOOT_s + slow, _inside(slow, seen.armed), flown.mode_at(slow, numbers)),
        write_ulog.gps(BOOT_s + slow[::2], START_UNIX_s + slow[::2]),
        *besides,
    ]
    extras = write_ulog.Extras(
        info={"sys_name": "PX4", "ver_hw": "SYNTHETIC", "ver_sw_release": 0x010F00FF},
        parameters={
            "SYS_AUTOSTART": 4001,
            "MAV_TYPE": 2,
            "CA_ROTOR_COUNT": 4,
            "BAT1_N_CELLS": flown.sample.airframe.series,
            "BAT1_CAPACITY": flown.sample.airframe.capacity_C / 3.6,
        },
    )
    write_ulog.write_ulog(path, topics, extras, start_s=BOOT_s)


def tlog(flown: Flown, path: Path) -> None:
    """As a ground station records it: battery at 2 Hz, motion at 5 Hz, state at 1 Hz."""
    seen = flown.seen(0.5, 0.2)
    t, slow = seen.motion_time_s, np.arange(0.0, seen.motion_time_s[-1], 1.0)
    numbers = {AUTO_TAKEOFF: 4 << 16 | 2 << 24, POSCTL: 3 << 16, AUTO_LAND: 4 << 16 | 6 << 24}
    streams = [
        write_tlog.heartbeat(slow, _inside(slow, seen.armed), flown.mode_at(slow, numbers)),
        write_tlog.extended_state(slow, 1 + _inside(slow, seen.in_air)),
        write_tlog.battery_status(flown.trace(seen, 0.0)),
        write_tlog.local_position(t, seen.position_m, seen.velocity_m_s),
        write_tlog.velocity_target(t, seen.velocity_setpoint_m_s),
        write_tlog.system_time(slow, START_UNIX_s),
        write_tlog.parameter(0.0, "BAT1_CAPACITY", flown.sample.airframe.capacity_C / 3.6),
        write_tlog.parameter(0.0, "BAT1_N_CELLS", flown.sample.airframe.series),
    ]
    write_tlog.write_tlog(path, streams, start_unix_s=START_UNIX_s)


def dataflash(flown: Flown, path: Path) -> None:
    """As ArduCopter 4.5 logs it: battery and motion at 10 Hz."""
    seen = flown.seen(0.1, 0.1)
    t, velocity = seen.motion_time_s, seen.velocity_m_s
    boot = BOOT_s + t
    numbers = {AUTO_TAKEOFF: 4, POSCTL: 5, AUTO_LAND: 9}  # GUIDED, LOITER, LAND
    armed, air = seen.armed[0], seen.in_air[0]
    events_s = np.array([armed.start_s, air.start_s, air.stop_s, armed.stop_s])
    order = np.argsort(events_s, kind="stable")
    wanted = seen.velocity_setpoint_m_s
    tables = [
        write_dataflash.parameters(
            {"BATT_CAPACITY": flown.sample.airframe.capacity_C / 3.6, "FRAME_CLASS": 1.0}
        ),
        write_dataflash.texts(boot[:1], ["ArduCopter V4.5.7 (2a3dc4b7)"]),
        write_dataflash.battery(flown.trace(seen, BOOT_s)),
        write_dataflash.velocity(boot, velocity),
        *write_dataflash.velocity_setpoint(boot, np.nan_to_num(wanted), velocity),
        write_dataflash.control(
            boot, seen.thrust, -seen.position_m[:, 2], -velocity[:, 2], -np.nan_to_num(wanted[:, 2])
        ),
        write_dataflash.events(BOOT_s + events_s[order], np.array([10, 28, 18, 11])[order]),
        write_dataflash.modes(
            BOOT_s + np.array([m.start_s for m in flown.flight.modes]),
            [numbers[m.name] for m in flown.flight.modes],
        ),
        write_dataflash.utc(boot[::10], START_UNIX_s + t[::10]),
    ]
    write_dataflash.write_dataflash(path, tables)


def sensor_csv(flown: Flown, flaws: SensorFlaws, path: Path) -> None:
    """As the current sensor writes it: milliseconds of its own clock, amperes."""
    samples = sensor(flown.flight, flaws, seed=flown.sample.seed)
    stamps = FIRST_STAMP_ms + np.rint(samples.time_s * 1e3).astype(np.int64)
    rows = zip(stamps.tolist(), samples.current_A.tolist(), strict=True)
    path.write_text("time_ms,current_A\n" + "".join(f"{t},{i:.3f}\n" for t, i in rows))
