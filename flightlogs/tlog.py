"""MAVLink telemetry (`.tlog`) -> `FlightLog`.

message                               what is taken from it
BATTERY_STATUS, SYS_STATUS            batteries (tlog_battery.py)
LOCAL_POSITION_NED, GLOBAL_POSITION_INT, POSITION_TARGET_*, RC_CHANNELS*, MANUAL_CONTROL,
VFR_HUD                               motion (tlog_motion.py)
HEARTBEAT                             vehicle, armed, modes
EXTENDED_SYS_STATE                    in air
STATUSTEXT, AUTOPILOT_VERSION         firmware
PARAM_VALUE, SYSTEM_TIME              parameters, UTC of a stream without stamps
SCALED_PRESSURE                       how cold the board was
"""

import math
from collections.abc import Mapping
from datetime import datetime
from typing import BinaryIO

import numpy as np

from flightlogs import ardupilot, tlog_motion
from flightlogs.board import coldest_K
from flightlogs.errors import LogDamaged, LogWarning, NotALog
from flightlogs.log import FlightLog, FloatArray, Vehicle
from flightlogs.mavlink_vehicle import NO_AUTOPILOT, NO_VEHICLE, PX4, type_name, vehicle_of_type
from flightlogs.measured import battery_log
from flightlogs.stamps import FileClock, file_clock
from flightlogs.table import RawLog, Table
from flightlogs.tlog_battery import raw_batteries
from flightlogs.tlog_packets import STAMP_COLUMN, SYSTEM, read_packets, stamp_bytes
from flightlogs.tlog_state import (
    ARMED_BIT,
    SIMULATION,
    Flown,
    Telemetry,
    armed_spans,
    in_air_spans,
    is_simulated,
    modes,
    version,
)
from flightlogs.utc import utc_at

BATTERY = ("BATTERY_STATUS", "SYS_STATUS", "BATTERY_INFO", "SMART_BATTERY_INFO")
MOTION = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "VFR_HUD", "RC_CHANNELS", "RC_CHANNELS_RAW")
TARGETS = ("POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT", "MANUAL_CONTROL")
STATE = ("HEARTBEAT", "EXTENDED_SYS_STATE", "STATUSTEXT", "AUTOPILOT_VERSION", "PARAM_VALUE")
WANTED = frozenset(
    [*BATTERY, *MOTION, *TARGETS, *STATE, *SIMULATION, "SYSTEM_TIME", "SCALED_PRESSURE"]
)
FROM_STATION = frozenset(["MANUAL_CONTROL"])  # sent to the vehicle
MICRO, MILLI, CENTI = 1e-6, 1e-3, 1e-2
INTEGER_PARAMETERS = range(1, 9)  # MAV_PARAM_TYPE_UINT8 to INT64


def read_tlog(stream: BinaryIO, *, name: str) -> FlightLog:
    """Read telemetry, with the ground station's time stamps or without.

    Args:
        stream: the file, read to its end.
        name: for messages.

    Raises:
        NotALog: no MAVLink 1 or 2 packet with a right checksum near its beginning.
        LogDamaged: packets, but none of a vehicle that can be placed in time.
    """
    data = stream.read()
    gap = stamp_bytes(data)
    if gap is None:
        raise NotALog(f"{name}: no MAVLink packet with a right checksum; expected a .tlog")
    raw = read_packets(data, gap, WANTED.__contains__)
    vehicle = _choose(raw, name)
    clock = _clock(raw, vehicle.system, stamped=gap > 0)
    if not np.isfinite(clock.time_s).any():
        raise LogDamaged(
            f"{name}: {raw.recovered_fraction:.0%} of it are MAVLink packets, but nothing that "
            "can be placed in time"
        )
    start_s = float(np.nanmin(clock.time_s))
    timed = {
        key: (own, clock.at(own.offset) - start_s)
        for key, table in raw.tables.items()
        if len(own := _of(table, vehicle.system))
    }
    return _flight_log(Telemetry(raw, timed, clock, vehicle, _parameters(timed, vehicle)), name)


def _vehicles(heartbeats: Table) -> Table:
    """Heartbeats of vehicles: no ground stations, cameras, gimbals."""
    kinds = heartbeats.numbers["type"]
    rows = (heartbeats.numbers["autopilot"] != NO_AUTOPILOT) & ~np.isin(kinds, list(NO_VEHICLE))
    return heartbeats.select(rows)


def _choose(raw: RawLog, name: str) -> Flown:
    """The vehicle that is armed for longest, else the one heard most."""
    heard = _vehicles(raw.tables["HEARTBEAT"]) if "HEARTBEAT" in raw.tables else None
    if heard is None or not len(heard):
        raise LogDamaged(f"{name}: MAVLink packets, but no heartbeat of a vehicle among them")
    systems = heard.numbers[SYSTEM].astype(int)
    armed = heard.numbers["base_mode"].astype(int) & ARMED_BIT > 0
    ranked = sorted(
        dict.fromkeys(systems.tolist()),
        key=lambda s: (int(armed[systems == s].sum()), int((systems == s).sum())),
    )
    first = int(np.flatnonzero(systems == ranked[-1])[0])
    return Flown(
        system=ranked[-1],
        autopilot=int(heard.numbers["autopilot"][first]),
        mav_type=int(heard.numbers["type"][first]),
        others=tuple(ranked[:-1]),
    )


