"""A waveform without one of its features: which of them drives which damage is seen by leaving it.

A waveform is its mean, the slow course of the manoeuvre (a moving mean over SLOW_S) and the ripple
of the control loop on top. Each function gives a waveform of the same mean and the same period.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from twin.damage.waveform import Waveform

FloatArray = npt.NDArray[np.float64]

SLOW_S = 2.0  # slower than control activity, faster than a manoeuvre


def course(waveform: Waveform) -> FloatArray:
    """(n,) moving mean over SLOW_S, around the seam."""
    n = waveform.current_A.size
    half = min(int(SLOW_S / waveform.sample_s / 2), (n - 1) // 2)
    around = np.concatenate(
        [waveform.current_A[n - half :], waveform.current_A, waveform.current_A[:half]]
    )
    return np.asarray(np.convolve(around, np.full(2 * half + 1, 1 / (2 * half + 1)), mode="valid"))


def without_peaks(waveform: Waveform) -> Waveform:
    """The mean and the ripple; the course of the manoeuvre is gone."""
    slow = course(waveform)
    return replace(waveform, current_A=waveform.mean_A + waveform.current_A - slow)


def without_ripple(waveform: Waveform) -> Waveform:
    """The course alone: the same peaks, smooth."""
    return replace(waveform, current_A=course(waveform))


def slow_ramps(waveform: Waveform) -> Waveform:
    """The same ripple on one rise and one fall a period, of the very values of the course.

    Mean, peaks and how long each current lasts are kept; only the ramps between them are slower.
    """
    slow = course(waveform)
    ordered = np.sort(slow)
    arranged = np.concatenate([ordered[::2], ordered[1::2][::-1]])
    return replace(waveform, current_A=arranged + waveform.current_A - slow)


def even_duty(waveform: Waveform) -> Waveform:
    """The course lies as long, and as far, above the mean as below it; its mean square is kept.

    Short high peaks become long lower ones. The ripple is kept, and when the course was above its
    median it now is above its mean.
    """
    slow = course(waveform)
    away = float(np.sqrt(np.mean((slow - waveform.mean_A) ** 2)))
    high = slow > np.median(slow)
    level = np.where(high, 1.0, -1.0)
    level -= level.mean()
    size = float(np.sqrt(np.mean(level**2)))
    level = away / size * level if size > 0 else level
    return replace(waveform, current_A=waveform.mean_A + level + waveform.current_A - slow)


FEATURES: Mapping[str, Callable[[Waveform], Waveform]] = {
    "peaks": without_peaks,
    "ripple": without_ripple,
    "ramps": slow_ramps,
    "duty": even_duty,
}
"""Feature -> the waveform without it."""
