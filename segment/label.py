"""Motions of samples."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from segment.segment import Motion, Segment


def motions_at(
    time_s: npt.NDArray[np.float64], segments: Sequence[Segment]
) -> npt.NDArray[np.str_]:
    """(n,) value of the motion at each time; "" where no segment is."""
    longest = max(len(m.value) for m in Motion)
    out = np.full(time_s.shape, "", dtype=f"U{longest}")
    for s in segments:
        first, last = np.searchsorted(time_s, [s.start_s, s.stop_s])
        out[first:last] = s.motion.value
    return out
