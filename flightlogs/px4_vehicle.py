"""What flew, by what a PX4 log says of itself: airframe, firmware, board, simulation.

Source: PX4-Autopilot, msg/versioned/VehicleStatus.msg, ROMFS/px4fmu_common/init.d/airframes;
MAV_TYPE of https://mavlink.io/en/messages/common.html.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flightlogs.log import Vehicle
from flightlogs.px4_topics import Px4Topics

MAV_TYPES = {
    Vehicle.FIXED_WING: frozenset([1, 28]),
    Vehicle.MULTIROTOR: frozenset([2, 13, 14, 15, 29, 35, 43]),
    Vehicle.HELICOPTER: frozenset([4]),
    Vehicle.VTOL: frozenset(range(19, 26)),
    Vehicle.OTHER: frozenset([3, 5, 7, 8, 9, 10, 11, 12, 16, 17]),  # coaxial, airship, rover, boat
}
AIRFRAMES = (  # SYS_AUTOSTART from, to
    (2000, 4000, Vehicle.FIXED_WING),
    (4000, 13000, Vehicle.MULTIROTOR),
    (13000, 14000, Vehicle.VTOL),
    (14000, 16000, Vehicle.MULTIROTOR),
    (16000, 17000, Vehicle.HELICOPTER),
    (50000, 70000, Vehicle.OTHER),
)
STATUS_TYPES = {1: Vehicle.MULTIROTOR, 2: Vehicle.FIXED_WING, 3: Vehicle.OTHER, 4: Vehicle.OTHER}
RELEASES = ((255, ""), (192, "-rc"), (128, "-beta"), (64, "-alpha"), (0, "-dev"))
GIT_LETTERS = 8


@dataclass(frozen=True, slots=True)
class Airframe:
    """Kind of vehicle and what it was judged by."""

    vehicle: Vehicle
    label: str


def airframe(topics: Px4Topics, parameters: Mapping[str, float]) -> Airframe:
    """The kind of airframe; a VTOL or a helicopter counts as rotary wing in vehicle_status."""
    number = parameters.get("SYS_AUTOSTART", 0.0)
    tail = f", SYS_AUTOSTART {number:.0f}" if number else ""
    status, label = _by_status(topics)
    if status in (Vehicle.VTOL, Vehicle.FIXED_WING, Vehicle.OTHER):
        return Airframe(status, label + tail)
    mav_type = _mav_type(topics, parameters)
    declared = next((v for v, types in MAV_TYPES.items() if mav_type in types), None)
    if declared is not None and (status is None or declared is not Vehicle.FIXED_WING):
        return Airframe(declared, f"MAV_TYPE {mav_type}{tail}")
    if status is not None:
        return Airframe(status, label + tail)
    for low, high, vehicle in AIRFRAMES:
        if low <= number < high:
            return Airframe(vehicle, tail.lstrip(", "))
    return Airframe(Vehicle.UNKNOWN, tail.lstrip(", "))


def _by_status(topics: Px4Topics) -> tuple[Vehicle | None, str]:
    status = topics.first("vehicle_status")
    if status is None:
        return None, ""
    vtol = status.get("is_vtol")
    if vtol is not None and vtol.any():
        return Vehicle.VTOL, "vehicle_status.is_vtol"
    kinds, rotary = status.get("vehicle_type"), status.get("is_rotary_wing")
    if kinds is not None:
        kind = int(np.median(kinds))
        return STATUS_TYPES.get(kind), f"vehicle_status.vehicle_type {kind}"
    if rotary is not None and np.median(rotary):
        return Vehicle.MULTIROTOR, "vehicle_status.is_rotary_wing"
    return None, ""


def _mav_type(topics: Px4Topics, parameters: Mapping[str, float]) -> int:
    if "MAV_TYPE" in parameters:
        return int(parameters["MAV_TYPE"])
    status = topics.first("vehicle_status")
    kinds = None if status is None else status.get("system_type")
    return 0 if kinds is None else int(np.median(kinds))


def firmware(info: Mapping[str, str | int]) -> str:
    """E.g. `PX4 1.14.0`, `PX4 1.15.0-dev`, or the commit where no release is given."""
    name = str(info.get("sys_name", "PX4"))
    release = info.get("ver_sw_release")
    if isinstance(release, int) and 0 < release < 1 << 32:
        major, minor, patch, kind = release.to_bytes(4, "big")
        suffix = next(text for least, text in RELEASES if kind >= least)
        return f"{name} {major}.{minor}.{patch}{suffix}"
    commit = str(info.get("ver_sw", ""))[:GIT_LETTERS]
    return f"{name} git {commit}" if commit else name


def is_simulated(
    info: Mapping[str, str | int], topics: Px4Topics, parameters: Mapping[str, float]
) -> bool:
    """True for software in the loop, hardware in the loop and the simulator on hardware."""
    if "SITL" in str(info.get("ver_hw", "")).upper() or parameters.get("SYS_HITL", 0) > 0:
        return True
    status = topics.first("vehicle_status")
    hil = None if status is None else status.get("hil_state")
    return hil is not None and bool(hil.any())
