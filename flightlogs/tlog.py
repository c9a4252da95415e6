"""MAVLink telemetry (`.tlog`) -> `FlightLog`.

message                               what is taken from it
BATTERY_STATUS, SYS_STATUS            batteries (tlog_battery.py)
LOCAL_POSITION_NED, GLOBAL_POSITION_INT, POSITION_TARGET_*, RC_CHANNELS*, MANUAL_CONTROL,
VFR_HUD                               motion (tlog_motion.py)
HEARTBEAT                             vehicle, armed, modes
EXTENDED_SYS_STATE                    in air
STATUSTEXT, AUTOPILOT_VERSION         firmware
PARAM_VALUE, SYSTEM_TIME              parameters, UTC of a stream without stamps
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import BinaryIO

import numpy as np

from flightlogs import ardupilot, tlog_motion
from flightlogs.errors import LogDamaged, LogWarning, NotALog
from flightlogs.log import Channel, FlightLog, FloatArray, Interval, ModeSpan, Vehicle
from flightlogs.mavlink_vehicle import (
    NO_AUTOPILOT,
    NO_VEHICLE,
    PX4,
    heartbeat_mode,
    type_name,
    vehicle_of_type,
)
from flightlogs.measured import battery_log
from flightlogs.spans import (
    IN_AIR_THROTTLE,
    flying_by_throttle,
    mode_spans,
    overlap,
    spans_of,
)
from flightlogs.stamps import FileClock, file_clock
from flightlogs.table import RawLog, Table
from flightlogs.tlog_battery import raw_batteries
from flightlogs.tlog_packets import STAMP_COLUMN, SYSTEM, read_packets, stamp_bytes
from flightlogs.utc import utc_at

BATTERY = ("BATTERY_STATUS", "SYS_STATUS", "BATTERY_INFO", "SMART_BATTERY_INFO")
MOTION = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "VFR_HUD", "RC_CHANNELS", "RC_CHANNELS_RAW")
TARGETS = ("POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT", "MANUAL_CONTROL")
STATE = ("HEARTBEAT", "EXTENDED_SYS_STATE", "STATUSTEXT", "AUTOPILOT_VERSION", "PARAM_VALUE")
SIMULATION = ("SIMSTATE", "SIM_STATE", "HIL_STATE_QUATERNION", "HIL_ACTUATOR_CONTROLS")
WANTED = frozenset([*BATTERY, *MOTION, *TARGETS, *STATE, *SIMULATION, "SYSTEM_TIME"])
FROM_STATION = frozenset(["MANUAL_CONTROL"])  # sent to the vehicle
MICRO, MILLI = 1e-6, 1e-3
ARMED_BIT, HIL_BIT = 128, 32
LANDED_UNKNOWN, ON_GROUND = 0, 1
SILENCE_S = 10.0  # without a heartbeat (1 Hz) the link is lost and the state unknown
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
    return _flight_log(_Decoded(raw, timed, clock, vehicle, _parameters(timed, vehicle)), name)


@dataclass(frozen=True, slots=True)
class _Choice:
    """The vehicle a log is read for.

    Attributes:
        system: MAVLink system id.
        autopilot: MAV_AUTOPILOT.
        mav_type: MAV_TYPE.
        others: system ids of other vehicles in the log.
    """

    system: int
    autopilot: int
    mav_type: int
    others: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Decoded:
    raw: RawLog
    timed: Mapping[str, tuple[Table, FloatArray]]
    clock: FileClock
    vehicle: _Choice
    parameters: Mapping[str, float]

    @property
    def end_s(self) -> float:
        return float(np.nanmax(self.clock.time_s) - np.nanmin(self.clock.time_s))


def _vehicles(heartbeats: Table) -> Table:
    """Heartbeats of vehicles: no ground stations, cameras, gimbals."""
    kinds = heartbeats.numbers["type"]
    rows = (heartbeats.numbers["autopilot"] != NO_AUTOPILOT) & ~np.isin(kinds, list(NO_VEHICLE))
    return heartbeats.select(rows)


def _choose(raw: RawLog, name: str) -> _Choice:
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
    return _Choice(
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


def _flight_log(log: _Decoded, name: str) -> FlightLog:
    timed, who = log.timed, log.vehicle
    texts = timed["STATUSTEXT"][0].texts["text"] if "STATUSTEXT" in timed else ()
    identity = ardupilot.identify(texts, log.parameters)
    kind = vehicle_of_type(who.mav_type)
    thrust = tlog_motion.thrust(timed)
    armed = _armed(log)
    in_air, air_warnings = _in_air(log, armed, thrust)
    judged = [battery_log(b, i) for i, b in enumerate(raw_batteries(timed, log.parameters))]
    said = (*log.clock.warnings(), *log.raw.warnings(), *_others(who), *air_warnings)
    return FlightLog(
        name=name,
        format="tlog",
        firmware=identity.firmware or _version(log),
        hardware=identity.hardware,
        vehicle=identity.vehicle if kind is Vehicle.UNKNOWN else kind,
        vehicle_label=type_name(who.mav_type),
        simulated=_simulated(log, texts),
        start_utc=_start_utc(log),
        duration_s=log.end_s,
        batteries=tuple(battery for battery, _ in judged),
        velocity_m_s=tlog_motion.velocity(timed),
        velocity_setpoint_m_s=tlog_motion.velocity_setpoint(timed),
        position_setpoint_m=tlog_motion.position_setpoint(timed),
        sticks=tlog_motion.sticks(timed, log.parameters),
        thrust=thrust,
        altitude_m=tlog_motion.altitude(timed),
        modes=_modes(log),
        armed=armed,
        in_air=in_air,
        parameters=ardupilot.kept_parameters(log.parameters),
        recovered_fraction=log.raw.recovered_fraction,
        warnings=(*said, *(w for _, found in judged for w in found)),
    )


def _others(who: _Choice) -> tuple[LogWarning, ...]:
    if not who.others:
        return ()
    systems = ", ".join(str(s) for s in who.others)
    message = f"read for system {who.system}; the log also has vehicles of system {systems}"
    return (LogWarning("several_vehicles", message, "HEARTBEAT"),)


def _parameters(timed: Mapping[str, tuple[Table, FloatArray]], who: _Choice) -> Mapping[str, float]:
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


def _version(log: _Decoded) -> str:
    maker = "PX4" if log.vehicle.autopilot == PX4 else ""
    if "AUTOPILOT_VERSION" not in log.timed:
        return maker
    packed = int(log.timed["AUTOPILOT_VERSION"][0].numbers["flight_sw_version"][-1])
    number = ".".join(str(packed >> shift & 0xFF) for shift in (24, 16, 8))
    return f"{maker} {number}".strip() if packed else maker


def _simulated(log: _Decoded, texts: tuple[str, ...]) -> bool:
    hil = log.timed["HEARTBEAT"][0].numbers["base_mode"].astype(int) & HIL_BIT
    said = any(name in log.timed for name in SIMULATION)
    sitl = log.vehicle.autopilot != PX4 and ardupilot.is_simulated(log.parameters, texts)
    return bool(hil.any()) or said or sitl


def _start_utc(log: _Decoded) -> datetime | None:
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


def _heartbeats(log: _Decoded) -> tuple[Table, FloatArray]:
    return log.timed["HEARTBEAT"]


def _armed(log: _Decoded) -> tuple[Interval, ...]:
    """Spans of the armed bit; unknown, hence not armed, when heartbeats stay away."""
    table, time_s = _heartbeats(log)
    armed = table.numbers["base_mode"].astype(int) & ARMED_BIT > 0
    silent = np.flatnonzero(np.diff(time_s) > SILENCE_S)
    times = np.insert(time_s, silent + 1, time_s[silent])
    return spans_of(times, np.insert(armed, silent + 1, values=False), log.end_s)


def _modes(log: _Decoded) -> tuple[ModeSpan, ...]:
    table, time_s = _heartbeats(log)
    who = log.vehicle
    custom = table.numbers["custom_mode"].astype(int).tolist()
    names = [heartbeat_mode(who.autopilot, who.mav_type, mode) for mode in custom]
    return mode_spans(time_s, names, log.end_s)


def _in_air(
    log: _Decoded, armed: tuple[Interval, ...], thrust: Channel | None
) -> tuple[tuple[Interval, ...] | None, tuple[LogWarning, ...]]:
    """By the landed state; without it by throttle while armed."""
    if "EXTENDED_SYS_STATE" in log.timed:
        table, time_s = log.timed["EXTENDED_SYS_STATE"]
        state = table.numbers["landed_state"]
        known = state != LANDED_UNKNOWN
        if known.any():
            return spans_of(time_s[known], state[known] != ON_GROUND, log.end_s), ()
    if thrust is None:
        return None, ()
    flying = flying_by_throttle(thrust.time_s, thrust.values, IN_AIR_THROTTLE, log.end_s)
    message = f"no landed state: judged by throttle above {IN_AIR_THROTTLE:.0%} while armed"
    return overlap(flying, armed), (LogWarning("in_air_inferred", message, thrust.source),)
