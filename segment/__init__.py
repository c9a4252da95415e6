"""Recording -> segments of one motion each -> a periodic current profile for each motion."""

from segment.cut import cut
from segment.detector import MotionDetector
from segment.profile import Fidelity, PeriodicProfile
from segment.segment import Basis, LoadStatistics, Motion, Segment

__all__ = [
    "Basis",
    "Fidelity",
    "LoadStatistics",
    "Motion",
    "MotionDetector",
    "PeriodicProfile",
    "Segment",
    "cut",
]
