"""Which flight of a log is analysed, and which logs have none that can be."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightlogs.errors import LogWarning, Refusal
from flightlogs.holes import measured_charge_C
from flightlogs.log import BatteryLog, FlightLog, Interval, Vehicle
from flightlogs.spans import IN_AIR_THROTTLE, flying_by_throttle, overlap, spans_of, without_dips

SHORTEST_FLIGHT_S = 5.0  # shorter hops have no hover and no motion to speak of
EDGE_S = 1.0  # a flight that starts so soon after the log does was under way
LAST_S = 0.2  # a landing said later may be the impact that took the power
CONTRAST = 3.0  # flight draws at least this many times what the electronics on the ground draw
FLIGHT_SHARE = 0.3  # of the current in flight: above it the motors carry the vehicle
AH_C = 3600.0
REFUSED = {
    Vehicle.FIXED_WING: ("fixed_wing", "a fixed wing"),
    Vehicle.VTOL: ("vtol", "a VTOL"),
    Vehicle.HELICOPTER: ("helicopter", "a helicopter"),
    Vehicle.OTHER: ("not_multirotor", "no multirotor"),
}


@dataclass(frozen=True, slots=True)
class Flights:
    """The flight chosen and those that were not.

    Attributes:
        flight: take-off to landing of the one with the most time in the air, of what was recorded.
        window: the part of the log that belongs to it: up to the neighbouring armings.
        others: armed spans that are not analysed.
        in_air: spans in the air, of all flights.
        warnings: several flights, flights cut by the log's ends, guessed flight.
    """

    flight: Interval
    window: Interval
    others: tuple[Interval, ...]
    in_air: tuple[Interval, ...]
    warnings: tuple[LogWarning, ...]


def refuse_other_vehicles(log: FlightLog) -> None:
    """Refusal unless the log is of a multirotor, or does not say what of."""
    if log.vehicle in REFUSED:
        code, kind = REFUSED[log.vehicle]
        raise Refusal(
            code,
            f"{log.name}: {kind} ({log.vehicle_label}); hover, vertical and horizontal flight are "
            "defined for multirotors only. If this is one, correct the airframe parameters",
        )


def choose_flight(log: FlightLog, recorded: Interval | None = None) -> Flights:
    """The flight with the most time in the air; Refusal `no_flight` or `too_short`.

    Args:
        log: the log.
        recorded: what a current sensor recorded of it: the time in the air within that counts.
    """
    in_air, warnings = _in_air(log)
    armings = log.armed or (Interval(0.0, log.duration_s),)
    flown = [(a, overlap(in_air, (a,))) for a in armings]
    flown = [(a, air) for a, air in flown if air]
    if not flown:
        raise Refusal("no_flight", f"{log.name}: {_why_no_flight(log)}")
    longest = max(flown, key=lambda pair: _sum_s(pair[1]))
    counting = (recorded or Interval(-np.inf, np.inf),)
    chosen = max((longest, *flown), key=lambda pair: _sum_s(overlap(pair[1], counting)))
    why = "the longest" if chosen is longest else "the one that the sensor recorded"
    arming, air = chosen
    time_in_air = _sum_s(air)
    if time_in_air < SHORTEST_FLIGHT_S:
        raise Refusal(
            "too_short",
            f"{log.name}: {time_in_air:.1f} s in the air, {why} of {len(flown)} flights; "
            f"at least {SHORTEST_FLIGHT_S:g} s are needed",
        )
    flight = Interval(air[0].start_s, air[-1].stop_s)
    others = tuple(a for a in armings if a is not arming)
    said = [*warnings, *_edges(flight, arming, log), *_several(flown, arming, why, log)]
    return Flights(flight, _window(arming, armings, log), others, in_air, tuple(said))


def _sum_s(spans: Sequence[Interval]) -> float:
    return sum(s.duration_s for s in spans)


def _in_air(log: FlightLog) -> tuple[tuple[Interval, ...], list[LogWarning]]:
    if log.in_air is not None:
        return log.in_air, []
    found, basis = _by_thrust(log), "thrust"
    if not found:
        found, basis = _by_current(log), "current"
    text = f"the log does not say when it flew: judged by the {basis}"
    return found, [LogWarning("in_air_inferred", text)] if found else []


def _by_thrust(log: FlightLog) -> tuple[Interval, ...]:
    if log.thrust is None or not log.armed:
        return ()
    spans = flying_by_throttle(
        log.thrust.time_s, log.thrust.values, IN_AIR_THROTTLE, log.duration_s
    )
    return overlap(spans, log.armed)


def _by_current(log: FlightLog) -> tuple[Interval, ...]:
    """Where the largest current of a battery is well above that of the electronics alone."""
    for battery in sorted(_with_current(log.batteries), key=_peak_A, reverse=True):
        assert battery.current_A is not None
        known = np.isfinite(battery.current_A)
        t, current = battery.time_s[known], battery.current_A[known]
        idle, flying = np.percentile(current, [5, 90])
        if flying < CONTRAST * max(float(idle), 0.0):
            continue
        spans = without_dips(spans_of(t, current > FLIGHT_SHARE * flying, log.duration_s))
        return overlap(spans, log.armed) if log.armed else spans
    return ()


def _why_no_flight(log: FlightLog) -> str:
    armed_s = sum(a.duration_s for a in log.armed)
    armed = f"armed for {armed_s:.1f} s" if log.armed else "never armed"
    judge = "no sign of a take-off" if log.in_air is None else "never in the air"
    return (
        f"{judge}: {armed} in {log.duration_s:.1f} s. A bench run, or the log of the flight is "
        "another file"
    )


def _edges(flight: Interval, arming: Interval, log: FlightLog) -> list[LogWarning]:
    """Where the log begins or ends with the flight; it ends with a landing that was logged."""
    warnings = []
    landed = flight.stop_s < min(arming.stop_s, log.duration_s - LAST_S)
    if flight.start_s < EDGE_S:
        text = "the log starts in the air: take-off and the charge drawn before are missing"
        warnings.append(LogWarning("starts_in_air", text, f"{flight.start_s:.1f} s"))
    if flight.stop_s > log.duration_s - EDGE_S and not landed:
        text = "the log ends in the air: cut off, or a crash"
        warnings.append(LogWarning("ends_in_air", text, f"{flight.stop_s:.1f} s"))
    return warnings


def _several(
    flown: Sequence[tuple[Interval, tuple[Interval, ...]]],
    chosen: Interval,
    why: str,
    log: FlightLog,
) -> list[LogWarning]:
    rest = [(a, _sum_s(air)) for a, air in flown if a is not chosen]
    if not rest:
        return []
    named = ", ".join(
        f"{a.start_s:.0f}-{a.stop_s:.0f} s ({air:.0f} s in the air)" for a, air in rest
    )
    drawn = sum(_drawn_Ah(log, chosen.start_s))
    before = f"; {drawn:.2f} Ah were drawn before it" if drawn > 0 else ""
    text = f"{len(flown)} flights in the log, {why} is analysed{before}; not: {named}"
    return [LogWarning("several_flights", text)]


def _drawn_Ah(log: FlightLog, until_s: float) -> list[float]:
    drawn = []
    for battery in _with_current(log.batteries):
        assert battery.current_A is not None
        known = np.isfinite(battery.current_A) & (battery.time_s < until_s)
        drawn.append(measured_charge_C(battery.time_s[known], battery.current_A[known]) / AH_C)
    return drawn


def _window(arming: Interval, armings: Sequence[Interval], log: FlightLog) -> Interval:
    before = [a.stop_s for a in armings if a.stop_s <= arming.start_s]
    after = [a.start_s for a in armings if a.start_s >= arming.stop_s]
    start = max(before, default=-EDGE_S)  # a sensor may have begun a flight before
    return Interval(float(start), float(min(after, default=log.duration_s + EDGE_S)))


def _with_current(batteries: Sequence[BatteryLog]) -> list[BatteryLog]:
    return [b for b in batteries if b.current_A is not None]


def _peak_A(battery: BatteryLog) -> float:
    assert battery.current_A is not None
    return float(np.nanmax(battery.current_A))
