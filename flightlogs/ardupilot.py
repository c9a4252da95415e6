"""What ArduPilot's texts, parameters and mode numbers mean, in DataFlash and in telemetry alike."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from pymavlink import mavutil

from flightlogs.log import FloatArray, Vehicle

FIRMWARE = re.compile(
    r"\b(?:APM:|Ardu)?(Copter|Plane|Rover|Sub|Blimp|AntennaTracker|Tracker)\b[ :]+(V\d[\w.\-]*)"
)
BOARD = re.compile(r"^(\S+)(?: [0-9A-Fa-f]{8}){3}$|^(APM \d\S*)$")
COPTER_CLASSES = {6: Vehicle.HELICOPTER, 11: Vehicle.HELICOPTER, 13: Vehicle.HELICOPTER} | {
    8: Vehicle.OTHER,  # single copter
    9: Vehicle.OTHER,  # coaxial copter: one shaft, flaps steer
}
HELICOPTER_PARAMETERS = ("H_SWASH_TYPE", "H_SW_TYPE", "H_SV_MAN", "H_RSC_MODE")
MODES = {
    "Copter": mavutil.mode_mapping_acm,
    "Plane": mavutil.mode_mapping_apm,
    "Rover": mavutil.mode_mapping_rover,
    "Sub": mavutil.mode_mapping_sub,
}
MANUAL_THROTTLE = frozenset(
    ["STABILIZE", "ACRO", "RATE_ACRO", "FLIP", "THROW", "TURTLE", "AUTOROTATE"]
)  # no climb rate is commanded in these
KEPT = re.compile(
    r"^(BATT\d?_|BAT\d_|FRAME|Q_ENABLE|SYSID_THISMAV|SYS_AUTOSTART|MAV_TYPE|AHRS_EKF_TYPE"
    r"|VOLT_DIVIDER|AMP_PER_VOLT|CA_ROTOR_COUNT|MOT_BAT|MOT_SPIN|RCMAP_|SERVO_BLH)"
)
CAPACITY = re.compile(r"BATT\d?_CAPACITY")
DEFAULT_CAPACITY_C = 3300 * 3.6  # AP_BATT_CAPACITY_DEFAULT, of every battery monitor
LEAP_SECONDS = ((2017.0, 18), (2015.5, 17), (2012.5, 16), (0.0, 15))  # GPS ahead of UTC, IERS
GPS_EPOCH_UNIX_S = 315964800
WEEK_S = 604800
YEAR_S = 31556952


@dataclass(frozen=True, slots=True)
class Identity:
    """Which vehicle a log is of."""

    vehicle: Vehicle
    label: str
    firmware: str
    kind: str
    hardware: str


def identify(texts: Iterable[str], parameters: Mapping[str, float]) -> Identity:
    """Vehicle, firmware and board by the autopilot's own texts and parameters."""
    lines = [line.strip() for line in texts]
    found = next((m for m in map(FIRMWARE.search, lines) if m), None)
    board = next((m for m in map(BOARD.match, lines) if m), None)
    kind, version = (found[1], found[2]) if found else ("", "")
    vehicle, label = _vehicle(kind, parameters)
    return Identity(
        vehicle=vehicle,
        label=label,
        firmware=f"Ardu{kind} {version}" if found else "",
        kind=kind,
        hardware=(board[1] or board[2]) if board else "",
    )


def _vehicle(kind: str, parameters: Mapping[str, float]) -> tuple[Vehicle, str]:
    if not kind:
        return Vehicle.UNKNOWN, ""
    if kind == "Plane":
        vtol = parameters.get("Q_ENABLE", 0) > 0
        label = "ArduPlane, Q_ENABLE 1" if vtol else "ArduPlane"
        return (Vehicle.VTOL if vtol else Vehicle.FIXED_WING), label
    if kind != "Copter":
        return Vehicle.OTHER, f"Ardu{kind}"
    if swash := [p for p in HELICOPTER_PARAMETERS if p in parameters]:
        return Vehicle.HELICOPTER, f"ArduCopter with {swash[0]}"
    for name in ("FRAME_CLASS", "FRAME"):
        if name in parameters:
            number = int(parameters[name])
            classes = COPTER_CLASSES if name == "FRAME_CLASS" else {}
            return classes.get(number, Vehicle.MULTIROTOR), f"ArduCopter, {name} {number}"
    return Vehicle.MULTIROTOR, "ArduCopter"


