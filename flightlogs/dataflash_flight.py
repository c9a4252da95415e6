"""When an ArduCopter was armed and in the air, by its events, else by its throttle."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from flightlogs.dataflash_time import Timed, end_s
from flightlogs.errors import LogWarning
from flightlogs.log import Channel, FloatArray, Interval
from flightlogs.spans import IN_AIR_THROTTLE, flying_by_throttle, overlap, switched
from flightlogs.stamps import FileClock

ARMED, DISARMED, LANDED, AIRBORNE = 10, 11, 18, 28  # EV.Id
IDLE_MARGIN = 0.05
PERMILLE = 1e-3


def armed_spans(timed: Timed, clock: FileClock) -> tuple[Interval, ...]:
    """From EV, else from ARM; what is armed again was disarmed, see `_disarmed_between`."""
    found = _states(timed, "EV", "Id", (ARMED,), (DISARMED,))
    if not found[0].size:
        found = _states(timed, "ARM", "ArmState", (1,), (0,))
    landed_s, _ = _states(timed, "EV", "Id", (), (LANDED,))
    time_s, on = _disarmed_between(*found, landed_s, clock)
    return switched(time_s, on, start_s=0.0, end_s=end_s(timed))


def in_air_spans(
    timed: Timed,
    armed: tuple[Interval, ...],
    thrust: Channel | None,
    parameters: Mapping[str, float],
) -> tuple[tuple[Interval, ...] | None, tuple[LogWarning, ...]]:
    """By the events `not landed` and `land complete` while armed; without them by throttle."""
    time_s, on = _states(timed, "EV", "Id", (AIRBORNE,), (LANDED,))
    judged = switched(time_s, on, start_s=0.0, end_s=end_s(timed))
    if judged:
        return (overlap(judged, armed) if armed else judged), ()
    if thrust is None:
        return None, ()
    idle = parameters.get("THR_MIN", 0.0) * PERMILLE  # 3.x: throttle of the armed, landed vehicle
    threshold = max(IN_AIR_THROTTLE, idle + IDLE_MARGIN)
    flying = flying_by_throttle(thrust.time_s, thrust.values, threshold, end_s(timed))
    inside = overlap(flying, armed) if armed else flying
    message = f"the log does not say when it flew: judged by throttle above {threshold:.0%}"
    return inside, (LogWarning("in_air_inferred", message, thrust.source),)


def _states(
    timed: Timed, name: str, label: str, on: tuple[int, ...], off: tuple[int, ...]
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Times and states of the rows that switch something."""
    if name not in timed or label not in timed[name][0].numbers:
        return np.zeros(0), np.zeros(0, dtype=bool)
    table, time_s = timed[name]
    number = table.numbers[label]
    rows = np.isin(number, on + off) & np.isfinite(time_s)
    return time_s[rows], np.isin(number[rows], on)


def _disarmed_between(
    time_s: FloatArray, on: npt.NDArray[np.bool_], landed_s: FloatArray, clock: FileClock
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Times and states with a disarming between any two armings that follow each other.

    Only what is disarmed can be armed, and the logger is off while disarmed: the disarming is put
    where the log pauses longest, after the last landing if one was logged.
    """
    logged = np.sort(clock.time_s[np.isfinite(clock.time_s)])
    times, states = list(time_s), list(on)
    for i in range(len(on) - 1, 0, -1):
        if on[i] and on[i - 1]:
            down = landed_s[(landed_s >= time_s[i - 1]) & (landed_s < time_s[i])]
            since_s = float(np.max(down, initial=time_s[i - 1]))
            between = logged[(logged >= since_s) & (logged <= time_s[i])]
            if between.size > 1:
                times.insert(i, between[int(np.argmax(np.diff(between)))])
                states.insert(i, np.False_)
    return np.array(times), np.array(states, dtype=bool)
