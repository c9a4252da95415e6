"""Residuals as they are drawn: means over a second, motions behind them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from reports.plots import DRAWN_GAP_S, broken_at_gaps
from segment.segment import Motion
from twin.mismatch import Course

FloatArray = npt.NDArray[np.float64]

MEAN_S = 1.0
LONGER = 5.0  # times the usual step: a pause
MOST_DRAWN = 6  # recordings; of more those with the largest residual
COLUMNS = 600
CAUSE_COLOURS = ("#d55e00", "#0072b2", "#882255")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """A time with one motion."""

    motion: Motion
    start_s: float
    stop_s: float


def chosen(courses: Sequence[Course]) -> list[Course]:
    """Those drawn, in their order."""
    worst = sorted(courses, key=lambda c: -rms_V(c.residual_V, c.judged))[:MOST_DRAWN]
    return [c for c in courses if any(c is w for w in worst)]


def rms_V(values_V: FloatArray, where: npt.NDArray[np.bool_]) -> float:
    """Of the finite ones; NaN if there are none."""
    own = values_V[where & np.isfinite(values_V)]
    return float(np.sqrt(np.mean(own**2))) if own.size else float("nan")


def stretches(course: Course) -> tuple[Stretch, ...]:
    """Runs of one known motion; each stops where the next begins."""
    known = {m.value for m in Motion}
    t, motion = course.time_s, course.motion
    starts = np.concatenate([[0], np.flatnonzero(motion[1:] != motion[:-1]) + 1, [t.size - 1]])
    return tuple(
        Stretch(motion=Motion(str(motion[a])), start_s=float(t[a]), stop_s=float(t[b]))
        for a, b in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)
        if str(motion[a]) in known and b > a
    )


def mean_mV(course: Course, values_V: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A line: (m,) times, and the mean over MEAN_S around each sample that counts; NaN at others.

    It is broken where nothing was recorded for much longer than usual.
    """
    t = course.time_s
    good = course.judged & np.isfinite(values_V)
    total = np.concatenate([[0.0], np.cumsum(np.where(good, values_V, 0.0))])
    count = np.concatenate([[0], np.cumsum(good)])
    first = np.searchsorted(t, t - MEAN_S / 2)
    last = np.searchsorted(t, t + MEAN_S / 2, side="right")
    n = count[last] - count[first]
    mean = np.where(good, 1e3 * (total[last] - total[first]) / np.maximum(n, 1), np.nan)
    return broken_at_gaps(t, mean, max(DRAWN_GAP_S, LONGER * float(np.median(np.diff(t)))))