def mode_name(kind: str, mode: float | str) -> str:
    """ArduPilot's name of a mode, given by number or by its printed name."""
    text = str(mode)
    if re.fullmatch(r"[0-9]{1,9}(\.0)?", text):
        return str(MODES.get(kind, {}).get(int(float(text)), f"MODE_{int(float(text))}"))
    return text.upper().replace(" ", "_")


def kept_parameters(values: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    """Those that bear on the battery and the airframe."""
    return tuple((k, float(v)) for k, v in sorted(values.items()) if KEPT.match(k))


def is_simulated(parameters: Mapping[str, float], texts: Iterable[str]) -> bool:
    """True for a SITL log: only that build of ArduPilot has SIM_ parameters."""
    return any(p.startswith("SIM_") for p in parameters) or any("SITL" in t for t in texts)


def capacity_C(parameters: Mapping[str, float], index: int) -> float | None:
    """Pack capacity from BATT_CAPACITY, BATT2_CAPACITY, ... [C]."""
    value = parameters.get(_battery_parameter(index, "CAPACITY"), 0.0)
    return value * 3.6 if value > 0 else None


def untouched_capacity(parameters: Mapping[str, float], stated_C: float) -> bool:
    """Whether a capacity is the one that ArduPilot has where nobody entered any."""
    own_C = [v * 3.6 for k, v in parameters.items() if CAPACITY.fullmatch(k)]
    return stated_C == DEFAULT_CAPACITY_C and DEFAULT_CAPACITY_C in own_C


def serial(parameters: Mapping[str, float], index: int) -> str:
    """Serial number from BATT_SERIAL_NUM; -1 and 0 are its defaults and mean none."""
    value = parameters.get(_battery_parameter(index, "SERIAL_NUM"), -1.0)
    return str(int(value)) if value > 0 else ""


def _battery_parameter(index: int, name: str) -> str:
    return f"BATT{index + 1 if index else ''}_{name}"


def unix_s(gps_week: float, gps_ms: float) -> float:
    """UNIX time of a GPS week and milliseconds of week."""
    gps_s = GPS_EPOCH_UNIX_S + gps_week * WEEK_S + gps_ms * 1e-3
    year = 1970 + gps_s / YEAR_S
    return gps_s - next(leap for since, leap in LEAP_SECONDS if year >= since)


def sticks_from_pulses(pulses_us: FloatArray, parameters: Mapping[str, float]) -> FloatArray:
    """Stick positions from radio pulses.

    Args:
        pulses_us: (n, channels) pulse widths; 0 where the radio was silent.
        parameters: RCMAP_* and RCn_MIN, _TRIM, _MAX, _REV(ERSED); ArduPilot's defaults otherwise.

    Returns:
        (n, 4) roll, pitch (forward positive), yaw in -1..1, throttle in 0..1.
    """
    names = (("ROLL", 1), ("PITCH", 2), ("YAW", 4), ("THROTTLE", 3))
    columns = []
    for name, default in names:
        channel = int(parameters.get(f"RCMAP_{name}", default))
        if not 1 <= channel <= pulses_us.shape[1]:
            return np.full((pulses_us.shape[0], 4), np.nan)
        columns.append(_stick(pulses_us[:, channel - 1], channel, name, parameters))
    return np.column_stack(columns)


def _stick(
    pulse_us: FloatArray, channel: int, name: str, parameters: Mapping[str, float]
) -> FloatArray:
    rc = f"RC{channel}_"
    low, high = parameters.get(rc + "MIN", 1100.0), parameters.get(rc + "MAX", 1900.0)
    reversed_ = parameters.get(rc + "REV", 1.0) < 0 or parameters.get(rc + "REVERSED", 0.0) > 0
    pulse = np.where(pulse_us > 0, pulse_us, np.nan)
    if high <= low:
        return np.full(pulse.shape, np.nan)
    if name == "THROTTLE":
        level = np.clip((pulse - low) / (high - low), 0.0, 1.0)
        return 1.0 - level if reversed_ else level
    trim = parameters.get(rc + "TRIM", (low + high) / 2)
    span = np.where(pulse >= trim, max(high - trim, 1.0), max(trim - low, 1.0))
    forward = -1.0 if (name == "PITCH") != reversed_ else 1.0  # nose down is a short pulse
    return forward * np.clip((pulse - trim) / span, -1.0, 1.0)
