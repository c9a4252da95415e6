"""White noise of a recording, by third differences: what is smooth cancels in them."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from twin.mismatch.wander import Wander

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
BY_CHANCE, SURE = 1.5, 25.0
"""Of what chance makes of residuals that follow nothing: most of it, and what it hardly ever makes
of one number."""
DEAF = 0.6
"""Of what a twin answers, more than any effect takes from the pack's answer to a current: that did
not flow."""
STEP = 6.0  # deviations of third differences, beyond which a current was switched
BESIDE = 0.6  # of the squares of changes, what is not of rounding where a voltage is slow
LEAST_FOLLOWING = 200  # third differences by which noise of the current is told
SLOWLY = 4  # samples: what is taken together, and of that the changes, is slow
NOT_MORE = 4.0  # of what chance makes of one number: two deviations
TOLD = 3.2
"""Relative deviation of a variance by `white_V`, times the root of the number of samples: 2.9 to
3.3 of noise beside the currents of three simulated flights, 300 times each."""
APART = 0.01  # probability below which recordings whose noise is one differ as much


def white_V(
    residual_V: FloatArray, current_A: FloatArray, period_s: float, left: Wander | None = None
) -> float | None:
    """Standard deviation of white noise as dense as that of residuals (n,) [V]; None of too few.

    From third differences: what is smooth cancels; what jumps with the current, as far as it is in
    proportion to it and to its neighbours (up to REACH, so that a clock or a sensor that is late is
    no noise) or to its square and cube, is taken out first. Of samples and of means over 2, 4
    and 8 of them (up to LONGEST_S): noise that was smoothed or interpolated is little from sample
    to sample and shows in the means. The largest counts.

    Args:
        residual_V: (n,)
        current_A: (n,)
        period_s: from sample to sample.
        left: what wanders in it besides.
    """
    squares_V2 = []
    for size in [size for size in (1, 2, 4, 8) if size == 1 or size * period_s <= LONGEST_S]:
        spread_V = _spread_V(_means(residual_V, size), _means(current_A, size))
        if spread_V is not None:
            other_V2 = _third_V2(left, size * period_s) if left else 0.0
            squares_V2.append(size * (spread_V**2 - other_V2))
    return sqrt(max(*squares_V2, LEAST_V**2)) if squares_V2 else None


def agreed_V(white_V: Sequence[float], samples: Sequence[int]) -> list[float]:
    """White noise of recordings by one sensor [V]: that of all, each its own if they are APART.

    Of 500 samples it is told to 7 %, by chance less in what is held out than in what is fitted: a
    control of three flights, 12.5, 11.2 and 9.7 mV told of 10.8, had more than noise left in the
    last.

    Args:
        white_V: of each recording.
        samples: by which it is told.
    """
    variances, counts = np.square(white_V), np.array(samples, dtype=np.float64)
    logs = np.log(variances)
    off = logs - np.average(logs, weights=counts)
    if chi2.sf(float(counts @ off**2) / TOLD**2, counts.size - 1) < APART:
        return list(white_V)
    return [sqrt(float(np.average(variances, weights=counts)))] * counts.size


def _third_V2(left: Wander, period_s: float) -> float:
    """Variance of its third differences, over that of those of white noise of variance 1."""
    follows = left.follows(period_s * np.arange(OF_NOISE.size, dtype=np.float64))
    return float(left.size_V**2 * (2.0 * (follows @ OF_NOISE) / OF_NOISE[0] - 1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentNoise:
    """White noise of a recorded current.

    Attributes:
        size_A: standard deviation.
        ohm: by which the twin answers to it.
    """

    size_A: float
    ohm: float


def current_noise(
    residual_V: FloatArray, simulated_V: FloatArray, current_A: FloatArray, sure: float = SURE
) -> CurrentNoise | None:
    """Of a recorded current (n,), None where it is not `sure` that there is any.

    The twin answers to that noise by its resistance R, the pack does not. Third differences of
    residual and current then have the covariance R s^2 OF_NOISE, s that of the noise. None is taken
    for there unless that is sure, MOSTLY all by which the residual follows the current, beside what
    chance makes of so many numbers, and no more than either of both varies: an effect follows it
    otherwise. Nor if the twin's answer may as well be off by a share, as of another resistance: in
    gusts as white as noise only what is slow tells these apart.
    """
    if residual_V.size < LEAST_FOLLOWING:
        return None
    third, drive, answer = (np.diff(x, n=3) for x in (residual_V, current_A, simulated_V))
    reach = min(REACH, third.size // 40)
    lags = np.arange(-reach, reach + 1)
    usual = np.abs(drive) <= STEP * np.median(np.abs(drive)) / NORMAL
    good = np.all([np.roll(usual, k) for k in lags], axis=0)
    good[:reach] = good[third.size - reach :] = False
    if np.count_nonzero(good) < LEAST_FOLLOWING or not (drive[good].any() and answer[good].any()):
        return None
    lagged = np.column_stack([np.roll(drive, k)[good] for k in lags])
    third, drive, answer = third[good], drive[good], answer[good]
    shape = np.pad(np.concatenate([OF_NOISE[:0:-1], OF_NOISE]), reach + 1 - OF_NOISE.size)
    across = lagged.T @ third
    both = np.column_stack([shape, across])
    noise, whole = np.linalg.lstsq(lagged.T @ lagged, both, rcond=None)[0].T
    size_W = float(noise @ across) / float(noise @ shape)  # R s^2, summed over the samples
    followed_V2 = size_W**2 * float(noise @ shape)
    chance_V2 = float(third @ third) / third.size  # of each number
    else_V2 = float(whole @ across) - followed_V2 - BY_CHANCE * (lags.size - 1) * chance_V2
    alone = else_V2 < (1.0 - MOSTLY) * followed_V2 and followed_V2 > sure * chance_V2
    ohm = -float(noise @ (lagged.T @ answer)) / float(noise @ (lagged.T @ drive))
    whole_W = ohm * float(drive @ drive) / OF_NOISE[0]  # if all of the current is noise
    most_W = min(whole_W, float(third @ third) / max(ohm, 1e-12) / OF_NOISE[0])
    about = ABOUT + 2.0 * sqrt(chance_V2 / followed_V2) if followed_V2 > 0.0 else 0.0
    if not (alone and 0.0 < size_W < about * most_W):
        return None
    found = CurrentNoise(size_A=sqrt(min(size_W, most_W) / third.size / ohm), ohm=ohm)
    share = float(third @ answer) / float(answer @ answer)
    alike_V2 = share * float(third @ answer)  # if the answer is off by that
    told = size_W > DEAF * whole_W or followed_V2 - alike_V2 > sure * chance_V2
    slow_V, own_V = (np.diff(_means(values, SLOWLY)) for values in (residual_V, simulated_V))
    told |= _slow_as_noise(slow_V, own_V, found, share, sure)
    return found if told else None


def _slow_as_noise(
    slow_V: FloatArray, answer_V: FloatArray, noise: CurrentNoise, share: float, sure: float
) -> bool:
    """Slow changes (n,) follow those of a twin's answer as by noise of its current, not a share."""
    follows_V2, whole_V2 = float(slow_V @ answer_V), float(answer_V @ answer_V)
    of_noise_V2 = -2.0 * (noise.ohm * noise.size_A) ** 2 / SLOWLY * slow_V.size
    chance_V4 = whole_V2 * float(np.mean(slow_V**2))
    as_noise = (follows_V2 - of_noise_V2) ** 2 < NOT_MORE * chance_V4
    return as_noise and (follows_V2 - share * whole_V2) ** 2 > sure * chance_V4


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


def with_steps_V(white: float, step: float) -> float:
    """White noise of a voltage [V] that was recorded in steps, `white` being what its changes say.

    They say less where a voltage stays within a step for many samples: beside what rounding does,
    uniform over the step, most of them is noise then. Else rounding is in them.
    """
    rounding = step / sqrt(12.0)
    return hypot(sqrt(BESIDE) * white, rounding) if white < rounding else white
