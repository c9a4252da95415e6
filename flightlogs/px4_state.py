"""Armed, in the air, mode and time of day of a PX4 log.

Source: PX4-Autopilot, msg/versioned/VehicleStatus.msg, VehicleLandDetected.msg, SensorGps.msg,
VehicleAirData.msg (`baro_temp_celcius`, as it is spelt there).
"""

from datetime import UTC, datetime, timedelta

import numpy as np

from flightlogs.board import coldest_K
from flightlogs.log import Interval, ModeSpan
from flightlogs.px4_topics import MICRO, Px4Topics
from flightlogs.spans import mode_spans, overlap, spans_of

ARMED = 2  # arming_state, in every release
NAV_STATES = {
    0: "MANUAL", 1: "ALTCTL", 2: "POSCTL", 3: "AUTO_MISSION", 4: "AUTO_LOITER", 5: "AUTO_RTL",
    6: "POSITION_SLOW", 7: "AUTO_RTGS", 8: "ALTITUDE_CRUISE", 9: "AUTO_LANDGPSFAIL", 10: "ACRO",
    11: "AUTO_LAND_OLD", 12: "DESCEND", 13: "TERMINATION", 14: "OFFBOARD", 15: "STAB",
    16: "RATTITUDE", 17: "AUTO_TAKEOFF", 18: "AUTO_LAND", 19: "AUTO_FOLLOW_TARGET",
    20: "AUTO_PRECLAND", 21: "ORBIT", 22: "AUTO_VTOL_TAKEOFF",
} | {n: f"EXTERNAL{n - 22}" for n in range(23, 31)}  # fmt: skip
EARLIEST = datetime(2010, 1, 1, tzinfo=UTC).timestamp()  # receivers without a fix say 1980 or 2000
LATEST = datetime(2100, 1, 1, tzinfo=UTC).timestamp()


def armed(topics: Px4Topics) -> tuple[Interval, ...] | None:
    """Spans with the motors armed; None if the log does not say."""
    status = topics.first("vehicle_status")
    state = None if status is None else status.get("arming_state")
    if status is not None and state is not None:
        return spans_of(status.time_s, state == ARMED, topics.end_s)
    actuators = topics.first("actuator_armed")
    on = None if actuators is None else actuators.get("armed")
    if actuators is not None and on is not None:
        return spans_of(actuators.time_s, on > 0, topics.end_s)
    return None


def board_K(topics: Px4Topics) -> float | None:
    """Coldest that a barometer was."""
    for name in ("vehicle_air_data", "sensor_combined"):
        samples = topics.measured(name)
        if samples is not None and (found := coldest_K(samples.get("baro_temp_celcius"))):
            return found
    return None


def in_air(topics: Px4Topics, arming: tuple[Interval, ...] | None) -> tuple[Interval, ...] | None:
    """Spans not landed while armed; None if the log has no land detector."""
    detector = topics.first("vehicle_land_detected")
    landed = None if detector is None else detector.get("landed")
    if detector is None or landed is None:
        return None
    flying = spans_of(detector.time_s, landed == 0, topics.end_s)
    return flying if arming is None else overlap(flying, arming)


def modes(topics: Px4Topics) -> tuple[ModeSpan, ...]:
    """Flight modes by PX4's own names."""
    status = topics.first("vehicle_status")
    state = None if status is None else status.get("nav_state")
    if status is None or state is None:
        return ()
    names = [NAV_STATES.get(int(n), f"NAV_STATE_{int(n)}") for n in state]
    return mode_spans(status.time_s, names, topics.end_s)


def start_utc(topics: Px4Topics) -> datetime | None:
    """Time of day at the log's zero, from GPS; None without a fix."""
    for name in ("vehicle_gps_position", "sensor_gps"):
        gps = topics.measured(name)
        utc_us = None if gps is None else gps.get("time_utc_usec")
        if gps is None or utc_us is None:
            continue
        utc_s = utc_us * MICRO
        known = (utc_s > EARLIEST) & (utc_s < LATEST)
        if known.any():
            zero = float(np.median(utc_s[known] - gps.time_s[known]))
            if EARLIEST < zero < LATEST:
                return datetime.fromtimestamp(0, UTC) + timedelta(seconds=round(zero, 3))
    return None
