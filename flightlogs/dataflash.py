"""ArduPilot DataFlash logs, binary (`.bin`) and text (`.log`) -> `FlightLog`.

message                 what is taken from it
BAT, CURR, CUR2, BCL    batteries (dataflash_battery.py)
XKF1, NKF1, EKF1, GPS   velocity (dataflash_motion.py, also the next three)
PSCN/E/D, PSC, NTUN     commanded velocity
CTUN                    throttle, altitude, commanded climb rate
RCIN, RCOU, MOTB        sticks, motor outputs
EV, ARM                 armed and in-air spans
MODE, MSG, VER, PARM    modes, firmware, parameters
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import BinaryIO

import numpy as np

from flightlogs import ardupilot, dataflash_motion
from flightlogs.ardupilot import Identity
from flightlogs.dataflash_battery import raw_batteries
from flightlogs.dataflash_binary import is_binary, read_binary
from flightlogs.dataflash_text import is_text, read_text
from flightlogs.dataflash_time import NOT_DATA, Timed, timed_tables
from flightlogs.errors import LogDamaged, LogWarning, NotALog
from flightlogs.log import Channel, FlightLog, Interval, ModeSpan
from flightlogs.measured import battery_log
from flightlogs.spans import flying_by_throttle, mode_spans, overlap, switched
from flightlogs.stamps import FileClock
from flightlogs.table import RawLog

CHANNELS = ("BAT", "BAT2", "CURR", "CUR2", "BCL", "XKF1", "NKF1", "EKF1", "GPS", "PSCN", "PSCE")
WANTED = frozenset(
    (*CHANNELS, "PSCD", "PSC", "NTUN", "CTUN", "BARO", "RCIN", "RCOU", "MOTB")
    + ("EV", "ARM", "MODE", "MSG", "VER", "PARM", "TIME")
)
CLOCKS = frozenset(["TimeUS", "TimeMS"])
ARMED, DISARMED, LANDED, AIRBORNE = 10, 11, 18, 28
LOST_SHARE = 0.999


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
    timed, clock, warnings = timed_tables(raw)
    if not any(len(table) for key, (table, _) in timed.items() if key not in NOT_DATA):
        raise LogDamaged(
            f"{name}: a DataFlash log without a single data row that has a time "
            f"({len(data)} bytes, {raw.recovered_fraction:.0%} decoded); copy it from the card again"
        )
    return _flight_log(raw, timed, clock, name=name, format_=format_, warnings=warnings)


def _decode(data: bytes, name: str) -> tuple[RawLog, str]:
    if is_binary(data):
        raw = read_binary(data, wanted=WANTED, clocks=CLOCKS)
        if "TIME" in raw.tables and "StartTime" in raw.tables["TIME"].numbers:
            raise NotALog(f"{name}: a PX4 sdlog2 file, not ArduPilot's; read it with read_px4log")
        return raw, "dataflash"
    if is_text(data):
        return read_text(data), "dataflash_text"
    raise NotALog(f"{name}: no FMT record, binary or text, in its {len(data)} bytes")


def _flight_log(
    raw: RawLog,
    timed: Timed,
    clock: FileClock,
    *,
    name: str,
    format_: str,
    warnings: tuple[LogWarning, ...],
) -> FlightLog:
    parameters, texts = _parameters(raw), _texts(raw)
    who = ardupilot.identify(texts, parameters)
    end_s = _end_s(timed)
    modes = _modes(timed, who, end_s)
    thrust = dataflash_motion.thrust(timed)
    armed = _armed(timed, end_s)
    in_air, air_warnings = _in_air(timed, armed, thrust, end_s)
    judged = [battery_log(b, i) for i, b in enumerate(raw_batteries(timed, parameters))]
    velocity = dataflash_motion.velocity(timed, parameters)
    said = (*warnings, *_damage(raw), *air_warnings, *_velocity_doubts(velocity))
    return FlightLog(
        name=name,
        format=format_,
        firmware=who.firmware,
        hardware=who.hardware,
        vehicle=who.vehicle,
        vehicle_label=who.label,
        simulated=ardupilot.is_simulated(parameters, texts),
        start_utc=_start_utc(timed),
        duration_s=end_s,
        batteries=tuple(battery for battery, _ in judged),
        velocity_m_s=velocity,
        velocity_setpoint_m_s=dataflash_motion.velocity_setpoint(timed, modes),
        sticks=dataflash_motion.sticks(timed, parameters),
        thrust=thrust,
        altitude_m=dataflash_motion.altitude(timed),
        modes=modes,
        armed=armed,
        in_air=in_air,
        parameters=ardupilot.kept_parameters(parameters),
        dropouts_s=0.0,
        recovered_fraction=raw.recovered_fraction,
        warnings=said + tuple(w for _, found in judged for w in found),
    )


def _parameters(raw: RawLog) -> Mapping[str, float]:
    table = raw.tables.get("PARM")
    if table is None or "Name" not in table.texts or "Value" not in table.numbers:
        return {}
    return dict(zip(table.texts["Name"], table.numbers["Value"].tolist(), strict=True))


def _texts(raw: RawLog) -> tuple[str, ...]:
    texts: tuple[str, ...] = ()
    for table, label in (("VER", "FWS"), ("MSG", "Message")):
        if table in raw.tables:
            texts += raw.tables[table].texts.get(label, ())
    return texts + raw.banner


def _end_s(timed: Timed) -> float:
    return max(
        (float(np.nanmax(t)) for k, (_, t) in timed.items() if k not in NOT_DATA and t.size),
        default=0.0,
    )


def _modes(timed: Timed, who: Identity, end_s: float) -> tuple[ModeSpan, ...]:
    if "MODE" not in timed:
        return ()
    table, time_s = timed["MODE"]
    logged = table.texts.get("Mode") or table.numbers.get("Mode", np.zeros(0)).tolist()
    names = [ardupilot.mode_name(who.kind, mode) for mode in logged]
    known = np.isfinite(time_s)
    return mode_spans(time_s[known], [n for n, k in zip(names, known, strict=True) if k], end_s)


def _events(timed: Timed, on: int, off: int, end_s: float) -> tuple[Interval, ...]:
    if "EV" not in timed or "Id" not in timed["EV"][0].numbers:
        return ()
    table, time_s = timed["EV"]
    number = table.numbers["Id"]
    rows = np.isin(number, (on, off)) & np.isfinite(time_s)
    return switched(time_s[rows], number[rows] == on, start_s=0.0, end_s=end_s)


def _armed(timed: Timed, end_s: float) -> tuple[Interval, ...]:
    """From EV, else from ARM."""
    found = _events(timed, ARMED, DISARMED, end_s)
    if found or "ARM" not in timed or "ArmState" not in timed["ARM"][0].numbers:
        return found
    table, time_s = timed["ARM"]
    known = np.isfinite(time_s)
    return switched(time_s[known], table.numbers["ArmState"][known] > 0, start_s=0.0, end_s=end_s)


def _in_air(
    timed: Timed, armed: tuple[Interval, ...], thrust: Channel | None, end_s: float
) -> tuple[tuple[Interval, ...] | None, tuple[LogWarning, ...]]:
    """In-air spans by the autopilot's events, inside the armed spans; else judged by throttle."""
    judged = _events(timed, AIRBORNE, LANDED, end_s)
    if judged:
        return (overlap(judged, armed) if armed else judged), ()
    if thrust is None:
        return None, ()
    flying = flying_by_throttle(thrust.time_s, thrust.values, end_s)
    inside = overlap(flying, armed) if armed else flying
    message = "the log does not say when it flew: judged by throttle above 15 % while armed"
    return inside, (LogWarning("in_air_inferred", message, thrust.source),)


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
        good = np.flatnonzero((status >= dataflash_motion.FIX_3D) & (week > 0) & (time_s >= 0))
        if good.size:
            i = int(good[0])
            return datetime.fromtimestamp(ardupilot.unix_s(week[i], ms[i]) - time_s[i], tz=UTC)
    return None


def _damage(raw: RawLog) -> tuple[LogWarning, ...]:
    if not raw.damaged_places or raw.recovered_fraction > LOST_SHARE:
        return ()
    message = (
        f"{raw.recovered_fraction:.1%} of the file could be decoded; "
        f"{raw.damaged_places} damaged stretches were skipped"
    )
    return (LogWarning("damaged", message),)


def _velocity_doubts(velocity: Channel | None) -> tuple[LogWarning, ...]:
    if velocity is None or np.isfinite(velocity.values[:, :2]).any():
        return ()
    message = "only the climb rate was logged: horizontal velocity unknown"
    return (LogWarning("velocity_vertical_only", message, velocity.source),)
