"""A signal between its samples: the best linear estimate from its neighbours, and its variance.

A multirotor's current has content beyond the 5 Hz that a 10 Hz sensor resolves. Samples of two
instruments at all fractions of a sampling step together show it: the mean square difference as a
function of the fine lag. Kriging with that function predicts one instrument's samples from the
other's, ripple included, and knows how much less it knows between samples than at them.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from flightlogs.log import FloatArray

RELAXATIONS_S = np.array([0.1, 0.2, 0.5, 1.0, 2.0, 5.0])
"""Correlation times offered to the fit of the slow part: gusts and manoeuvres."""
FREQUENCIES_HZ = np.arange(1.0, 12.5, 0.5)
"""Centres of the bands offered for oscillations (frame modes, controllers, motors)."""
BAND_MEMORY_S = 0.2
"""An oscillation forgets its phase over this time."""
NEIGHBOURS = 12
"""More hardly change the estimate: the near samples screen the far ones."""
TABLE_STEP_S, TABLE_END_S = 0.001, 6.0
MIN_PAIRS = 10
"""Fewer pairs in a bin of lags say nothing."""


def structure(lag_s: FloatArray) -> FloatArray:
    """(k, n) 1 - correlation at lag_s (n,) of every component offered to the fit."""
    z = np.sqrt(3.0) * np.abs(lag_s) / RELAXATIONS_S[:, None]
    slow = 1.0 - (1.0 + z) * np.exp(-z)  # Matern 3/2
    fade = np.exp(-np.abs(lag_s) / BAND_MEMORY_S)
    waves = 1.0 - fade * np.cos(2 * np.pi * FREQUENCIES_HZ[:, None] * lag_s)
    return np.vstack([slow, waves])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variogram:
    """Half the mean square difference of a signal over a lag, and the noise of two instruments.

    Attributes:
        table: variogram without noise at lags 0, TABLE_STEP_S, ... TABLE_END_S; squared unit.
        noise: variance of the white noise of the sampled instrument.
        reference_noise: the same of the instrument compared with it, in units of the first.
    """

    table: FloatArray
    noise: float
    reference_noise: float


def own_pairs(time_s: FloatArray, x: FloatArray, reach: int) -> tuple[FloatArray, FloatArray]:
    """(k,) mean lag and (k,) half mean square difference of samples 1..reach places apart.

    Pairs across a gap (lag more than 1.5 times the median for that distance) do not count.
    """
    lags, halves = [], []
    for k in range(1, reach + 1):
        dt, dx = time_s[k:] - time_s[:-k], x[k:] - x[:-k]
        near = dt < 1.5 * np.median(dt)
        lags.append(float(np.mean(dt[near])))
        halves.append(0.5 * float(np.mean(dx[near] ** 2)))
    return np.array(lags), np.array(halves)


def cross_pairs(
    lag_s: FloatArray, difference: FloatArray, edges_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean lag and half mean square difference (k,) in those bins of |lag| that hold enough."""
    which = np.digitize(np.abs(lag_s), edges_s) - 1
    keep = (which >= 0) & (which < len(edges_s) - 1)
    n = np.bincount(which[keep], minlength=len(edges_s) - 1).astype(float)
    used = n >= MIN_PAIRS
    lag = np.bincount(which[keep], np.abs(lag_s[keep]), len(edges_s) - 1)[used] / n[used]
    half = 0.5 * np.bincount(which[keep], difference[keep] ** 2, len(edges_s) - 1)[used] / n[used]
    return lag, half


def fit_variogram(
    own: tuple[FloatArray, FloatArray], cross: tuple[FloatArray, FloatArray]
) -> Variogram:
    """Non-negative mixture through the sensor's own differences and those to the reference.

    Own differences hold the sensor's noise twice, differences between instruments the noise of
    each once: together with the short lags between instruments they tell noise from fast current.
    """
    lag, half = np.concatenate([own[0], cross[0]]), np.concatenate([own[1], cross[1]])
    is_own = np.arange(len(lag)) < len(own[0])
    noise = np.where(is_own, 1.0, 0.5), np.where(is_own, 0.0, 0.5)
    columns = np.vstack([structure(lag), *noise]).T
    weight = 1.0 / np.maximum(half, 1e-12)  # relative errors are what is alike
    solution, _ = nnls(columns * weight[:, None], half * weight)
    lags = np.arange(0.0, TABLE_END_S, TABLE_STEP_S)
    return Variogram(
        table=np.asarray(solution[:-2] @ structure(lags)),
        noise=float(solution[-2]),
        reference_noise=float(solution[-1]),
    )


def krige(
    at_s: FloatArray, time_s: FloatArray, x: FloatArray, variogram: Variogram
) -> tuple[FloatArray, FloatArray]:
    """Best linear unbiased estimate of the signal without noise, and its variance.

    Ordinary kriging from the NEIGHBOURS samples around each instant: the local mean is unknown.

    Args:
        at_s: (q,) instants within the samples.
        time_s: (n,) strictly increasing, n >= NEIGHBOURS.
        x: (n,) samples.
        variogram: of the signal.

    Returns:
        (q,) estimate and (q,) variance.

    Source:
        Cressie, Statistics for Spatial Data (1993), section 3.2.
    """
    first = np.clip(np.searchsorted(time_s, at_s) - NEIGHBOURS // 2, 0, len(time_s) - NEIGHBOURS)
    near = first[:, None] + np.arange(NEIGHBOURS)
    t, last = time_s[near], len(variogram.table) - 1

    def half_square(lag_s: FloatArray) -> FloatArray:
        index = np.minimum(np.abs(lag_s) / TABLE_STEP_S, last - 1e-6)
        low = index.astype(int)
        part = index - low
        return np.asarray(variogram.table[low] * (1 - part) + variogram.table[low + 1] * part)

    system = np.ones((len(at_s), NEIGHBOURS + 1, NEIGHBOURS + 1))
    system[:, -1, -1] = 0.0
    system[:, :-1, :-1] = -half_square(t[:, :, None] - t[:, None, :])
    diagonal = np.arange(NEIGHBOURS)
    floor = 1e-4 * variogram.table[-1] + 1e-12  # keeps a noiseless, smooth signal solvable
    system[:, diagonal, diagonal] += variogram.noise + floor
    right = np.ones((len(at_s), NEIGHBOURS + 1))
    right[:, :-1] = -half_square(t - at_s[:, None])
    weights = np.linalg.solve(system, right[:, :, None])[:, :, 0]
    estimate = np.einsum("qk,qk->q", weights[:, :-1], x[near])
    variance = -np.einsum("qk,qk->q", weights, right)
    return estimate, np.maximum(variance, 0.0)
