"""Which lags bring two recordings of one current together: plain arrays in, numbers out."""

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft
from scipy.ndimage import median_filter, uniform_filter1d

from flightlogs.log import FloatArray

STEP_S = 0.1
"""Grid of the search; the fit that follows is finer than any grid."""
SPIKE = 20.0
MAX_GAP_S = 0.5
"""Across a longer hole nothing is interpolated."""


def regrid(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Values on the even grid from time_s[0], straight between samples, NaN across holes."""
    keep = np.isfinite(values)
    t, v = time_s[keep], values[keep]
    grid = np.arange(time_s[0], time_s[-1] + STEP_S / 2, STEP_S)
    out = np.interp(grid, t, v, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    # A reference at 1 Hz has no holes of its own, only a slow rate.
    hole = (t[after] - t[after - 1]) > max(MAX_GAP_S, 2.5 * float(np.median(np.diff(t))))
    out[hole & (grid > t[after - 1]) & (grid < t[after])] = np.nan
    return out


def spikes(values: FloatArray) -> npt.NDArray[np.bool_]:
    """(n,) single samples far from the median of five around them: glitches, not current.

    Far is SPIKE times the upper quartile of that distance: five or more standard deviations of
    a flight's ripple even where most of the recording is ground.
    """
    away = np.abs(values - median_filter(values, 5, mode="nearest"))
    return np.asarray(away > SPIKE * max(float(np.percentile(away, 75)), 1e-9))


def masked_mean(values: FloatArray, samples: int) -> FloatArray:
    """Moving average (n,) over the finite values of a centred window; NaN where there is none."""
    good = np.isfinite(values)
    total = uniform_filter1d(np.where(good, values, 0.0), samples, mode="constant")
    weight = uniform_filter1d(good.astype(float), samples, mode="constant")
    enough = weight > 0.5 / samples
    return np.where(enough, total / np.where(enough, weight, 1.0), np.nan)


def lively(values: FloatArray, *, trend_s: float, limit: float, step_s: float) -> FloatArray:
    """What manoeuvres and gusts do: the trend removed, and take-off kept from outweighing all.

    Steps between ground and flight are alike in every flight; without the limit they alone would
    decide. Deviations are bounded at `limit` times the median absolute one.

    Args:
        values: (n,) on an even grid, NaN across holes.
        trend_s: what is slower is trend.
        limit: bound in median absolute deviations.
        step_s: of the grid.
    """
    fast = values - masked_mean(values, max(3, round(trend_s / step_s)))
    scale = float(np.nanmedian(np.abs(fast)))
    return np.clip(fast, -limit * scale, limit * scale)


def overlap_correlation(
    a: FloatArray, b: FloatArray, min_overlap: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Correlation coefficient of b against a moved by every lag, over what is common to both.

    Args:
        a: (n,) on an even grid, NaN across holes.
        b: (m,) on a grid of the same step.
        min_overlap: lags with fewer common samples are NaN.

    Returns:
        lags (n + m - 1,) in samples (a[i] meets b[i + lag]), correlation, common samples.

    Source:
        Padfield, IEEE Trans. Image Processing 21, 2706 (2012), doi:10.1109/TIP.2011.2181402.
    """
    size = next_fast_len(len(a) + len(b) - 1, real=True)
    transforms = []
    for v in (a, b):
        good = np.isfinite(v)
        filled = np.where(good, v, 0.0)
        transforms.append([rfft(w, size) for w in (good.astype(float), filled, filled**2)])
    (ma, fa, ga), (mb, fb, gb) = transforms
    lags = np.arange(-(len(a) - 1), len(b))

    def meet(p: FloatArray, q: FloatArray) -> FloatArray:
        return np.asarray(irfft(np.conj(p) * q, size)[lags])

    n = np.round(meet(ma, mb))
    enough = n >= max(min_overlap, 3)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_a, mean_b = meet(fa, mb) / n, meet(ma, fb) / n
        cov = meet(fa, fb) / n - mean_a * mean_b
        var_a = meet(ga, mb) / n - mean_a**2
        var_b = meet(ma, gb) / n - mean_b**2
        r = cov / np.sqrt(np.maximum(var_a * var_b, 0.0))
    return lags.astype(float), np.where(enough & np.isfinite(r), np.clip(r, -1, 1), np.nan), n


def significance(r: FloatArray, n: FloatArray) -> FloatArray:
    """Fisher's z of correlations r (k,) over n (k,) samples, in standard deviations if white.

    Ranks lags: a short overlap reaches a high correlation by chance.
    """
    return np.asarray(np.arctanh(np.clip(r, -0.9999, 0.9999)) * np.sqrt(np.maximum(n - 3, 0)))


def peaks(lags: FloatArray, score: FloatArray, *, apart: int, count: int) -> FloatArray:
    """(k <= count,) lags of the highest scores above 0, at least `apart` samples apart."""
    left = np.where(np.isfinite(score), score, -np.inf)
    found: list[float] = []
    while len(found) < count and np.max(left) > 0:
        best = int(np.argmax(left))
        found.append(float(lags[best]))
        left[max(0, best - apart) : best + apart + 1] = -np.inf
    return np.array(found)
