"""Where a measured current changes: stretches of constant current, in spite of its noise.

A stretch ends where a sample, or the mean of the last 4, 16, 64, ... of them, differs from the mean
of the stretch before by more than its noise explains, and by more than 1 % of the largest current.
A step of a programme is more than noise in its first sample: there the cut is exact.
"""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

SAME_CURRENT = 0.01  # of the largest: less is no change
NOISE_TIMES = 6.0  # standard deviations: in 1e5 samples, somewhat correlated, none by chance
QUARTER = 1.6268  # a quarter of the differences of white noise of standard deviation 1 exceed that
LONGER = 4  # each window over the one before


def phases(current_A: FloatArray, voltage_V: FloatArray, *, felt_V: float) -> IntArray:
    """First sample of each stretch of constant current; a last one of its own is none.

    Changes that move the voltage (n,) by more than `felt_V` from sample to sample are no noise.
    """
    same_A = SAME_CURRENT * float(np.abs(current_A).max())
    noise_A = current_noise_A(current_A, voltage_V, felt_V=felt_V)
    windows = [1]
    while NOISE_TIMES * noise_A > same_A * np.sqrt(windows[-1]):
        windows.append(LONGER * windows[-1])
    drawn = np.concatenate([[0.0], np.cumsum(current_A)])
    sums, starts = drawn.tolist(), [0]
    for k in range(2, current_A.size):  # the samples before k
        first = starts[-1]
        for w in windows:
            if (n := k - w - first) < 1:
                break
            level_A, now_A = (sums[k - w] - sums[first]) / n, (sums[k] - sums[k - w]) / w
            noise = NOISE_TIMES * noise_A * (1 / w + 1 / n) ** 0.5
            if abs(now_A - level_A) > max(same_A, noise):
                starts.append(k - 1 if w == 1 else _change(drawn, max(first, k - 2 * w), k))
                break
    return np.array(starts)


def steady_A(current_A: FloatArray, voltage_V: FloatArray, *, felt_V: float) -> float:
    """What a steady current may differ by from one sample to the next."""
    noise_A = current_noise_A(current_A, voltage_V, felt_V=felt_V)
    same_A = SAME_CURRENT * float(np.abs(current_A).max())
    return max(same_A, NOISE_TIMES * 2**0.5 * noise_A)


def current_noise_A(current_A: FloatArray, voltage_V: FloatArray, *, felt_V: float) -> float:
    """Standard deviation of what the current fluctuates by from sample to sample.

    0 where that is felt in the voltage: a current that changes all the time, as in a drive cycle,
    is no constant one with noise.
    """
    change_A, change_V = np.diff(current_A), np.diff(voltage_V)
    noise_A = float(np.quantile(np.abs(change_A), 0.75)) / QUARTER
    small = (np.abs(change_A) <= NOISE_TIMES * noise_A) & np.isfinite(change_V)
    square = float(change_A[small] @ change_A[small])
    if not square > 0:
        return 0.0
    resistance_ohm = abs(float(change_A[small] @ change_V[small])) / square
    return noise_A if resistance_ohm * noise_A < felt_V else 0.0


def _change(drawn: FloatArray, first: int, stop: int) -> int:
    """Where the mean of the samples [first, stop) changes most, by what noise would leave of it."""
    at = np.arange(first + 1, stop)
    before, after = at - first, stop - at
    apart = (drawn[at] - drawn[first]) / before - (drawn[stop] - drawn[at]) / after
    return int(at[np.argmax(np.abs(apart) * np.sqrt(before * after))])
