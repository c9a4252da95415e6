"""State of a vehicle in MAVLink telemetry: armed, in the air, its modes, simulated or not."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flightlogs import ardupilot
from flightlogs.errors import LogWarning
from flightlogs.log import Channel, FloatArray, Interval, ModeSpan
from flightlogs.mavlink_vehicle import PX4, heartbeat_mode
from flightlogs.spans import IN_AIR_THROTTLE, flying_by_throttle, mode_spans, overlap, spans_of
from flightlogs.stamps import FileClock
from flightlogs.table import RawLog, Table

SIMULATION = ("SIMSTATE", "SIM_STATE", "HIL_STATE_QUATERNION", "HIL_ACTUATOR_CONTROLS")
ARMED_BIT, HIL_BIT = 128, 32
LANDED_UNKNOWN, ON_GROUND = 0, 1
SHORT_S = 60.0  # in which nobody lands, changes the pack and takes off
SILENCE_S = 10.0  # without a heartbeat (1 Hz) the link is lost and the state unknown


@dataclass(frozen=True, slots=True)
class Flown:
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
class Telemetry:
    """Decoded packets of one vehicle, with their times."""

    raw: RawLog
    timed: Mapping[str, tuple[Table, FloatArray]]
    clock: FileClock
    vehicle: Flown
    parameters: Mapping[str, float]

    @property
    def end_s(self) -> float:
        """Time of the last packet [s]."""
        return float(np.nanmax(self.clock.time_s) - np.nanmin(self.clock.time_s))


def is_simulated(log: Telemetry, texts: tuple[str, ...]) -> bool:
    """True for HIL and for SITL, by the messages and parameters only a simulation has."""
    hil = log.timed["HEARTBEAT"][0].numbers["base_mode"].astype(int) & HIL_BIT
    said = any(name in log.timed for name in SIMULATION)
    sitl = log.vehicle.autopilot != PX4 and ardupilot.is_simulated(log.parameters, texts)
    return bool(hil.any()) or said or sitl


def version(log: Telemetry) -> str:
    """Firmware from AUTOPILOT_VERSION, e.g. `PX4 1.14.0`; the maker alone without it."""
    maker = "PX4" if log.vehicle.autopilot == PX4 else ""
    if "AUTOPILOT_VERSION" not in log.timed:
        return maker
    packed = int(log.timed["AUTOPILOT_VERSION"][0].numbers["flight_sw_version"][-1])
    number = ".".join(str(packed >> shift & 0xFF) for shift in (24, 16, 8))
    return f"{maker} {number}".strip() if packed else maker


def _heartbeats(log: Telemetry) -> tuple[Table, FloatArray]:
    return log.timed["HEARTBEAT"]


def armed_spans(log: Telemetry) -> tuple[Interval, ...]:
    """Spans of the armed bit; unknown, hence not armed, when heartbeats stay away.

    But not where it is armed before and after SHORT_S or less.
    """
    table, time_s = _heartbeats(log)
    armed = table.numbers["base_mode"].astype(int) & ARMED_BIT > 0
    away_s = np.diff(time_s)
    going_on = armed[:-1] & armed[1:] & (away_s <= SHORT_S)
    silent = np.flatnonzero((away_s > SILENCE_S) & ~going_on)
    times = np.insert(time_s, silent + 1, time_s[silent])
    return spans_of(times, np.insert(armed, silent + 1, values=False), log.end_s)


def modes(log: Telemetry) -> tuple[ModeSpan, ...]:
    """Modes by the heartbeats."""
    table, time_s = _heartbeats(log)
    who = log.vehicle
    custom = table.numbers["custom_mode"].astype(int).tolist()
    names = [heartbeat_mode(who.autopilot, who.mav_type, mode) for mode in custom]
    return mode_spans(time_s, names, log.end_s)


def in_air_spans(
    log: Telemetry, armed: tuple[Interval, ...], thrust: Channel | None
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
