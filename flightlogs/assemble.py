"""One flight of one battery out of a `FlightLog`: the `Recording`."""

from typing import TYPE_CHECKING

from flightlogs.log import FlightLog
from flightlogs.recording import Recording

if TYPE_CHECKING:
    from flightlogs.align import AlignedSensor


def assemble(
    log: FlightLog, *, battery: int | None = None, sensor: "AlignedSensor | None" = None
) -> Recording:
    """Choose battery and flight, check them, and put all channels on the times of the current."""
    raise NotImplementedError(f"{log.name} {battery} {sensor}")
