"""Where a logger paused: what may have flowed there, by what flowed where it did not.

Between two samples far apart a straight line misses whole gusts. A stretch of the same recording as
long as the pause, less the straight line between its own ends, is one way in which the current may
have left that line.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.load import Load

FloatArray = npt.NDArray[np.float64]

PAUSE = 10.0  # times the median interval, and more
FEW = 0.02
"""Of all intervals, pauses at most: a cycler that logs when its current changes has long ones in
plenty, and between those a straight line is right."""


@dataclass(frozen=True, slots=True, eq=False)
class Pauses:
    """Of a recording.

    Attributes:
        load: as it was recorded.
        before: (g,) sample after which each begins.
        taken: (g, 2) for each, first sample and length [s] of the stretches that can stand for it.
    """

    load: Load
    before: npt.NDArray[np.int64]
    stretches: tuple[npt.NDArray[np.int64], ...]
    length_s: FloatArray

    def variance_C2(self) -> FloatArray:
        """(g,) of the charge that flowed in each beside the straight line [C2]."""
        drawn_C = self.load.drawn_C()
        out = []
        for first, length_s in zip(self.stretches, self.length_s, strict=True):
            t, current_A = self.load.time_s, self.load.current_A
            last = np.searchsorted(t, t[first] + length_s)
            line_C = (current_A[first] + current_A[last]) / 2 * (t[last] - t[first])
            off_C = drawn_C[last] - drawn_C[first] - line_C
            out.append(float(np.mean(off_C**2)))
        return np.array(out)
