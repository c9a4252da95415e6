"""Old PX4 logs of sdlog2 (`.px4log`, before ULog) -> `FlightLog`.

The records are framed as in DataFlash, but carry no time: it comes from the TIME records between
them (microseconds since boot), each of which stands before the records of its cycle.

    message, columns               channel
    BATT V, C, Discharged          battery (V, A, mAh)
    LPOS VX,VY,VZ                  velocity, north, east, down (m/s); Z altitude
    LPSP VX,VY,VZ and X,Y,Z        commanded velocity and position; GVSP for the velocity without it
    ATTC Thrust                    thrust 0..1
    RC Ch0..                       sticks, already -1..1 (throttle 0..1), mapped by RC_MAP_*
    STAT MainState, ArmS, Landed   modes, armed, in air
    GPS GPSTime                    UTC (microseconds)
    VER, PARM                      firmware, board, parameters

Source: PX4 Firmware `src/modules/sdlog2/sdlog2_messages.h`, `msg/vehicle_status.msg` (2015).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from typing import BinaryIO

import numpy as np

from flightlogs.ardupilot import kept_parameters
from flightlogs.channels import above_start, channel, during
from flightlogs.dataflash_binary import is_binary, read_binary
from flightlogs.dataflash_motion import FIX_3D
from flightlogs.errors import LogDamaged, LogWarning, NotALog
from flightlogs.log import BatteryLog, Channel, FlightLog, FloatArray, Interval, ModeSpan
from flightlogs.mavlink_vehicle import type_name, vehicle_of_type
from flightlogs.measured import MAH_C, RawBattery, battery_log
from flightlogs.px4_motion import NO_HORIZONTAL_SETPOINT
from flightlogs.spans import mode_spans, spans_of
from flightlogs.stamps import file_clock, increasing
from flightlogs.table import Table
from flightlogs.utc import utc_at

WANTED = frozenset(
    ["BATT", "LPOS", "LPSP", "GVSP", "ATTC", "RC", "STAT", "GPS", "VER", "PARM", "TIME"]
)
MICRO = 1e-6
AUTO_MODES = ("AUTO_MISSION", "AUTO_LOITER", "AUTO_RTL")  # MainState 3 to 5
MODES = ("MANUAL", "ALTCTL", "POSCTL", *AUTO_MODES, "ACRO", "OFFBOARD", "STAB", "RATTITUDE")
NO_SETPOINT = frozenset(["MANUAL", "ACRO", "STAB", "RATTITUDE"])  # attitude only
ARMED_STATES = (2, 3)  # ARMED, ARMED_ERROR
NOT_MEASURED = -1.0
HIL_AIRFRAMES = range(1000, 2000)  # SYS_AUTOSTART of simulated airframes
STICKS = ("ROLL", "PITCH", "YAW", "THROTTLE")

Timed = Mapping[str, tuple[Table, FloatArray]]


def read_px4log(stream: BinaryIO, *, name: str) -> FlightLog:
    """Read an sdlog2 file.

    Args:
        stream: the file, read to its end.
        name: for messages.

    Raises:
        NotALog: no records of the sdlog2 kind in it.
        LogDamaged: the records are there, but none that tells the time, or nothing after it.
    """
    data = stream.read()
    raw = read_binary(data, wanted=WANTED, clocks=frozenset(["StartTime"]))
    if not is_binary(data):
        raise NotALog(f"{name}: no FMT record of PX4's sdlog2 in its {len(data)} bytes")
    start = raw.tables["TIME"].numbers.get("StartTime") if "TIME" in raw.tables else None
    if start is None:
        raise LogDamaged(f"{name}: no TIME record, so that nothing in it can be timed")
    clock = file_clock({"TIME": (raw.tables["TIME"].offset, start * MICRO)})
    known_s = clock.time_s[np.isfinite(clock.time_s)]
    if not known_s.size:
        raise LogDamaged(f"{name}: none of its {start.size} TIME records can be trusted")
    timed = {k: (t, clock.at(t.offset) - known_s[0]) for k, t in raw.tables.items()}
    log = _flight_log(timed, name)
    return replace(
        log,
        recovered_fraction=raw.recovered_fraction,
        warnings=(*clock.warnings(), *raw.warnings(), *log.warnings),
    )


def _flight_log(timed: Timed, name: str) -> FlightLog:
    parameters = _parameters(timed)
    end_s = max(float(t[-1]) for _, t in timed.values())
    modes = _modes(timed, end_s)
    mav_type, airframe = int(parameters.get("MAV_TYPE", 0)), int(parameters.get("SYS_AUTOSTART", 0))
    battery = _battery(timed, parameters)
    firmware, hardware = _version(timed)
    return FlightLog(
        name=name,
        format="px4log",
        firmware=firmware,
        hardware=hardware,
        vehicle=vehicle_of_type(mav_type),
        vehicle_label=f"{type_name(mav_type)}, SYS_AUTOSTART {airframe}",
        simulated=airframe in HIL_AIRFRAMES,
        start_utc=_start_utc(timed),
        duration_s=end_s,
        batteries=(battery[0],) if battery else (),
        velocity_m_s=_vector(timed, "LPOS", ("VX", "VY", "VZ")),
        velocity_setpoint_m_s=_commanded(timed, ("VX", "VY", "VZ"), modes),
        position_setpoint_m=_commanded(timed, ("X", "Y", "Z"), modes),
        sticks=_sticks(timed, parameters),
        thrust=_scalar(timed, "ATTC", "Thrust", 1.0),
        altitude_m=above_start(_scalar(timed, "LPOS", "Z", -1.0)),
        modes=modes,
        armed=_state(timed, "ArmS", ARMED_STATES, end_s) or (),
        in_air=_state(timed, "Landed", (0,), end_s),
        parameters=kept_parameters(parameters),
        warnings=battery[1] if battery else (),
    )


def _parameters(timed: Timed) -> Mapping[str, float]:
    if "PARM" not in timed:
        return {}
    table = timed["PARM"][0]
    names, values = table.texts.get("Name", ()), table.numbers.get("Value", np.zeros(0))
    pairs = zip(names, values.tolist(), strict=False)
    return {name: value for name, value in pairs if math.isfinite(value)}


def _version(timed: Timed) -> tuple[str, str]:
    if "VER" not in timed or not len(timed["VER"][0]):
        return "PX4", ""
    texts = timed["VER"][0].texts
    git, board = texts.get("FwGit", ("",))[0], texts.get("Arch", ("",))[0]
    return f"PX4 git {git[:8]}" if git else "PX4", board


def _battery(
    timed: Timed, parameters: Mapping[str, float]
) -> tuple[BatteryLog, tuple[LogWarning, ...]] | None:
    if "BATT" not in timed:
        return None
    table, time_s = timed["BATT"]
    unknown = np.full(len(table), np.nan)
    current_A = table.numbers.get("C", unknown)
    charge_mAh = table.numbers.get("Discharged", unknown)
    cells, capacity_mAh = parameters.get("BAT_N_CELLS", 0), parameters.get("BAT_CAPACITY", -1)
    raw = RawBattery(
        label="BATT",
        source="BATT.C",
        time_s=time_s,
        current_A=np.where(current_A == NOT_MEASURED, np.nan, current_A),
        voltage_V=table.numbers.get("V", unknown),
        charge_C=np.where(charge_mAh == NOT_MEASURED, np.nan, charge_mAh) * MAH_C,
        series=int(cells) if cells > 0 else None,
        capacity_C=capacity_mAh * MAH_C if capacity_mAh > 0 else None,
    )
    return battery_log(raw, 0)


def _vector(timed: Timed, name: str, labels: tuple[str, ...]) -> Channel | None:
    if name not in timed or not all(label in timed[name][0].numbers for label in labels):
        return None
    table, time_s = timed[name]
    values = np.column_stack([table.numbers[label] for label in labels])
    return channel(time_s, values, f"{name}.{','.join(labels)}")


def _scalar(timed: Timed, name: str, label: str, factor: float) -> Channel | None:
    if name not in timed or label not in timed[name][0].numbers:
        return None
    table, time_s = timed[name]
    return channel(time_s, table.numbers[label] * factor, f"{name}.{label}")


def _commanded(timed: Timed, labels: tuple[str, ...], modes: Sequence[ModeSpan]) -> Channel | None:
    """Setpoints, NaN in the modes that do not use them: the log repeats stale ones."""
    found = _vector(timed, "LPSP", labels) or _vector(timed, "GVSP", labels)
    if found is None:
        return None
    values = found.values.copy()
    values[during(found.time_s, modes, NO_SETPOINT)] = np.nan
    values[during(found.time_s, modes, NO_HORIZONTAL_SETPOINT), :2] = np.nan
    return channel(found.time_s, values, found.source)


def _sticks(timed: Timed, parameters: Mapping[str, float]) -> Channel | None:
    mapped = [int(parameters.get(f"RC_MAP_{name}", 0)) - 1 for name in STICKS]
    found = _vector(timed, "RC", tuple(f"Ch{i}" for i in mapped)) if min(mapped) >= 0 else None
    if found is None or "SignalLost" not in timed["RC"][0].numbers:
        return found
    lost = timed["RC"][0].numbers["SignalLost"][increasing(timed["RC"][1])] > 0
    values = np.where(lost[:, None], np.nan, found.values)
    return channel(found.time_s, values, found.source)


def _state(
    timed: Timed, label: str, on: tuple[int, ...], end_s: float
) -> tuple[Interval, ...] | None:
    if "STAT" not in timed or label not in timed["STAT"][0].numbers:
        return None
    table, time_s = timed["STAT"]
    return spans_of(time_s, np.isin(table.numbers[label], on), end_s)


def _modes(timed: Timed, end_s: float) -> tuple[ModeSpan, ...]:
    if "STAT" not in timed or "MainState" not in timed["STAT"][0].numbers:
        return ()
    table, time_s = timed["STAT"]
    numbers = table.numbers["MainState"].astype(int)
    names = [MODES[i] if 0 <= i < len(MODES) else f"MODE_{i}" for i in numbers]
    return mode_spans(time_s, names, end_s)


def _start_utc(timed: Timed) -> datetime | None:
    if "GPS" not in timed or not {"GPSTime", "Fix"} <= timed["GPS"][0].numbers.keys():
        return None
    table, time_s = timed["GPS"]
    good = np.flatnonzero((table.numbers["Fix"] >= FIX_3D) & (table.numbers["GPSTime"] > 0))
    if not good.size:
        return None
    i = int(good[0])
    return utc_at(float(table.numbers["GPSTime"][i] * MICRO - time_s[i]))
