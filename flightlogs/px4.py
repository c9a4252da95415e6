"""PX4 ULog -> `FlightLog`. Field tables: px4_battery.py, px4_motion.py, px4_state.py."""

import re
from typing import BinaryIO

from flightlogs import px4_motion, px4_state, px4_vehicle
from flightlogs.errors import LogDamaged
from flightlogs.log import FlightLog
from flightlogs.px4_battery import batteries
from flightlogs.px4_topics import on_one_clock
from flightlogs.ulog import read_topics

WANTED = frozenset(
    (
        "battery_status", "battery_info", "vehicle_status",
        "vehicle_land_detected", "actuator_armed", "vehicle_local_position",
        "vehicle_local_position_setpoint", "trajectory_setpoint", "manual_control_setpoint",
        "vehicle_air_data", "sensor_combined.baro_alt_meter",
        "sensor_combined.baro_temp_celcius", "vehicle_gps_position", "sensor_gps",
        "vehicle_thrust_setpoint", "vehicle_attitude_setpoint", "actuator_controls_0",
        "actuator_motors", "actuator_outputs",
    )
)  # fmt: skip
KEPT = re.compile(r"^(BAT\d?_|SYS_AUTOSTART$|SYS_HITL$|MAV_TYPE$|CA_ROTOR_COUNT$|CA_AIRFRAME$)")


def read_ulog(stream: BinaryIO, *, name: str) -> FlightLog:
    """Read a PX4 log.

    Args:
        stream: the file, read to its end.
        name: for messages.

    Raises:
        NotALog: it does not begin as a ULog does.
        LogDamaged: it does, but not one sample of a topic that matters can be recovered.
    """
    file = read_topics(stream, WANTED, name=name)
    topics = on_one_clock(file.topics)
    if not topics.samples:
        raise LogDamaged(
            f"{name}: a ULog without a single sample of {', '.join(sorted(WANTED)[:3])}, ... "
            f"({file.recovered_fraction:.0%} of it decoded): copy it from the card again"
        )
    packs, pack_warnings = batteries(topics, file.parameters)
    airframe = px4_vehicle.airframe(topics, file.parameters)
    arming, modes = px4_state.armed(topics), px4_state.modes(topics)
    return FlightLog(
        name=name,
        format="ulog",
        firmware=px4_vehicle.firmware(file.info),
        hardware=str(file.info.get("ver_hw", "")),
        vehicle=airframe.vehicle,
        vehicle_label=airframe.label,
        simulated=px4_vehicle.is_simulated(file.info, topics, file.parameters),
        start_utc=px4_state.start_utc(topics),
        duration_s=topics.end_s,
        batteries=packs,
        velocity_m_s=px4_motion.velocity(topics),
        velocity_setpoint_m_s=px4_motion.velocity_setpoint(topics, modes),
        position_setpoint_m=px4_motion.position_setpoint(topics, modes),
        sticks=px4_motion.sticks(topics),
        thrust=px4_motion.thrust(topics),
        altitude_m=px4_motion.altitude(topics),
        board_K=px4_state.board_K(topics),
        modes=modes,
        armed=arming or (),
        in_air=px4_state.in_air(topics, arming),
        parameters=tuple((k, v) for k, v in sorted(file.parameters.items()) if KEPT.match(k)),
        dropouts_s=file.dropouts_s,
        recovered_fraction=file.recovered_fraction,
        warnings=file.warnings + topics.clock.warnings() + pack_warnings,
    )
