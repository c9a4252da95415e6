"""Where a logger paused: what may have flowed there, by what flowed where it did not.

Between two samples far apart a straight line misses whole gusts. A stretch of the same recording as
long as the pause, less the straight line between its own ends, is a way in which the current may
have left that line.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.load import Between, Load

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

LONG = 10.0  # times the median interval: it is a pause
FEW = 0.02
"""Of all intervals, pauses at most: a cycler that logs when its current changes has long ones in
plenty, and there a straight line is right."""
LONGEST = 0.5  # of the longest run without a pause: a longer pause is a stretch so long, drawn out


@dataclass(frozen=True, slots=True, eq=False)
class Pause:
    """One of a recording.

    Attributes:
        after: index of the last sample before it.
        length_s: of it.
        first: (w,) samples where the stretches begin that may stand for it.
        last: (w,) and where they end.
    """

    after: int
    length_s: float
    first: IntArray
    last: IntArray

    def off_C(self, load: Load) -> FloatArray:
        """(w,) charge beyond the straight line, if it was as in each of the stretches [C]."""
        t, current_A, drawn_C = load.time_s, load.current_A, load.drawn_C()
        long_s = t[self.last] - t[self.first]
        line_A = (current_A[self.first] + current_A[self.last]) / 2
        return ((drawn_C[self.last] - drawn_C[self.first]) / long_s - line_A) * self.length_s

    def variance_C2(self, load: Load) -> float:
        """Of the charge beyond the straight line [C2]."""
        return float(np.mean(self.off_C(load) ** 2))

    def filled(self, load: Load, way: int) -> tuple[FloatArray, FloatArray]:
        """Times [s] and currents [A] within it, as in the stretch of that number."""
        first, last = int(self.first[way]), int(self.last[way])
        t, current_A = (v[first : last + 1] for v in (load.time_s, load.current_A))
        share = (t - t[0]) / (t[-1] - t[0])
        ends = [first, last], [self.after, self.after + 1]
        theirs, own = (np.interp(share, (0.0, 1.0), load.current_A[at]) for at in ends)
        time_s = load.time_s[self.after] + share * self.length_s
        return time_s[1:-1], (current_A - theirs + own)[1:-1]


def pauses(load: Load) -> tuple[Pause, ...]:
    """Of a recording, in turn; none where steps were programmed."""
    t, dt = load.time_s, np.diff(load.time_s)
    if load.between is Between.HOLD or t.size < 3:
        return ()
    after = np.flatnonzero(dt > LONG * np.median(dt))
    if not after.size or after.size > FEW * dt.size:
        return ()
    begins, ends = np.append(0, after + 1), np.append(after, t.size - 1)
    longest_s = LONGEST * float((t[ends] - t[begins]).max())
    end = ends[np.searchsorted(ends, np.arange(t.size))]  # of the run that each sample is in

    def pause(k: int) -> Pause:
        last = np.searchsorted(t, t + min(dt[k], longest_s))
        first = np.flatnonzero(last <= end)
        return Pause(k, float(dt[k]), first, last[first])

    return tuple(map(pause, after.tolist()))


def filled(
    load: Load, holes: Sequence[Pause], random: np.random.Generator
) -> tuple[Load, IntArray]:
    """With each pause as a stretch drawn by chance; and where the samples (n,) are in it."""
    parts = [p.filled(load, int(random.integers(p.first.size))) for p in holes]
    time_s = np.concatenate([load.time_s, *(t for t, _ in parts)])
    current_A = np.concatenate([load.current_A, *(a for _, a in parts)])
    order = np.argsort(time_s, kind="stable")
    at = np.argsort(order, kind="stable")[: load.time_s.size]
    return replace(load, time_s=time_s[order], current_A=current_A[order]), at
