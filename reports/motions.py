"""What each motion drew in the whole flight: its segments taken together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flightlogs.recording import Recording
from segment.segment import LoadStatistics, Motion, Segment

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLoad:
    """All segments of one motion.

    Attributes:
        motion: which one.
        segments: how many there are.
        time_s: their total duration.
        load: of all of them together.
    """

    motion: Motion
    segments: int
    time_s: float
    load: LoadStatistics


def motion_loads(recording: Recording, segments: Sequence[Segment]) -> Mapping[Motion, MotionLoad]:
    """Motion -> its load, for every motion that occurs, in the order of `Motion`."""
    found = {m: [s for s in segments if s.motion is m] for m in Motion}
    return {m: _together(recording, m, parts) for m, parts in found.items() if parts}


def in_flight_s(segments: Sequence[Segment]) -> float:
    """Time in the air that was seen: without landings in between and gaps of the recording."""
    return sum(s.duration_s for s in segments if s.motion is not Motion.GROUND)


def _together(recording: Recording, motion: Motion, parts: Sequence[Segment]) -> MotionLoad:
    """Sums, averages weighted by duration, and the percentile of the samples themselves."""
    duration = np.array([s.duration_s for s in parts])

    def average(values: Sequence[float]) -> float:
        return float(np.average(values, weights=duration))

    load = LoadStatistics(
        charge_C=sum(s.load.charge_C for s in parts),
        energy_J=sum(s.load.energy_J for s in parts),
        mean_A=average([s.load.mean_A for s in parts]),
        rms_A=average([s.load.rms_A**2 for s in parts]) ** 0.5,
        p99_A=_percentile(recording, parts, 0.99),
        ripple_A=average([s.load.ripple_A**2 for s in parts]) ** 0.5,
    )
    return MotionLoad(motion=motion, segments=len(parts), time_s=float(duration.sum()), load=load)


def _percentile(recording: Recording, parts: Sequence[Segment], share: float) -> float:
    """Of the current over time, each sample as long as the median step: gaps weigh nothing."""
    t = recording.time_s
    inside = np.zeros(t.size, dtype=bool)
    for s in parts:
        inside |= (t >= s.start_s) & (t < s.stop_s)
    return float(np.quantile(recording.current_A[inside], share)) if inside.any() else float("nan")
