"""Which battery of a log is analysed and how many cells it has, or why there is none."""

from dataclasses import dataclass

import numpy as np

from flightlogs.errors import LogWarning, Refusal
from flightlogs.flight import Flights
from flightlogs.log import BatteryLog, FlightLog, FloatArray
from flightlogs.resample import charge_C, resample, within

LEAST_FLIGHT_SAMPLES = 10
INDIFFERENT = 0.2  # weight of a battery whose current ignores the thrust
TOP = 99  # % of the samples: what is beyond is noise
CELL_FULL_V = 4.25  # a full LiPo or Li-ion cell has 4.2 V
LIHV_FULL_V = 4.36  # 4.35 V, and what voltage dividers are off by
CELL_RANGE_V = (2.8, 4.4)  # of a cell in flight, on average


@dataclass(frozen=True, slots=True)
class Cells:
    """Cells in series, and the warning if they were not simply read."""

    series: int
    inferred: bool
    warnings: tuple[LogWarning, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Elsewhere:
    """What a current sensor gives, and the battery whose current it follows, or None."""

    current: bool = False
    voltage_V: FloatArray | None = None
    followed: int | None = None


NOWHERE = Elsewhere()


def choose_battery(
    log: FlightLog, flights: Flights, wanted: int | None, elsewhere: Elsewhere = NOWHERE
) -> tuple[BatteryLog, tuple[LogWarning, ...]]:
    """The battery asked for, else that of the current sensor, else the one of the propulsion.

    The last is the one that gave the most energy in flight, weighed by how its current follows the
    thrust: propulsion takes nine tenths and more of what a multirotor draws.

    Args:
        log: the log.
        flights: the flight chosen.
        wanted: instance, or None.
        elsewhere: what a current sensor gives.

    Raises:
        Refusal: `no_battery`, `no_current` or `no_voltage`.
    """
    if wanted is not None:
        battery, reason = _wanted(log, wanted), "asked for"
    elif elsewhere.followed is not None:
        battery, reason = (
            _wanted(log, elsewhere.followed),
            "its current is the one that the sensor follows",
        )
    else:
        battery, reason = _propulsion(log, flights), "it carries the propulsion current"
    _refuse_unmeasured(log, battery, elsewhere)
    others = [b for b in log.batteries if b is not battery]
    if not others:
        return battery, ()
    named = ", ".join(f"{b.instance}: {b.label}" for b in others)
    text = f"battery {battery.instance} ({battery.label}) is analysed, {reason}; not: {named}"
    return battery, (LogWarning("several_batteries", text, battery.label),)


def _wanted(log: FlightLog, wanted: int) -> BatteryLog:
    for battery in log.batteries:
        if battery.instance == wanted:
            return battery
    named = ", ".join(f"{b.instance} ({b.label})" for b in log.batteries) or "none"
    raise Refusal("no_battery", f"{log.name}: no battery {wanted}; the log has: {named}")


def _propulsion(log: FlightLog, flights: Flights) -> BatteryLog:
    if not log.batteries:
        raise Refusal(
            "no_battery",
            f"{log.name}: no battery channel in the log; enable the power module and its logging",
        )
    return max(
        log.batteries, key=lambda b: (_propulsion_J(b, log, flights), b.voltage_V is not None)
    )


def _propulsion_J(battery: BatteryLog, log: FlightLog, flights: Flights) -> float:
    """Energy drawn in flight, less where the current does not follow the thrust; -inf if unknown.

    A reversed current draws less than none, and is better than an unknown one.
    """
    if battery.current_A is None:
        return -np.inf
    flying = within(battery.time_s, flights.in_air) & np.isfinite(battery.current_A)
    t, current = battery.time_s[flying], battery.current_A[flying]
    volts = 1.0 if battery.voltage_V is None else float(np.nanmedian(battery.voltage_V))
    weight = 1.0
    if log.thrust is not None and t.size >= LEAST_FLIGHT_SAMPLES:
        thrust = resample(log.thrust.time_s, log.thrust.values, t)
        known = np.isfinite(thrust)
        if known.sum() > 2 and np.ptp(thrust[known]) > 0 and np.ptp(current[known]) > 0:
            follows = float(np.corrcoef(thrust[known], current[known])[0, 1])
            weight = max(follows, INDIFFERENT)
    return volts * charge_C(t, current) * weight


def _refuse_unmeasured(log: FlightLog, battery: BatteryLog, elsewhere: Elsewhere) -> None:
    no_current = battery.current_A is None and not elsewhere.current
    no_voltage = battery.voltage_V is None
    if no_current and no_voltage:
        raise Refusal(
            "no_battery",
            f"{log.name}: {battery.label}: neither current nor voltage was measured: the power "
            "module is not connected or not configured; a current sensor's CSV can replace it "
            "(beside the log as NAME.sensor.csv, or --sensor) if the log tells the number of cells",
        )
    if no_current:
        raise Refusal(
            "no_current",
            f"{log.name}: {battery.label}: the current was not measured ({_unmeasured(log)}); give "
            "the CSV of a current sensor (beside the log as NAME.sensor.csv, or --sensor), or "
            "correct the power module's current input",
        )
    told = bool(battery.series) or of_a_pack(elsewhere.voltage_V, None)
    if no_voltage and not (elsewhere.current and told):
        raise Refusal(
            "no_voltage",
            f"{log.name}: {battery.label}: the voltage was not measured: there is nothing to "
            "compare the model with; correct the power module's voltage input",
        )


def _unmeasured(log: FlightLog) -> str:
    said = [w.message for w in log.warnings if w.code == "current_not_measured"]
    return said[0] if said else "no sample of it"


def cells_of(voltage_V: FloatArray) -> int:
    """The fewest cells in series that can have these finite voltages (n,)."""
    return max(1, int(np.ceil(float(np.percentile(voltage_V, TOP)) / CELL_FULL_V)))


def of_a_pack(voltage_V: FloatArray | None, series: int | None) -> bool:
    """Whether so many cells, or as many as it has by itself, can have this voltage (n,)."""
    known_V = np.empty(0) if voltage_V is None else voltage_V[np.isfinite(voltage_V)]
    if known_V.size < LEAST_FLIGHT_SAMPLES:
        return False
    low, high = CELL_RANGE_V
    return low <= float(np.median(known_V)) / (series or cells_of(known_V)) <= high


def choose_series(battery: BatteryLog, voltage_V: FloatArray | None, name: str) -> Cells:
    """Cells in series as the log says where the voltage allows it, else from the voltage."""
    if voltage_V is None:
        if battery.series:
            return Cells(series=battery.series, inferred=False)
        raise Refusal("no_voltage", f"{name}: {battery.label}: neither voltage nor cell count")
    known = voltage_V[np.isfinite(voltage_V)]
    middle, top = float(np.median(known)), float(np.percentile(known, TOP))
    low, high = CELL_RANGE_V
    if battery.series and low * battery.series <= middle <= high * battery.series:
        return Cells(series=battery.series, inferred=False)
    series = cells_of(known)
    said = f"the log says {battery.series}" if battery.series else "the log does not say"
    fewer = series - 1
    lihv = (
        f", and {fewer} full LiHV cells ({top / fewer:.2f} V each) look the same"
        if top <= LIHV_FULL_V * fewer
        else ""
    )
    text = (
        f"{series} cells in series taken from the voltage ({top:.2f} V at most, {top / series:.2f} "
        f"a cell; {said}). A pack that was not full has more{lihv}: state series in pack.toml"
    )
    warning = LogWarning("cell_count_inferred", text, battery.label)
    return Cells(series=series, inferred=True, warnings=(warning,))
