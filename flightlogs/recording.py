"""`Recording`: one battery and one flight on one clock; what the rest of the program works on."""

from dataclasses import dataclass, fields

import numpy as np

from flightlogs.errors import LogError, LogWarning
from flightlogs.log import (
    Channel,
    FloatArray,
    Interval,
    ModeSpan,
    check_increasing,
    frozen_array,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockFit:
    """Map from the sensor's clock to the autopilot's: t_log = t_sensor * (1 + drift) + offset.

    Attributes:
        method: what the sensor current was matched to: `battery_current`, `thrust`.
        offset_s: autopilot time of the sensor's first sample minus zero [s]; the sensor's own times
            count from its first sample.
        drift_ppm: how much faster the autopilot's clock runs.
        correlation: of the two currents after alignment, 0..1.
        uncertainty_s: one standard deviation of the offset in mid flight.
        drift_uncertainty_ppm: one standard deviation.
        gain: sensor current / autopilot current where both exist, else None.
        bias_A: sensor current - gain * autopilot current where both exist, else None.
    """

    method: str
    offset_s: float
    drift_ppm: float
    correlation: float
    uncertainty_s: float
    drift_uncertainty_ppm: float
    gain: float | None
    bias_A: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """One battery during one flight, on the autopilot's clock.

    The time base is that of the current samples (autopilot or aligned sensor); the other channels
    are interpolated to it where they have samples close enough, NaN elsewhere. On the times of a
    sensor the voltages stand only at the samples next to those at which they were measured.

    Attributes:
        name: file the flight came from.
        battery: label of the battery used.
        other_batteries: labels of those not used.
        time_s: (n,) since the first sample of the log, strictly increasing; gaps stay gaps.
        current_A: (n,) discharge positive, finite.
        current_source: `sensor` or `autopilot`.
        voltage_V: (n,) at the pack terminals; NaN where not measured.
        temperature_K: (n,) or None.
        cell_voltage_V: (n, cells) or None.
        velocity_m_s: (n, 3) north, east, down; None if the log has no (credible) velocity.
        velocity_setpoint_m_s: (n, 3), NaN where not commanded, or None.
        setpoint_source: the logged topic that the setpoint came from, "" if none.
        position_setpoint_m: (n, 3) north, east, down, NaN where not commanded, or None.
        in_air: (n,) bool.
        flight: the span of the flight analysed (take-off to landing).
        other_flights: armed spans of the same log that are not analysed.
        modes: flight modes.
        sticks: as in FlightLog.
        series: cells in series.
        series_inferred: True if judged from the voltage.
        capacity_C: pack capacity as the log's parameters say, or None.
        serial: pack serial number or "".
        board_K: coldest that the autopilot's barometer was, or None.
        coulomb_check: integral of current / difference of the log's own counter, or None.
        resistance_ohm: slope of voltage on current under load, pack, or None.
        alignment: how the sensor's clock was mapped, None if no sensor.
        warnings: everything doubtful or repaired.
    """

    name: str
    battery: str
    other_batteries: tuple[str, ...]
    time_s: FloatArray
    current_A: FloatArray
    current_source: str
    voltage_V: FloatArray
    temperature_K: FloatArray | None
    cell_voltage_V: FloatArray | None
    velocity_m_s: FloatArray | None
    velocity_setpoint_m_s: FloatArray | None
    setpoint_source: str
    in_air: np.ndarray[tuple[int], np.dtype[np.bool_]]
    flight: Interval
    other_flights: tuple[Interval, ...] = ()
    modes: tuple[ModeSpan, ...] = ()
    position_setpoint_m: FloatArray | None = None
    sticks: Channel | None = None
    series: int
    series_inferred: bool
    capacity_C: float | None
    serial: str = ""
    board_K: float | None = None
    coulomb_check: float | None = None
    resistance_ohm: float | None = None
    alignment: ClockFit | None = None
    warnings: tuple[LogWarning, ...] = ()

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, np.ndarray):
                if value.shape[:1] != self.time_s.shape:
                    raise LogError(
                        f"{self.name}: {f.name} {value.shape}, {self.time_s.shape} times"
                    )
                if value.dtype != np.bool_:
                    object.__setattr__(self, f.name, frozen_array(value))
        check_increasing(self.time_s, self.name)
        if not np.all(np.isfinite(self.current_A)):
            raise LogError(f"{self.name}: current_A has samples that were not measured")
