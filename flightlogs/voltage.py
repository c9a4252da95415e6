"""The voltage that is used: the autopilot's, or where it has none that of the current sensor."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from flightlogs.errors import LogWarning
from flightlogs.log import BatteryLog, FloatArray
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
