"""Recording -> segments of one motion each -> a periodic current profile for each motion."""

from segment.cut import cut
from segment.detector import MotionDetector
from segment.label import motions_at
from segment.periodic import ProfileMaker, periodic_profiles
from segment.profile import Fidelity, PeriodicProfile, TooLittle
from segment.segment import Basis, LoadStatistics, Motion, Segment

__all__ = [
    "Basis",
    "Fidelity",
    "LoadStatistics",
    "Motion",
    "MotionDetector",
    "PeriodicProfile",
    "ProfileMaker",
    "Segment",
    "TooLittle",
    "cut",
    "motions_at",
    "periodic_profiles",
]
