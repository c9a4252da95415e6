"""The voltage that is used, and which samples of the current it is measured at.

It is the autopilot's, or where it has none that of the current sensor.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flightlogs.errors import LogWarning
from flightlogs.log import BatteryLog, FloatArray
from flightlogs.resample import nearest, resample
from flightlogs.select import of_a_pack

if TYPE_CHECKING:
    from flightlogs.align import AlignedSensor


@dataclass(frozen=True, slots=True, kw_only=True)
class Voltage:
    """A voltage of the pack where it was measured.

    Attributes:
        time_s: (n,) on the clock of the log, strictly increasing.
        values_V: (n,) NaN where not measured; None if there is none at all.
        source: for messages.
        warnings: what is doubtful in it.
    """

    time_s: FloatArray
    values_V: FloatArray | None
    source: str
    warnings: tuple[LogWarning, ...] = ()


def choose_voltage(pack: BatteryLog, sensor: "AlignedSensor | None") -> Voltage:
    """That of the pack; where it has none that of the sensor, if a pack can have it."""
    own = Voltage(time_s=pack.time_s, values_V=pack.voltage_V, source=pack.label)
    if pack.voltage_V is not None or sensor is None or sensor.voltage_V is None:
        return own
    if not of_a_pack(sensor.voltage_V, pack.series):
        return own
    text = (
        "the log has no voltage of the pack: that of the current sensor is used, as it is where "
        "the sensor sits"
    )
    said = LogWarning("voltage_of_sensor", text, pack.label)
    return Voltage(
        time_s=sensor.time_s, values_V=sensor.voltage_V, source="sensor", warnings=(said,)
    )


def where_measured(time_s: FloatArray, values: FloatArray | None, on_s: FloatArray) -> FloatArray:
    """A channel drawn straight, kept only at the samples of the current next to its own.

    What is between them was not measured: to the noise it is silence, and a fit counts it as if it
    were another sample.

    Args:
        time_s: (n,) of the samples of the channel.
        values: (n,) or (n, k), NaN where not measured; None if the channel was not logged.
        on_s: (m,) of the samples of the current.

    Returns:
        (m,) or (m, k); NaN elsewhere.
    """
    if values is None:
        return np.full(on_s.shape, np.nan)
    if values.ndim > 1:
        return np.column_stack([where_measured(time_s, column, on_s) for column in values.T])
    known = np.isfinite(values)
    drawn = resample(time_s[known], values[known], on_s)
    return np.where(nearest(time_s[known], on_s), drawn, np.nan)
