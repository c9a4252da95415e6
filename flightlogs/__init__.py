"""Flight logs in, one battery and one flight on one clock out.

    log = read_log(stream, name="flight.ulg")        any known format -> FlightLog
    sensor = read_sensor(stream, name="flight.csv")  current sensor -> SensorLog
    recording = assemble(log, sensor=align(sensor, log))

Formats are recognised by their bytes; their readers are imported when first needed. What cannot be
read raises `LogError`; what can be read but not analysed raises `Refusal`, with a code; what is
doubtful or was repaired is a `LogWarning` in the result.
"""

from flightlogs.align import AlignedSensor, AlignmentRefused, align
from flightlogs.assemble import assemble
from flightlogs.detect import HEAD_BYTES, Format, detect
from flightlogs.errors import LogDamaged, LogError, LogWarning, NotALog, Refusal
from flightlogs.log import BatteryLog, Channel, FlightLog, Interval, ModeSpan, Vehicle
from flightlogs.read import read_log
from flightlogs.recording import ClockFit, Recording
from flightlogs.sensor import SensorLog, read_sensor

__all__ = [
    "HEAD_BYTES",
    "AlignedSensor",
    "AlignmentRefused",
    "BatteryLog",
    "Channel",
    "ClockFit",
    "FlightLog",
    "Format",
    "Interval",
    "LogDamaged",
    "LogError",
    "LogWarning",
    "ModeSpan",
    "NotALog",
    "Recording",
    "Refusal",
    "SensorLog",
    "Vehicle",
    "align",
    "assemble",
    "detect",
    "read_log",
    "read_sensor",
]
