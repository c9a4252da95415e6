"""MAVLink's numbers for vehicles and modes, in telemetry and in PX4's parameters."""

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from flightlogs.ardupilot import mode_name
from flightlogs.log import Vehicle

MULTIROTORS = ("TRICOPTER", "QUADROTOR", "HEXAROTOR", "OCTOROTOR", "DODECAROTOR", "DECAROTOR")
TYPES = {
    **{getattr(mavlink, f"MAV_TYPE_{n}"): Vehicle.MULTIROTOR for n in MULTIROTORS},
    mavlink.MAV_TYPE_GENERIC_MULTIROTOR: Vehicle.MULTIROTOR,
    mavlink.MAV_TYPE_HELICOPTER: Vehicle.HELICOPTER,
    mavlink.MAV_TYPE_FIXED_WING: Vehicle.FIXED_WING,
    **dict.fromkeys(range(19, 26), Vehicle.VTOL),  # MAV_TYPE_VTOL_*
    mavlink.MAV_TYPE_GENERIC: Vehicle.UNKNOWN,
}
NO_VEHICLE = frozenset(
    getattr(mavlink, f"MAV_TYPE_{n}")
    for n in (
        "GCS",
        "ONBOARD_CONTROLLER",
        "GIMBAL",
        "ADSB",
        "CAMERA",
        "CHARGING_STATION",
        "BATTERY",
    )
)
PX4 = mavlink.MAV_AUTOPILOT_PX4
ARDUPILOT = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
NO_AUTOPILOT = mavlink.MAV_AUTOPILOT_INVALID
AUTO = 4
PX4_MAIN = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", AUTO: "AUTO", 5: "ACRO", 6: "OFFBOARD"}
PX4_MAIN |= {7: "STAB", 8: "RATTITUDE", 10: "TERMINATION", 11: "ALTITUDE_CRUISE"}
PX4_SUB = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND"}
PX4_SUB |= {8: "FOLLOW", 9: "PRECLAND", 10: "VTOL_TAKEOFF"}
ARDUPILOT_KINDS = {Vehicle.FIXED_WING: "Plane", Vehicle.VTOL: "Plane"}
ROVERS = (mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_TYPE_SURFACE_BOAT)


def vehicle_of_type(mav_type: int) -> Vehicle:
    """Kind of airframe a MAV_TYPE stands for."""
    return TYPES.get(mav_type, Vehicle.OTHER)


def type_name(mav_type: int) -> str:
    """MAVLink's own word for a MAV_TYPE, e.g. `MAV_TYPE_QUADROTOR`."""
    entry = mavlink.enums["MAV_TYPE"].get(mav_type)
    return str(entry.name) if entry else f"MAV_TYPE {mav_type}"


def heartbeat_mode(autopilot: int, mav_type: int, custom_mode: int) -> str:
    """Name of the mode a heartbeat reports."""
    if autopilot == PX4:
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        name = PX4_MAIN.get(main, f"MODE_{main}")
        return f"AUTO_{PX4_SUB.get(sub, sub)}" if main == AUTO and sub else name
    if autopilot == ARDUPILOT:
        kind = "Rover" if mav_type in ROVERS else "Copter"
        return mode_name(ARDUPILOT_KINDS.get(vehicle_of_type(mav_type), kind), custom_mode)
    return f"MODE_{custom_mode}"