def _of(table: Table, system: int) -> Table:
    if table.name in FROM_STATION:
        return table.select(table.numbers["target"] == system)
    own = table.select(table.numbers[SYSTEM] == system)
    return _vehicles(own) if table.name == "HEARTBEAT" else own


def _clock(raw: RawLog, system: int, *, stamped: bool) -> FileClock:
    """The ground station's stamps; of a bare stream, the boot time the vehicle's messages carry."""
    if stamped:
        every = {k: (t.offset, t.numbers[STAMP_COLUMN] * MICRO) for k, t in raw.tables.items()}
        return file_clock(every)
    own = {k: _of(t, system) for k, t in raw.tables.items() if "time_boot_ms" in t.numbers}
    boot = {k: (t.offset, t.numbers["time_boot_ms"] * MILLI) for k, t in own.items()}
    reason = "the time since boot that some of its messages carry"
    return file_clock(boot, reconstructed_from=reason)


def _flight_log(log: Telemetry, name: str) -> FlightLog:
    timed, who = log.timed, log.vehicle
    texts = timed["STATUSTEXT"][0].texts["text"] if "STATUSTEXT" in timed else ()
    identity = ardupilot.identify(texts, log.parameters)
    kind = vehicle_of_type(who.mav_type)
    thrust = tlog_motion.thrust(timed)
    armed = armed_spans(log)
    in_air, air_warnings = in_air_spans(log, armed, thrust)
    judged = [battery_log(b, i) for i, b in enumerate(raw_batteries(timed, log.parameters))]
    said = (*log.clock.warnings(), *log.raw.warnings(), *_others(who), *air_warnings)
    return FlightLog(
        name=name,
        format="tlog",
        firmware=identity.firmware or version(log),
        hardware=identity.hardware,
        vehicle=identity.vehicle if kind is Vehicle.UNKNOWN else kind,
        vehicle_label=type_name(who.mav_type),
        simulated=is_simulated(log, texts),
        start_utc=_start_utc(log),
        duration_s=log.end_s,
        batteries=tuple(battery for battery, _ in judged),
        velocity_m_s=tlog_motion.velocity(timed),
        velocity_setpoint_m_s=tlog_motion.velocity_setpoint(timed),
        position_setpoint_m=tlog_motion.position_setpoint(timed) if who.autopilot == PX4 else None,
        sticks=tlog_motion.sticks(timed, log.parameters),
        thrust=thrust,
        altitude_m=tlog_motion.altitude(timed),
        board_K=_board_K(timed),
        modes=modes(log),
        armed=armed,
        in_air=in_air,
        parameters=ardupilot.kept_parameters(log.parameters),
        recovered_fraction=log.raw.recovered_fraction,
        warnings=(*said, *(w for _, found in judged for w in found)),
    )


def _board_K(timed: Mapping[str, tuple[Table, FloatArray]]) -> float | None:
    if "SCALED_PRESSURE" not in timed:
        return None
    return coldest_K(timed["SCALED_PRESSURE"][0].numbers["temperature"] * CENTI)


def _others(who: Flown) -> tuple[LogWarning, ...]:
    if not who.others:
        return ()
    systems = ", ".join(str(s) for s in who.others)
    message = f"read for system {who.system}; the log also has vehicles of system {systems}"
    return (LogWarning("several_vehicles", message, "HEARTBEAT"),)


def _parameters(timed: Mapping[str, tuple[Table, FloatArray]], who: Flown) -> Mapping[str, float]:
    """Parameter values; PX4 sends an integer as its bits, ArduPilot as its value."""
    if "PARAM_VALUE" not in timed:
        return {}
    table = timed["PARAM_VALUE"][0]
    values = table.numbers["param_value"]
    if who.autopilot == PX4:
        integer = np.isin(table.numbers["param_type"], INTEGER_PARAMETERS)
        bits = values.astype(np.float32).view(np.int32).astype(np.float64)
        values = np.where(integer, bits, values)
    pairs = zip(table.texts["param_id"], values.tolist(), strict=True)
    return {name: value for name, value in pairs if math.isfinite(value)}


def _start_utc(log: Telemetry) -> datetime | None:
    """UTC of time zero: the first stamp, else SYSTEM_TIME."""
    if not log.clock.reconstructed_from:
        return utc_at(float(np.nanmin(log.clock.time_s)))
    if "SYSTEM_TIME" not in log.timed:
        return None
    table, time_s = log.timed["SYSTEM_TIME"]
    set_ = np.flatnonzero(table.numbers["time_unix_usec"] > 0)
    if not set_.size:
        return None
    unix_s = table.numbers["time_unix_usec"][set_[0]] * MICRO
    return utc_at(float(unix_s - time_s[set_[0]]))
