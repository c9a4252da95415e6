"""White noise of a recording, by third differences: what is smooth cancels in them."""

from math import hypot, sqrt

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

THIRD = np.sqrt(20.0)  # of third differences over white noise: 1 + 9 + 9 + 1
NORMAL = 0.6745  # median of |x| of a normal distribution
LEAST_V = 1e-4  # of a recording too short to tell as well
LEAST_THIRD = 12  # third differences, of which a spread can be told
REACH = 10  # samples before and after, at whose current a residual may follow it
LONGEST_S = 1.0  # of samples that are taken together: slower is physics
OF_NOISE = np.array([20.0, -15.0, 6.0, -1.0])
"""Autocovariance of the third differences of white noise of variance 1, at lags 0, 1, 2 and 3."""
MOSTLY, ABOUT = 0.95, 1.1  # what is taken for all of it, and for no more
STEP = 6.0  # deviations of third differences, beyond which a current was switched
LEAST_FOLLOWING = 200  # third differences by which noise of the current is told


def white_V(
    residual_V: FloatArray, current_A: FloatArray, period_s: float, current_V: float = 0.0
) -> float | None:
    """Standard deviation of white noise as dense as that of residuals (n,) [V]; None of too few.

    From third differences: what is smooth cancels; what jumps with the current, as far as it is in
    proportion to it and to its neighbours (up to REACH, so that a clock or a sensor that is late is
    no noise) or to its square and cube, is taken out first. Of samples and of means over 2, 4
    and 8 of them (up to LONGEST_S): noise that was smoothed or interpolated is little from sample
    to sample and shows in the means. The largest counts, that of samples with `current_V`, what the
    noise of the current makes of it (`of_current_V`).
    """
    sizes = [size for size in (1, 2, 4, 8) if size == 1 or size * period_s <= LONGEST_S]
    spreads = [(k, _spread_V(_means(residual_V, k), _means(current_A, k))) for k in sizes]
    own_V = [sqrt(k) * spread for k, spread in spreads if spread is not None]
    return max(hypot(own_V[0], current_V), *own_V) if own_V else None


def of_current_V(residual_V: FloatArray, simulated_V: FloatArray, current_A: FloatArray) -> float:
    """Standard deviation of what the noise of a recorded current makes of residuals (n,) [V].

    The twin answers to that noise by its resistance R, the pack does not. Third differences of
    residual and current then have the covariance R s^2 OF_NOISE, s that of the noise in amperes.
    None is taken for there unless that is MOSTLY all by which the residual follows the current, and
    no more than either of both varies: an effect follows it otherwise.
    """
    if residual_V.size < LEAST_FOLLOWING:
        return 0.0
    third, drive, answer = (np.diff(x, n=3) for x in (residual_V, current_A, simulated_V))
    reach = min(REACH, third.size // 40)
    lags = np.arange(-reach, reach + 1)
    usual = np.abs(drive) <= STEP * np.median(np.abs(drive)) / NORMAL
    good = np.all([np.roll(usual, k) for k in lags], axis=0)
    good[:reach] = good[third.size - reach :] = False
    if np.count_nonzero(good) < LEAST_FOLLOWING or not drive[good].any():
        return 0.0
    lagged = np.column_stack([np.roll(drive, k)[good] for k in lags])
    third, drive, answer = third[good], drive[good], answer[good]
    shape = np.pad(np.concatenate([OF_NOISE[:0:-1], OF_NOISE]), reach + 1 - OF_NOISE.size)
    across = lagged.T @ third
    both = np.column_stack([shape, across])
    noise, whole = np.linalg.lstsq(lagged.T @ lagged, both, rcond=None)[0].T
    size_W = float(noise @ across) / float(noise @ shape)  # R s^2, summed over the samples
    followed_V2 = size_W**2 * float(noise @ shape)
    ohm = -float(drive @ answer) / float(drive @ drive)
    most_W = min(ohm * float(drive @ drive), float(third @ third) / max(ohm, 1e-12))
    alone = followed_V2 > MOSTLY * float(whole @ across)
    if not (alone and 0.0 < OF_NOISE[0] * size_W < ABOUT * most_W):
        return 0.0
    return sqrt(followed_V2 / third.size / OF_NOISE[0])


def _means(values: FloatArray, size: int) -> FloatArray:
    """(n // size,) of so many samples each."""
    whole = values.size // size * size
    return np.asarray(values[:whole].reshape(-1, size).mean(axis=1), dtype=float)


def _spread_V(residual_V: FloatArray, current_A: FloatArray) -> float | None:
    """Standard deviation of one value about what is smooth and what follows the current [V]."""
    third, drive = np.diff(residual_V, n=3), np.diff(current_A, n=3)
    reach = min(REACH, third.size // 40)
    if third.size < LEAST_THIRD:
        return None
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
    known_V = voltage_V[np.isfinite(voltage_V)]
    levels = np.unique(known_V)
    if levels.size < 2 or levels.size > known_V.size / 3:
        return 0.0
    return float(np.median(np.diff(levels)))
