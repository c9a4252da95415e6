"""The noise of a recording, and residuals freed of all that noise and the twin's own error explain.

What differs by chance: white noise of the voltage (with its steps, and the current's noise through
the resistance), estimated from the recording. What differs without meaning: the twin is never
exact; its own error wanders slowly. Both together are an ARMA(1, 1) process; its inverse filter
turns residuals into numbers that are independent and have variance 1 if nothing else is in them.

Source of the filter: the Kalman filter of an Ornstein-Uhlenbeck process seen in white noise, which
knows nothing before the first sample but how far that process wanders, and in a gap forgets as that
does (Anderson, Moore, Optimal Filtering, 1979, chapter 4).
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_banded

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

THIRD = np.sqrt(20.0)  # of third differences over white noise: 1 + 9 + 9 + 1
NORMAL = 0.6745  # median of |x| of a normal distribution
LEAST_V = 1e-4
REACH = 10  # samples before and after, at whose current a residual may follow it
LONGEST_S = 1.0  # of samples that are taken together: slower is physics


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Of the residuals of one recording.

    Attributes:
        white_V: standard deviation from sample to sample.
        slow_V: of the twin's own error.
        slow_s: time over which that forgets.
    """

    white_V: float
    slow_V: float
    slow_s: float


def white_V(residual_V: FloatArray, current_A: FloatArray, period_s: float) -> float:
    """Standard deviation of white noise as dense as that of residuals (n,) [V].

    From third differences: what is smooth cancels; what jumps with the current, as far as it is in
    proportion to it and to its neighbours (up to REACH, so that a clock or a sensor that is late is
    no noise) or to its square and cube, is taken out first. Of samples and of means over 2, 4
    and 8 of them (up to LONGEST_S): noise that was smoothed or interpolated is little from sample
    to sample and shows in the means. The largest counts.
    """
    sizes = [size for size in (1, 2, 4, 8) if size == 1 or size * period_s <= LONGEST_S]
    spreads = [
        sqrt(size) * _spread_V(_means(residual_V, size), _means(current_A, size)) for size in sizes
    ]
    return max(spreads)


def _means(values: FloatArray, size: int) -> FloatArray:
    """(n // size,) of so many samples each."""
    whole = values.size // size * size
    return np.asarray(values[:whole].reshape(-1, size).mean(axis=1), dtype=float)


def _spread_V(residual_V: FloatArray, current_A: FloatArray) -> float:
    """Standard deviation of one value about what is smooth and what follows the current [V]."""
    third, drive = np.diff(residual_V, n=3), np.diff(current_A, n=3)
    reach = min(REACH, third.size // 40)
    if third.size < 12:
        return LEAST_V
    places = range(-max(reach, 1), max(reach, 1) + 1)
    good = slice(places.stop - 1, third.size - places.stop + 1)
    bent = [np.diff(current_A**power, n=3)[good] for power in (2, 3)]
    lagged = np.column_stack([*(np.roll(drive, k)[good] for k in places), *bent])
    slopes = np.linalg.lstsq(lagged, third[good], rcond=None)[0]
    left = third[good] - lagged @ slopes
    freedom = left.size / (left.size - lagged.shape[1])
    return float(max(np.median(np.abs(left)) / NORMAL / THIRD * sqrt(freedom), LEAST_V))


def step_V(voltage_V: FloatArray) -> float:
    """The step in which a voltage was recorded, 0 if it has none that can be seen [V]."""
    levels = np.unique(voltage_V[np.isfinite(voltage_V)])
    if levels.size < 2 or levels.size > voltage_V.size / 3:
        return 0.0
    return float(np.median(np.diff(levels)))


@dataclass(frozen=True, slots=True, eq=False)
class Whitener:
    """Filters columns over the judged samples of one recording.

    Attributes:
        samples: (m,) which samples of the recording these are.
        noise: what is expected.
        keep: (m - 1,) share of the slow part that the next of them still has.
        predicted_V2: (m,) variance of the slow part before each is seen.
    """

    samples: npt.NDArray[np.int64]
    noise: Noise
    keep: FloatArray
    predicted_V2: FloatArray

    def __call__(self, columns: FloatArray) -> FloatArray:
        """(m, k) whitened, of (n, k): the judged samples, in order.

        Innovations e over their deviation,
        e[n] - keep (1 - gain[n - 1]) e[n - 1] = x[n] - keep x[n - 1], e[0] = x[0].
        """
        x = columns[self.samples]
        if not x.size:
            return x
        whole = self.predicted_V2 + self.noise.white_V**2
        made = x.copy()
        made[1:] -= self.keep[:, None] * x[:-1]
        bands = np.ones((2, x.shape[0]))
        bands[1, :-1] = -self.keep * (1.0 - self.predicted_V2 / whole)[:-1]
        return np.asarray(solve_banded((1, 0), bands, made) / np.sqrt(whole)[:, None])


def whitener(time_s: FloatArray, judged: BoolArray, noise: Noise) -> Whitener:
    """For one recording."""
    samples = np.flatnonzero(judged)
    keep = np.exp(-np.diff(time_s[samples]) / noise.slow_s)
    return Whitener(samples, noise, keep, _predicted_V2(keep, samples.size, noise))


def _predicted_V2(keep: FloatArray, count: int, noise: Noise) -> FloatArray:
    """(count,) Riccati's recursion, from the variance before anything is known."""
    white, slow = noise.white_V**2, noise.slow_V**2
    out = np.full(count, slow)
    now = slow
    for k, kept in enumerate((keep**2).tolist(), start=1):
        now = kept * now * white / (now + white) + slow * (1 - kept)
        out[k] = now
    return out


def correlation_time(whitened: FloatArray) -> float:
    """How many samples tell as much as one: 1 + 2 sum of autocorrelations, at least 1.

    The mean is not taken out: what is off all along says the same in every sample. The sum ends at
    five times itself (Sokal, Monte Carlo methods in statistical mechanics, 1996, section 3).
    """
    n = whitened.size
    if n == 0:
        return 1.0
    spectrum = np.fft.rfft(whitened, 2 * n)
    covariances = np.fft.irfft(np.abs(spectrum) ** 2)[:n]
    if covariances[0] <= 0:
        return 1.0
    sums = 2 * np.cumsum(covariances / covariances[0]) - 1
    enough = np.arange(n) >= 5 * sums
    return float(max(1.0, sums[int(np.argmax(enough)) if enough.any() else -1]))
