"""`MotionDetector`: from commanded velocity to the motion of every sample."""

from dataclasses import dataclass, field

import numpy as np

from segment.airborne import Airborne
from segment.command import Sticks
from segment.runs import (
    BoolArray,
    FloatArray,
    IntArray,
    absorb_short,
    drop_short,
    fill_short,
    hysteresis,
    moving_average,
    runs,
    span_s,
)
from segment.segment import Motion

HOVER, VERTICAL, HORIZONTAL, MIXED = range(4)  # bit 0: moves vertically, bit 1: horizontally
UNKNOWN, GROUND, TAKEOFF, LANDING = range(-4, 0)
MOTIONS = {
    HOVER: Motion.HOVER,
    VERTICAL: Motion.VERTICAL,
    HORIZONTAL: Motion.HORIZONTAL,
    MIXED: Motion.MIXED,
    UNKNOWN: Motion.MIXED,
    GROUND: Motion.GROUND,
    TAKEOFF: Motion.TAKEOFF,
    LANDING: Motion.LANDING,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionDetector:
    """Moving average, hysteresis and shortest durations; take-off and landing by the in-air flag.

    The speeds are those at which the power begins to differ from that of hover by more than its
    ripple. With v_h the induced velocity in hover (4 m/s to 8 m/s for small quadrotors), a climb at
    v adds v / (2 v_h) of the induced power: 0.4 m/s add 3 % to 5 %; it is also below the slowest
    usual landing speeds (ArduCopter LAND_SPEED 0.5 m/s, PX4 MPC_LAND_SPEED 0.7 m/s). Translation
    at v takes off (v / v_h)**2 / 4: 2 % at 1.2 m/s, and pilots who hover by hand in altitude hold
    drift at up to 1 m/s in the real logs. The window and the shortest durations follow from
    the speed loop of a multirotor, which settles within 1 s to 2 s: what is shorter is a
    correction or a turning point.

    Attributes:
        window_s: of the moving average.
        vertical_m_s: vertical speed that makes a vertical motion.
        vertical_release_m_s: it lasts while the speed exceeds this.
        horizontal_m_s: horizontal speed that makes a horizontal motion.
        horizontal_release_m_s: it lasts while the speed exceeds this.
        share: an axis slower than this share of the other does not count as moving (flight paths
            within 6 degrees of the level, or of the vertical).
        pause_s: a shorter rest does not end a motion (turning points).
        burst_s: a shorter movement is none (corrections).
        shortest_s: no hover, vertical, horizontal or mixed segment is shorter, unless it is hemmed
            in by take-off, landing, ground or a gap.
        settle_s: the climb of a take-off begins, the descent of a landing ends this close to the
            change of the in-air flag.
        takeoff_max_s: longest take-off; the climb beyond is a vertical motion.
        landing_max_s: longest landing, likewise.
        gap_s: no motion is followed across a longer step between samples.
        sticks: how sticks are read where no setpoint is logged.
        airborne: how the in-air flag is trimmed.
    """

    window_s: float = 1.0
    vertical_m_s: float = 0.4
    vertical_release_m_s: float = 0.2
    horizontal_m_s: float = 1.2
    horizontal_release_m_s: float = 0.6
    share: float = 0.1
    pause_s: float = 2.0
    burst_s: float = 1.0
    shortest_s: float = 2.0
    settle_s: float = 3.0
    takeoff_max_s: float = 15.0
    landing_max_s: float = 20.0
    gap_s: float = 1.0
    sticks: Sticks = field(default_factory=Sticks)
    airborne: Airborne = field(default_factory=Airborne)

    def label(self, time_s: FloatArray, velocity_m_s: FloatArray, in_air: BoolArray) -> IntArray:
        """(n,) motion codes (keys of MOTIONS) of samples without a gap.

        Args:
            time_s: (n,).
            velocity_m_s: (n, 3) commanded, or measured; NaN where neither is known.
            in_air: (n,).
        """
        smooth = moving_average(time_s, self._bridged(time_s, velocity_m_s), self.window_s)
        vertical, horizontal = self._moving(time_s, smooth)
        codes = vertical * VERTICAL + horizontal * HORIZONTAL
        codes[~np.isfinite(smooth).all(axis=1)] = UNKNOWN
        codes[~in_air] = GROUND
        for a, b in runs(in_air):
            if a > 0:
                stop = self._climb_end(time_s, -smooth[:, 2], vertical, a, b)
                codes[a : self._undisturbed(horizontal, a, stop)] = TAKEOFF
            if b < in_air.size:
                start = self._descent_start(time_s, smooth[:, 2], vertical, a, b)
                codes[self._settled(horizontal, start, b) : b] = LANDING
        fixed = (UNKNOWN, GROUND, TAKEOFF, LANDING)
        return absorb_short(time_s, codes, self.shortest_s, fixed)

    def _moving(self, time_s: FloatArray, smooth: FloatArray) -> tuple[BoolArray, BoolArray]:
        up, along = np.abs(smooth[:, 2]), np.hypot(smooth[:, 0], smooth[:, 1])
        least_up = self.share * np.nan_to_num(along)
        least_along = self.share * np.nan_to_num(up)
        vertical = hysteresis(
            up,
            np.maximum(least_up, self.vertical_release_m_s),
            np.maximum(least_up, self.vertical_m_s),
        )
        horizontal = hysteresis(
            along,
            np.maximum(least_along, self.horizontal_release_m_s),
            np.maximum(least_along, self.horizontal_m_s),
        )
        return self._lasting(time_s, vertical), self._lasting(time_s, horizontal)

    def _lasting(self, time_s: FloatArray, mask: BoolArray) -> BoolArray:
        return drop_short(time_s, fill_short(time_s, mask, self.pause_s), self.burst_s)

    def _climb_end(
        self, time_s: FloatArray, climb_m_s: FloatArray, vertical: BoolArray, a: int, b: int
    ) -> int:
        """Index at which the climb of a take-off at `a` ends; `a` if there is none."""
        rising = vertical[a:b] & (climb_m_s[a:b] > -self.vertical_release_m_s)
        for start, stop in runs(rising):
            if span_s(time_s, a, a + start) <= self.settle_s:
                limit = int(np.searchsorted(time_s, time_s[a] + self.takeoff_max_s))
                return min(a + stop, limit)
        return a

    def _undisturbed(self, horizontal: BoolArray, a: int, stop: int) -> int:
        """The first index in [a, stop) at which a horizontal motion begins, else `stop`."""
        begins = np.flatnonzero(horizontal[a:stop])
        return a + int(begins[0]) if begins.size else stop

    def _settled(self, horizontal: BoolArray, start: int, b: int) -> int:
        """The index after the last sample in [start, b) of a horizontal motion, else `start`."""
        moves = np.flatnonzero(horizontal[start:b])
        return start + int(moves[-1]) + 1 if moves.size else start

    def _bridged(self, time_s: FloatArray, velocity_m_s: FloatArray) -> FloatArray:
        """Unknown stretches too short to hold a motion, run through straight."""
        out = velocity_m_s.copy()
        for axis in out.T:
            known = np.isfinite(axis)
            fill = fill_short(time_s, known, self.shortest_s) & ~known
            if fill.any():
                axis[fill] = np.interp(time_s[fill], time_s[known], axis[known])
        return out

    def _descent_start(
        self, time_s: FloatArray, sink_m_s: FloatArray, vertical: BoolArray, a: int, b: int
    ) -> int:
        """Index at which the descent that ends in a landing at `b` begins; `b` if there is none."""
        sinking = vertical[a:b] & (sink_m_s[a:b] > -self.vertical_release_m_s)
        for start, stop in reversed(runs(sinking)):
            if span_s(time_s, a + stop, b) <= self.settle_s:
                limit = int(np.searchsorted(time_s, time_s[b] - self.landing_max_s))
                return max(a + start, limit)
        return b
