"""What in a flight log can be held against the sensor's current."""

from dataclasses import dataclass, replace

import numpy as np

from flightlogs.held import measured_anew
from flightlogs.log import BatteryLog, FlightLog, FloatArray
from flightlogs.measured import LEAST_FLYING_A

MIN_SAMPLES = 100
MOST_ALIKE = 0.5
"""Share of equal values from which a channel counts as clamped."""
BATTERY_CURRENT, THRUST = "battery_current", "thrust"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """A channel of the log that follows the current.

    Attributes:
        method: BATTERY_CURRENT or THRUST.
        source: topic and field, for messages.
        time_s: (m,) on the log's clock, strictly increasing.
        values: (m,) finite; any scale and zero.
        battery: instance of the battery whose current it is, None for thrust.
    """

    method: str
    source: str
    time_s: FloatArray
    values: FloatArray
    battery: int | None = None


def reference(method: str, source: str, time_s: FloatArray, values: FloatArray) -> Reference | None:
    """The finite samples of a channel; None if they are too few, or clamped at one value."""
    keep = np.isfinite(values)
    t, v = time_s[keep], values[keep]
    if len(v) < MIN_SAMPLES:
        return None
    upper = v[v > 0.5 * float(np.percentile(v, 99))]  # what flies; the ground may well be constant
    same = np.unique(upper, return_counts=True)[1]
    if not same.size or same.max() > MOST_ALIKE * len(upper) or len(upper) < 0.05 * len(v):
        return None
    return Reference(method=method, source=source, time_s=t, values=v)


def of_battery(battery: BatteryLog) -> Reference | None:
    """Current of one battery, if there is one that moves and could carry the vehicle.

    Without what a sensor that is slower than its log repeats.
    """
    measured_A = battery.current_A
    if measured_A is None or np.nanpercentile(np.abs(measured_A), 99) < LEAST_FLYING_A:
        return None
    own_A = np.where(measured_anew(measured_A, measured_A), measured_A, np.nan)
    source = battery.current_source or battery.label
    found = reference(BATTERY_CURRENT, source, battery.time_s, own_A)
    return None if found is None else replace(found, battery=battery.instance)


def candidates(log: FlightLog, battery: int | None) -> tuple[Reference, ...]:
    """Usable currents, in order of appearance; where there is none, thrust; maybe nothing.

    Args:
        log: flight log.
        battery: instance of the only battery that counts, or None for all.
    """
    wanted = [b for b in log.batteries if battery in (None, b.instance)]
    currents = [r for b in wanted if (r := of_battery(b)) is not None]
    if currents or log.thrust is None:
        return tuple(currents)
    thrust = log.thrust
    found = reference(THRUST, thrust.source, thrust.time_s, thrust.values)
    return () if found is None else (found,)
