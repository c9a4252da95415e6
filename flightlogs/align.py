"""The sensor's clock mapped to the autopilot's by what both saw: the current."""

from dataclasses import dataclass

from flightlogs.errors import LogError, LogWarning
from flightlogs.log import FlightLog, FloatArray, check_increasing, frozen_array
from flightlogs.recording import ClockFit
from flightlogs.sensor import SensorLog


class AlignmentRefused(LogError):
    """The evidence does not fix the sensor's clock; `code` names the reason.

    Codes: `too_short` (too few common samples), `no_overlap` (no lag at which the recordings can
    meet), `no_reference` (the log has neither a usable current nor thrust), `steady` (nothing
    happens that could fix a lag), `ambiguous` (two lags fit nearly equally well), `wrong_flight`
    (no lag at which the recordings agree as two records of one flight do), `uncertain` (the
    standard deviation of the clock is larger than usable).
    """

    def __init__(self, code: str, message: str) -> None:
        self.code = code
        super().__init__(message)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AlignedSensor:
    """The sensor's recording on the autopilot's clock.

    Attributes:
        time_s: (n,) on the clock of the flight log, strictly increasing.
        current_A: (n,) as in `SensorLog`: discharge positive, NaN where not measured.
        fit: the map of the clocks and how well it is known.
        warnings: everything doubtful in the alignment.
    """

    time_s: FloatArray
    current_A: FloatArray
    fit: ClockFit
    warnings: tuple[LogWarning, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_s", frozen_array(self.time_s))
        object.__setattr__(self, "current_A", frozen_array(self.current_A))
        check_increasing(self.time_s, "aligned sensor")


def align(sensor: SensorLog, log: FlightLog, *, battery: int | None = None) -> AlignedSensor:
    """Map the sensor's clock to that of the flight log: t_log = t_sensor (1 + drift) + offset.

    Args:
        sensor: recording of the current sensor.
        log: flight log of the same flight.
        battery: instance of the battery the sensor sits at; None takes the one whose current
            fits best.

    Raises:
        AlignmentRefused: the evidence does not fix the clock; its `code` names the reason.
    """
    raise AlignmentRefused("no_reference", f"{sensor.name}, {log.name}: battery {battery}")
