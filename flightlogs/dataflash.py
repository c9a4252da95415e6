"""ArduPilot DataFlash logs, binary (`.bin`) and text (`.log`) -> `FlightLog`.

message                 what is taken from it
BAT, CURR, CUR2, BCL    batteries (dataflash_battery.py)
XKF1, NKF1, EKF1, GPS   velocity (dataflash_motion.py, also the next three)
PSCN/E/D, PSC, NTUN     commanded velocity
CTUN                    throttle, altitude, commanded climb rate
BARO                    altitude, how cold the board was
RCIN, RCOU, MOTB        sticks, motor outputs
EV, ARM                 armed and in-air spans
MODE, MSG, VER, PARM    modes, firmware, parameters
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import BinaryIO

import numpy as np

from flightlogs import ardupilot, dataflash_motion
from flightlogs.ardupilot import Identity
from flightlogs.board import coldest_K
from flightlogs.dataflash_battery import raw_batteries
from flightlogs.dataflash_binary import is_binary, read_binary
from flightlogs.dataflash_flight import armed_spans, in_air_spans
from flightlogs.dataflash_text import is_text, read_text
from flightlogs.dataflash_time import NOT_DATA, Timed, end_s, timed_tables
from flightlogs.errors import LogDamaged, LogWarning, NotALog
from flightlogs.log import Channel, FlightLog, FloatArray, ModeSpan
from flightlogs.measured import battery_log
from flightlogs.spans import mode_spans
from flightlogs.stamps import FileClock
from flightlogs.table import RawLog
from flightlogs.utc import utc_at

BATTERY = ("BAT", "BAT2", "CURR", "CUR2", "BCL", "BCL2")
MOTION = ("XKF1", "NKF1", "EKF1", "GPS", "PSCN", "PSCE", "PSCD", "PSC", "NTUN", "CTUN", "BARO")
INPUTS = ("RCIN", "RCOU", "MOTB")
EVENTS = ("EV", "ARM", "MODE", "MSG", "VER", "PARM", "TIME", "PM", "DSF")
WANTED = frozenset([*BATTERY, *MOTION, *INPUTS, *EVENTS])
CLOCKS = frozenset(["TimeUS", "TimeMS"])


def read_dataflash(stream: BinaryIO, *, name: str) -> FlightLog:
    """Read an ArduPilot log, whichever of its two forms it has.

    Args:
        stream: the file, read to its end.
        name: for messages.

    Raises:
        NotALog: nothing in it describes DataFlash messages.
        LogDamaged: it does, but no row with a time can be recovered.
    """
    data = stream.read()
    raw, format_ = _decode(data, name)
    timed, clock = timed_tables(raw)
    if not any(len(table) for key, (table, _) in timed.items() if key not in NOT_DATA):
        raise LogDamaged(
            f"{name}: a DataFlash log without a single data row that has a time "
            f"({len(data)} bytes, {raw.recovered_fraction:.0%} decoded); "
            "copy it from the card again"
        )
    log = _flight_log(_Decoded(raw, timed, clock, _parameters(raw), _texts(raw)), name)
    return replace(log, format=format_)


def _decode(data: bytes, name: str) -> tuple[RawLog, str]:
    if is_binary(data):
        raw = read_binary(data, wanted=WANTED, clocks=CLOCKS)
        if "TIME" in raw.tables and "StartTime" in raw.tables["TIME"].numbers:
            raise NotALog(f"{name}: a PX4 sdlog2 file, not ArduPilot's; read it with read_px4log")
        return raw, "dataflash"
    if is_text(data):
        return read_text(data, wanted=WANTED), "dataflash_text"
    raise NotALog(f"{name}: no FMT record, binary or text, in its {len(data)} bytes")


@dataclass(frozen=True, slots=True)
class _Decoded:
    """A log with the times of its rows, and what all channels need to know."""

    raw: RawLog
    timed: Timed
    clock: FileClock
    parameters: Mapping[str, float]
    texts: tuple[str, ...]


def _flight_log(log: _Decoded, name: str) -> FlightLog:
    timed, parameters = log.timed, log.parameters
    who = ardupilot.identify(log.texts, parameters)
    last_s = end_s(timed)
    modes = _modes(timed, who, last_s)
    thrust = dataflash_motion.thrust(timed)
    velocity = dataflash_motion.velocity(timed, parameters)
    armed = armed_spans(timed, log.clock)
    in_air, air_warnings = in_air_spans(timed, armed, thrust, parameters)
    judged = [battery_log(b, i) for i, b in enumerate(raw_batteries(timed, parameters))]
    said = (*log.clock.warnings(), *log.raw.warnings(), *_logger_drops(timed), *air_warnings)
    return FlightLog(
        name=name,
        format="dataflash",
        firmware=who.firmware,
        hardware=who.hardware,
        vehicle=who.vehicle,
        vehicle_label=who.label,
        simulated=ardupilot.is_simulated(parameters, log.texts),
        start_utc=_start_utc(timed),
        duration_s=last_s,
        batteries=tuple(battery for battery, _ in judged),
        velocity_m_s=velocity,
        velocity_setpoint_m_s=dataflash_motion.velocity_setpoint(timed, modes),
        sticks=dataflash_motion.sticks(timed, parameters),
        thrust=thrust,
        altitude_m=dataflash_motion.altitude(timed),
        board_K=coldest_K(timed["BARO"][0].numbers.get("Temp")) if "BARO" in timed else None,
        modes=modes,
        armed=armed,
        in_air=in_air,
        parameters=ardupilot.kept_parameters(parameters),
        recovered_fraction=log.raw.recovered_fraction,
        warnings=(*said, *_velocity_doubts(velocity), *(w for _, found in judged for w in found)),
    )


def _parameters(raw: RawLog) -> Mapping[str, float]:
    table = raw.tables.get("PARM")
    if table is None or "Name" not in table.texts or "Value" not in table.numbers:
        return {}
    pairs = zip(table.texts["Name"], table.numbers["Value"].tolist(), strict=True)
    return {name: value for name, value in pairs if math.isfinite(value)}


def _texts(raw: RawLog) -> tuple[str, ...]:
    texts: tuple[str, ...] = ()
    for table, label in (("VER", "FWS"), ("MSG", "Message")):
        if table in raw.tables:
            texts += raw.tables[table].texts.get(label, ())
    return texts + raw.banner


def _modes(timed: Timed, who: Identity, last_s: float) -> tuple[ModeSpan, ...]:
    if "MODE" not in timed:
        return ()
    table, time_s = timed["MODE"]
    logged = table.texts.get("Mode") or table.numbers.get("Mode", np.zeros(0)).tolist()
    names = [ardupilot.mode_name(who.kind, mode) for mode in logged]
    known = np.isfinite(time_s)
    return mode_spans(time_s[known], [n for n, k in zip(names, known, strict=True) if k], last_s)


def _logger_drops(timed: Timed) -> tuple[LogWarning, ...]:
    """Messages the logger could not write: PM counts them since its last row, DSF in all."""
    dropped = 0
    if "PM" in timed and "LogDrop" in timed["PM"][0].numbers:
        dropped = int(np.sum(_finite(timed["PM"][0].numbers["LogDrop"])))
    elif "DSF" in timed and "Dp" in timed["DSF"][0].numbers:
        dropped = int(np.max(_finite(timed["DSF"][0].numbers["Dp"]), initial=0))
    message = f"the logger says it could not write {dropped} messages"
    return (LogWarning("logger_dropped", message),) if dropped else ()


def _finite(values: FloatArray) -> FloatArray:
    """(m,) those that a damaged row of a text log has not spoilt."""
    return values[np.isfinite(values)]


def _start_utc(timed: Timed) -> datetime | None:
    """UTC of time zero by the first GPS row with a fix and a week."""
    if "GPS" not in timed:
        return None
    table, time_s = timed["GPS"]
    for week_label, ms_label in (("GWk", "GMS"), ("Week", "TimeMS")):
        week, ms = table.numbers.get(week_label), table.numbers.get(ms_label)
        status = table.numbers.get("Status")
        if week is None or ms is None or status is None:
            continue
        fixed = (status >= dataflash_motion.FIX_3D) & (week > 0) & (time_s >= 0)
        good = np.flatnonzero(fixed & np.isfinite(week) & np.isfinite(ms))
        if good.size:
            i = int(good[0])
            return utc_at(ardupilot.unix_s(week[i], ms[i]) - float(time_s[i]))
    return None


def _velocity_doubts(velocity: Channel | None) -> tuple[LogWarning, ...]:
    if velocity is None or np.isfinite(velocity.values[:, :2]).any():
        return ()
    message = "only the climb rate was logged: horizontal velocity unknown"
    return (LogWarning("velocity_vertical_only", message, velocity.source),)
