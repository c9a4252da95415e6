"""One flight of one battery out of a `FlightLog`: the `Recording`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flightlogs import quality
from flightlogs.ardupilot import untouched_capacity
from flightlogs.errors import LogWarning, Refusal
from flightlogs.flight import Flights, choose_flight, refuse_other_vehicles
from flightlogs.held import current_held_warning, measured_anew, voltage_held_warning
from flightlogs.holes import gap_warning, measured_charge_C, voltage_warning
from flightlogs.log import BatteryLog, Channel, FlightLog, FloatArray, Interval, Vehicle
from flightlogs.measured import LEAST_FLYING_A
from flightlogs.recording import Recording
from flightlogs.resample import resample, within
from flightlogs.select import (
    LEAST_FLIGHT_SAMPLES,
    NOWHERE,
    Elsewhere,
    choose_battery,
    choose_series,
)
from flightlogs.voltage import Voltage, choose_voltage, where_measured

if TYPE_CHECKING:
    from flightlogs.align import AlignedSensor

AH_C = 3600.0
NEARLY_ALL = 95  # % of the current in flight
MOST_DRAWN = 1.2  # of the capacity: a pack gives 1.1 of its label, and sensors are 10 % off


@dataclass(frozen=True, slots=True)
class _Current:
    """The current that is used: (n,) times and values, all finite.

    Of these `repeats` were none of their own, and are straight between the others.
    """

    time_s: FloatArray
    values: FloatArray
    source: str
    repeats: int = 0


def assemble(
    log: FlightLog, *, battery: int | None = None, sensor: "AlignedSensor | None" = None
) -> Recording:
    """Choose battery and flight, check them, and put all channels on the times of the current.

    Args:
        log: what a reader found.
        battery: instance of the battery to analyse; None takes the one that the sensor follows, or
            else that carries propulsion.
        sensor: the current sensor's recording on the log's clock; its current is then used.

    Raises:
        Refusal: the flight cannot be analysed; its `code` names the reason.
    """
    refuse_other_vehicles(log)
    flights = choose_flight(log, None if sensor is None else _recorded(sensor))
    pack, pack_warnings = choose_battery(log, flights, battery, _elsewhere(sensor))
    voltage = choose_voltage(pack, sensor)
    cells = choose_series(pack, voltage.values_V, log.name)
    current = _current(log, pack, sensor, flights)
    t = current.time_s
    velocity, velocity_warnings = _credible_velocity(log, flights)
    slope = _slope(voltage, current, flights)
    ratio = _coulomb(pack, current, flights)
    capacity_C, capacity_doubt = _capacity(log, pack, current)
    straight_V = _on(voltage.time_s, voltage.values_V, t, fill=True)
    voltage_V = straight_V
    cells_V = _on(pack.time_s, pack.cell_voltage_V, t)
    if sensor is not None:
        voltage_V = where_measured(voltage.time_s, voltage.values_V, t)
        cells_V = where_measured(pack.time_s, pack.cell_voltage_V, t)
    flying = within(t, (flights.flight,))
    doubts = (
        quality.sign_warning(t[flying], current.values[flying], current.source),
        quality.scale_warning(slope, cells.series, capacity_C, current.source),
        quality.coulomb_warning(ratio, current.source),
        gap_warning(t, flights.flight, current.source),
        None if voltage.values_V is None else voltage_warning(straight_V[flying], voltage.source),
        quality.saturation_warning(current.values[flying], current.source),
        current_held_warning(current.repeats, t.size, current.source),
        voltage_held_warning(voltage_V[flying], current.values[flying], voltage.source),
        capacity_doubt,
        _simulation_warning(log),
        _unknown_vehicle(log),
    )
    return Recording(
        name=log.name,
        battery=pack.label,
        other_batteries=tuple(b.label for b in log.batteries if b is not pack),
        time_s=t,
        current_A=current.values,
        current_source="autopilot" if sensor is None else "sensor",
        voltage_V=voltage_V,
        temperature_K=None
        if pack.temperature_K is None
        else _on(pack.time_s, pack.temperature_K, t),
        cell_voltage_V=None if pack.cell_voltage_V is None else cells_V,
        velocity_m_s=_channel(velocity, t),
        velocity_setpoint_m_s=_channel(log.velocity_setpoint_m_s, t),
        setpoint_source=log.velocity_setpoint_m_s.source if log.velocity_setpoint_m_s else "",
        position_setpoint_m=_channel(log.position_setpoint_m, t),
        in_air=within(t, flights.in_air),
        flight=flights.flight,
        other_flights=flights.others,
        modes=log.modes,
        sticks=log.sticks,
        series=cells.series,
        series_inferred=cells.inferred,
        capacity_C=capacity_C,
        serial=pack.serial,
        board_K=log.board_K,
        coulomb_check=ratio,
        resistance_ohm=None if slope is None else slope.ohm,
        alignment=None if sensor is None else sensor.fit,
        warnings=(
            *log.warnings,
            *flights.warnings,
            *pack_warnings,
            *voltage.warnings,
            *cells.warnings,
            *velocity_warnings,
            *(w for w in doubts if w is not None),
            *(sensor.warnings if sensor is not None else ()),
        ),
    )


def _refuse_idle(flown_A: FloatArray, name: str, source: str) -> None:
    """Refusal `no_current` where nearly all of it carries no multirotor."""
    most_A = float(np.percentile(flown_A, NEARLY_ALL))
    if most_A < LEAST_FLYING_A:
        raise Refusal(
            "no_current",
            f"{name}: {NEARLY_ALL} % of the current in flight ({source}) is below {most_A:.3g} A, "
            f"which carries no multirotor; at least {LEAST_FLYING_A:g} A are expected: the sensor "
            "is not wired, or its scale is off. Correct it, or give the CSV of a current sensor "
            "(beside the log as NAME.sensor.csv, or --sensor)",
        )


def _elsewhere(sensor: "AlignedSensor | None") -> Elsewhere:
    if sensor is None:
        return NOWHERE
    return Elsewhere(current=True, voltage_V=sensor.voltage_V, followed=sensor.battery)


def _recorded(sensor: "AlignedSensor") -> Interval | None:
    """From the first to the last sample that the sensor measured."""
    known = sensor.time_s[np.isfinite(sensor.current_A)]
    return Interval(float(known[0]), float(known[-1])) if known.size else None


def _current(
    log: FlightLog, pack: BatteryLog, sensor: "AlignedSensor | None", flights: Flights
) -> _Current:
    """The samples that were measured within the flight's part of the log."""
    if sensor is not None:
        time_s, values, source = sensor.time_s, sensor.current_A, "sensor"
    else:
        assert pack.current_A is not None
        time_s, values, source = pack.time_s, pack.current_A, pack.current_source
    kept = np.isfinite(values) & within(time_s, (flights.window,))
    time_s, values = time_s[kept], values[kept]
    in_flight = int(within(time_s, (flights.flight,)).sum())
    if in_flight < LEAST_FLIGHT_SAMPLES:
        raise Refusal(
            "too_short",
            f"{log.name}: {in_flight} samples of the current ({source}) between "
            f"{flights.flight.start_s:.1f} and {flights.flight.stop_s:.1f} s, where it flew; "
            f"at least {LEAST_FLIGHT_SAMPLES} are needed",
        )
    _refuse_idle(np.abs(values[within(time_s, (flights.flight,))]), log.name, source)
    if sensor is not None:
        return _Current(time_s, values, source)
    own = measured_anew(values, values)
    straight_A = np.interp(time_s, time_s[own], values[own])
    return _Current(time_s, straight_A, source, int(np.count_nonzero(~own)))


