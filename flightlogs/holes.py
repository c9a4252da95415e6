"""Where in a flight a channel has no samples, its beginning and end included."""

import numpy as np

from flightlogs.errors import LogWarning
from flightlogs.log import FloatArray, Interval
from flightlogs.resample import bridged_s, within

USUAL_STEPS = 2.5  # a longer step between samples is a gap
LOST_SHARE = 0.02  # of the samples in flight; fewer are lost one by one in any log


def usual_step_s(time_s: FloatArray) -> float:
    """Median step of (n,) sample times; 0 for fewer than two."""
    return float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.0


def longest_step_s(time_s: FloatArray) -> float:
    """The longest step between (n,) sample times that is no gap."""
    return max(bridged_s(time_s), USUAL_STEPS * usual_step_s(time_s))


def measured_charge_C(time_s: FloatArray, current_A: FloatArray) -> float:
    """Integral of a current (n,), straight between samples; nothing in its gaps."""
    steps = np.diff(time_s)
    steps = np.where(steps <= longest_step_s(time_s), steps, 0.0)
    return float(np.sum(steps * (current_A[1:] + current_A[:-1]) / 2))


def holes(time_s: FloatArray, flight: Interval) -> tuple[Interval, ...]:
    """The parts of the flight between, before or after (n,) sample times that are no usual step."""
    t = time_s[within(time_s, (flight,))]
    edges = np.concatenate([[flight.start_s], t, [flight.stop_s]])
    long = np.flatnonzero(np.diff(edges) > longest_step_s(t))
    return tuple(Interval(float(edges[k]), float(edges[k + 1])) for k in long)


def gap_warning(time_s: FloatArray, flight: Interval, where: str) -> LogWarning | None:
    """For how long, and where, the flight has no sample of the current (n,)."""
    found = holes(time_s, flight)
    if not found:
        return None
    longest = max(found, key=lambda hole: hole.duration_s)
    usual_s = usual_step_s(time_s[within(time_s, (flight,))])
    return LogWarning(
        "gaps_in_current",
        f"{len(found)} gaps in the current, {sum(h.duration_s for h in found):.1f} of the "
        f"{flight.duration_s:.1f} s in flight, the longest {longest.duration_s:.1f} s "
        f"{_place(longest, flight)} (usual step {usual_s:.2f} s): the charge in them is not "
        "measured",
        where,
    )


def voltage_warning(voltage_V: FloatArray, where: str) -> LogWarning | None:
    """For how much of the current samples in flight (n,) no voltage was measured."""
    share = float(np.mean(np.isnan(voltage_V))) if voltage_V.size else 0.0
    if share <= LOST_SHARE:
        return None
    return LogWarning(
        "gaps_in_voltage",
        f"the voltage is not known in {share:.0%} of the flight: the model is compared with the "
        "rest alone, and lowest voltage and resistance are of it",
        where,
    )


def _place(hole: Interval, flight: Interval) -> str:
    if hole.start_s == flight.start_s:
        return "from take-off on"
    if hole.stop_s == flight.stop_s:
        return "up to landing"
    return f"from {hole.start_s:.1f} s of the log on"
