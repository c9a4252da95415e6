"""`SensorLog`: what the separate current sensor recorded, on its own clock."""

from dataclasses import dataclass, fields

import numpy as np

from flightlogs.errors import LogError, LogWarning
from flightlogs.log import FloatArray, check_increasing, frozen_array


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorCounts:
    """How many rows of the file met which fate; each that is not zero has a warning of its own.

    Attributes:
        rows: data rows met, whole or not, repeated headers and comments not counted.
        kept: rows in the `SensorLog`.
        malformed: rows that could not be read as numbers (the truncated last one included).
        repeated_headers: header lines after the first.
        stray_stamps: rows whose stamp jumps away and back, dropped.
        duplicate_stamps: rows that repeat the stamp before them, dropped.
        resets: times the clock went back for good.
        rows_after_reset: rows of the pieces that were left out because of the resets.
        missing: kept rows without a current (NaN, empty).
        absurd: kept rows whose current no battery can give, now NaN.
        saturated: kept rows at a rail of the sensor, now NaN.
        gaps: places where the step is more than 2.5 times the usual one.
    """

    rows: int = 0
    kept: int = 0
    malformed: int = 0
    repeated_headers: int = 0
    stray_stamps: int = 0
    duplicate_stamps: int = 0
    resets: int = 0
    rows_after_reset: int = 0
    missing: int = 0
    absurd: int = 0
    saturated: int = 0
    gaps: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorLog:
    """The recording of a current sensor with a clock of its own.

    Attributes:
        name: file name, for messages.
        time_s: (n,) since the first kept sample, strictly increasing; gaps stay gaps.
        current_A: (n,) discharge positive; NaN where not measured, absurd or at a rail.
        voltage_V: (n,) at the sensor, NaN where not measured, or None.
        inverted: True if the file counts discharge negative (the sign was turned).
        counts: how many rows met which fate.
        warnings: everything doubtful or repaired.
    """

    name: str
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray | None
    inverted: bool
    counts: SensorCounts
    warnings: tuple[LogWarning, ...] = ()

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, f.name, frozen_array(value))
                if value.shape != self.time_s.shape:
                    raise LogError(
                        f"{self.name}: {f.name} {value.shape}, {self.time_s.shape} times"
                    )
        check_increasing(self.time_s, self.name)
