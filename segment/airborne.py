"""When the vehicle really is off the ground, where the in-air flag is early or late."""

from dataclasses import dataclass

import numpy as np

from flightlogs.recording import Recording
from segment.runs import BoolArray, FloatArray, fill_short, moving_average, runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Airborne:
    """Trims the in-air flag by height and current.

    The flag often rises when the motors start (real logs: up to 14 s before the climb) and falls a
    second or more after touch-down. While the height stays as it is at that end of the flag and
    the current is well below that of flight, the vehicle stands on the ground.

    Attributes:
        glitch_s: shorter interruptions of the flag are none.
        rest_m: height changes less than this while standing.
        share: of the flight's median current that a standing vehicle stays below.
        too_little: below this share nothing flies, whatever the height (an estimator that drifts);
            a hover may draw 0.4 of what most of a fast flight does.
        window_s: of the current's moving average: motors that spin up draw short peaks.
    """

    glitch_s: float = 1.0
    rest_m: float = 0.15
    share: float = 0.8
    too_little: float = 0.25
    window_s: float = 2.0

    def find(self, recording: Recording) -> BoolArray:
        """(n,) off the ground; the flag itself where height or current are not known."""
        out = fill_short(recording.time_s, recording.in_air, self.glitch_s)
        if recording.velocity_m_s is None or not out.any():
            return out
        height_m = _height(recording.time_s, recording.velocity_m_s[:, 2])
        smooth_A = moving_average(recording.time_s, recording.current_A, self.window_s)
        share = smooth_A / max(float(np.median(recording.current_A[out])), 1e-9)
        for a, b in runs(out):
            if a > 0:
                out[a : a + _leading(self._standing(share[a:b], height_m[a:b], 0))] = False
            if b < out.size:
                standing = self._standing(share[a:b], height_m[a:b], -1)
                out[b - _leading(standing[::-1]) : b] = False
        return out

    def _standing(self, share: FloatArray, height_m: FloatArray, end: int) -> BoolArray:
        still = np.abs(height_m - height_m[end]) < self.rest_m
        return np.asarray((share < self.too_little) | (still & (share < self.share)))


def _leading(mask: BoolArray) -> int:
    """How many of the first samples of `mask` (n,) are true without a break."""
    return int(mask.size if mask.all() else np.argmin(mask))


def _height(time_s: FloatArray, down_m_s: FloatArray) -> FloatArray:
    """(n,) minus the integral of the velocity down; NaN where that is not known."""
    step = np.diff(time_s) * (down_m_s[1:] + down_m_s[:-1]) / 2
    height = -np.concatenate([[0.0], np.cumsum(np.nan_to_num(step))])
    return np.asarray(np.where(np.isfinite(down_m_s), height, np.nan))
