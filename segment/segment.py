"""`Segment`: a stretch of one motion, and what it drew from the battery."""

from dataclasses import dataclass
from enum import Enum


class Motion(Enum):
    """What the vehicle was doing."""

    GROUND = "ground"
    TAKEOFF = "takeoff"
    LANDING = "landing"
    HOVER = "hover"
    VERTICAL = "vertical"
    HORIZONTAL = "horizontal"
    MIXED = "mixed"


class Basis(Enum):
    """What a segment's motion was decided by."""

    SETPOINT = "setpoint"
    POSITION_SETPOINT = "position_setpoint"
    STICKS = "sticks"
    VELOCITY = "velocity"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadStatistics:
    """Of the current (discharge positive) and voltage in a span; gaps carry no charge.

    Attributes:
        charge_C: integral of the current.
        energy_J: integral of current times voltage; NaN if no voltage.
        mean_A: time average.
        rms_A: root of the time average of the square.
        p99_A: 99th percentile over time.
        ripple_A: standard deviation about the moving average.
    """

    charge_C: float
    energy_J: float
    mean_A: float
    rms_A: float
    p99_A: float
    ripple_A: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """Half-open [start_s, stop_s) on the recording's clock; segments are ordered and disjoint."""

    motion: Motion
    start_s: float
    stop_s: float
    basis: Basis
    load: LoadStatistics

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return self.stop_s - self.start_s
