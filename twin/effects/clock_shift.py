"""Current and voltage were not recorded on the same clock."""

from dataclasses import dataclass
from math import hypot
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy import sparse

from twin.effects.effect import Parameter
from twin.effects.likely import SENSOR, likeliest

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

WINDOW = 8  # samples either way
SWITCH, NORMAL = 6.0, 0.6745  # deviations, of which a normal distribution's median is so many


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockShift:
    """The current's clock is late by so much: I(t) = I_rec(t + shift).

    Attributes:
        shift_s: positive: late.
        noise_A: white noise of the sensor, standard deviation (`likely`).
    """

    shift_s: float = 0.0
    noise_A: float = SENSOR.value

    id: ClassVar[str] = "clock_shift"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="shift_s", unit="s", value=0.0, lower=-3.0, upper=3.0, prior_std=0.3),
        SENSOR,
    )
    balance: ClassVar[str] = "current"
    equation: ClassVar[str] = r"I(t) = I_\mathrm{rec}(t + \Delta)"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = "all answers of the voltage to gusts early or late by the same time"

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:
        """(n,) the current in the pack; beyond its ends that of the end.

        Straight between its own samples, whose corners lie between those of the recording: the
        likeliest such current (`likely`), and what that leaves of the recording (`_as_rough`): as
        much noise, whatever the shift, and no leap as it grows. Straight between those of the
        recording it would be too smooth. Gusts for which a logger is too slow are straight between
        no samples, and count as noise by how far samples are off straight lines. Not shifted at
        all, it is what was recorded.
        """
        if abs(self.shift_s) >= np.ptp(time_s) or not np.ptp(recorded_A):
            return np.interp(time_s + self.shift_s, time_s, recorded_A)
        one = sparse.csc_array(sparse.eye_array(time_s.size))
        at_s = time_s - self.shift_s
        known = _within(at_s, time_s)
        late = straight_matrix(time_s, at_s)
        seen = sparse.diags_array(known) @ late
        unlike_A = hypot(self.noise_A, _off_straight_A(recorded_A))
        likely_A = likeliest(seen, one, known * recorded_A, recorded_A, time_s, unlike_A)
        left_A = recorded_A - late @ likely_A
        return np.asarray(likely_A + _as_rough(left_A, *_between(time_s, time_s + self.shift_s)))


def _off_straight_A(recorded_A: FloatArray) -> float:
    """Rms of how far samples (n,) are from the straight line between those beside them.

    Without switches of the current, which are no gusts.
    """
    off_A = np.abs(np.diff(recorded_A, n=2)) / 2.0
    gusts_A = off_A[off_A <= SWITCH / NORMAL * np.median(off_A)] if off_A.size else off_A
    return float(np.sqrt(np.mean(gusts_A**2))) if gusts_A.size else 0.0


def _within(at_s: FloatArray, time_s: FloatArray) -> FloatArray:
    """(m,) 1 for times of a recording, 0 for those more than a sample before or after it."""
    before_s, after_s = 2 * time_s[0] - time_s[1], 2 * time_s[-1] - time_s[-2]
    ends = np.array([before_s, time_s[0], time_s[-1], after_s])
    return np.asarray(np.interp(at_s, ends, np.array([0.0, 1.0, 1.0, 0.0])))


def straight_matrix(time_s: FloatArray, at_s: FloatArray) -> sparse.csc_array:
    """(m, n) values at times (n,), two or more -> at (m,) on the straight lines between.

    Beyond the ends those of the ends.
    """
    n, m = time_s.size, at_s.size
    left, share = _between(time_s, at_s)
    weights = np.concatenate([1.0 - share, share])
    at = np.tile(np.arange(m), 2), np.concatenate([left, left + 1])
    return sparse.csc_array((weights, at), shape=(m, n))


def _between(time_s: FloatArray, at_s: FloatArray) -> tuple[IntArray, FloatArray]:
    """(m,) of the times before (n,) the last, and how much of the way to the next."""
    left = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, time_s.size - 2)
    share = np.clip((at_s - time_s[left]) / (time_s[left + 1] - time_s[left]), 0.0, 1.0)
    return left, share


def _as_rough(noise: FloatArray, left: IntArray, share: FloatArray) -> FloatArray:
    """(m,) noise (n,) between its samples, of the same mean and nearly the variance everywhere.

    By a sinc in Lanczos' window, which midway takes 9 % of the variance of white noise, where a
    straight line takes half.

    Source: C. E. Duchon, Lanczos filtering in one and two dimensions, J. Appl. Meteorol. 18, 1016
    (1979).
    """
    places = np.arange(1 - WINDOW, WINDOW + 1)
    away = share[:, None] - places
    weights = np.sinc(away) * np.sinc(away / WINDOW)
    around = np.pad(noise, WINDOW, mode="edge")[left[:, None] + WINDOW + places]
    return np.asarray((weights * around).sum(axis=1) / weights.sum(axis=1))