def _on(
    time_s: FloatArray, values: FloatArray | None, at_s: FloatArray, *, fill: bool = False
) -> FloatArray:
    """A channel of the battery on other times; single samples not measured are bridged."""
    if values is None:
        return np.full(at_s.shape, np.nan)
    if not fill or values.ndim > 1:
        return resample(time_s, values, at_s)
    known = np.isfinite(values)
    return resample(time_s[known], values[known], at_s)


def _channel(channel: Channel | None, at_s: FloatArray) -> FloatArray | None:
    return None if channel is None else resample(channel.time_s, channel.values, at_s)


def _credible_velocity(
    log: FlightLog, flights: Flights
) -> tuple[Channel | None, tuple[LogWarning, ...]]:
    if log.velocity_m_s is None:
        return None, ()
    spans = (flights.flight,)
    doubt = quality.velocity_warning(log.velocity_m_s, log.altitude_m, spans)
    return (log.velocity_m_s, ()) if doubt is None else (None, (doubt,))


def _slope(voltage: Voltage, current: _Current, flights: Flights) -> quality.Slope | None:
    """At the times of the voltage: interpolating it instead would flatten it."""
    if voltage.values_V is None:
        return None
    flying = within(voltage.time_s, (flights.flight,))
    t = voltage.time_s[flying]
    return quality.resistance(
        t, resample(current.time_s, current.values, t), voltage.values_V[flying]
    )


def _coulomb(pack: BatteryLog, current: _Current, flights: Flights) -> float | None:
    flying = within(current.time_s, (flights.flight,))
    t = current.time_s[flying]
    counter = None if pack.charge_C is None else resample(pack.time_s, pack.charge_C, t)
    return quality.coulomb_check(t, current.values[flying], counter)


def _capacity(
    log: FlightLog, pack: BatteryLog, current: _Current
) -> tuple[float | None, LogWarning | None]:
    """What the log states, unless more was drawn in this flight than such a pack holds."""
    stated_C, drawn_C = pack.capacity_C, measured_charge_C(current.time_s, current.values)
    if stated_C is None:
        text = "the log does not say the pack's capacity: state it in pack.toml"
        return None, LogWarning("capacity_unknown", text, pack.label)
    if drawn_C <= MOST_DRAWN * stated_C:
        return stated_C, _default_capacity_warning(log, stated_C, pack.label)
    text = (
        f"the log states a capacity of {stated_C / AH_C:.3g} Ah, and {drawn_C / AH_C:.3g} Ah were "
        "drawn: it is not believed (or the current is logged too large); state it in pack.toml"
    )
    return None, LogWarning("capacity_doubtful", text, pack.label)


def _default_capacity_warning(log: FlightLog, stated_C: float, where: str) -> LogWarning | None:
    if not untouched_capacity(dict(log.parameters), stated_C):
        return None
    text = (
        f"the log states a capacity of {stated_C / AH_C:.3g} Ah, which is what ArduPilot takes "
        "where nobody entered one: the pack may have another; state it in pack.toml"
    )
    return LogWarning("capacity_doubtful", text, where)


def _simulation_warning(log: FlightLog) -> LogWarning | None:
    if not log.simulated:
        return None
    text = (
        "a simulated flight: its battery is the simulator's formula, not a battery, and nothing "
        "here says anything about a real one"
    )
    return LogWarning("simulated_log", text)


def _unknown_vehicle(log: FlightLog) -> LogWarning | None:
    if log.vehicle is not Vehicle.UNKNOWN:
        return None
    text = "the log does not say what kind of vehicle flew: taken as a multirotor"
    return LogWarning("vehicle_unknown", text)
