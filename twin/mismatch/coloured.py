"""Noise of a voltage that was filtered before it was logged: `smooth_noise`.

Autopilots pass what they log through a low-pass. What is left of white noise then follows itself
for tenths of seconds: an Ornstein-Uhlenbeck process beside some white noise, told from the spectrum
of residuals. Source: Whittle, Ark. Mat. 2, 423 (1953), likelihood of a spectrum.
"""

from math import exp, log

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from twin.mismatch.wander import FloatArray, Wander
from twin.mismatch.white import LONGEST_S, NORMAL, REACH

LEAST_HZ = 0.1  # slower is physics
SLOW_S = 5.0  # before and after, whose mean is taken out
LEAST_SAMPLES = 200
SLOWEST_S = 3.0  # that a filter of a logger forgets over; a search that ends there found no filter
GAIN = 10.0  # of the logarithm of a probability: less is no colour
NEARLY = 0.95  # of that: it ends there
BEGINS_S = (0.15, 0.4, 0.9)
FAR = 5.0  # deviations: there a sample is no noise
JUMPS = 1.6
"""Spread of the changes from sample to sample over what most of them have. Of noise through a
filter it is 1 (1.00 to 1.14 in 134 recordings by another simulator, 1.3 at most in real ones); a
contact that comes and goes leaves few and large ones (2.2)."""
LEAST_WHITE = 0.3
"""Of the noise, which is white at least: from sample to sample no twin is so right that a filter,
which leaves nothing there, were all."""


def smooth_noise(
    residual_V: FloatArray, current_A: FloatArray, period_s: float, left: Wander | None = None
) -> tuple[float, Wander] | None:
    """White noise [V] of residuals (n,) and what wanders beside it; None if all of it is white.

    What follows the current, at lags up to REACH samples, is taken out first; `left` is known to
    wander in them.
    """
    if residual_V.size < LEAST_SAMPLES or period_s > LONGEST_S / 2:
        return None
    left_V = _alone(residual_V, current_A, period_s)
    if _jumps(left_V):
        return None
    power = np.abs(np.fft.rfft(left_V)) ** 2 / left_V.size
    hz = np.fft.rfftfreq(left_V.size, period_s)
    inside = (hz > LEAST_HZ) & (hz < 0.499 / period_s)
    power, turn = power[inside], np.cos(2.0 * np.pi * hz[inside] * period_s)
    known = _spectrum(left, left_V.size, period_s)[inside] if left else np.zeros(power.size)
    if not (whole := float(np.mean(power))):  # steady to the bit
        return None

    def cost(point: FloatArray) -> float:
        white, smooth, forgets_s = np.exp(point)
        keep = exp(-period_s / forgets_s)
        own = known + white + smooth * (1.0 - keep**2) / (1.0 - 2.0 * keep * turn + keep**2)
        return float(np.sum(np.log(own) + power / own))

    sizes = [tuple(log(whole) + np.log(e)) for e in ((1e-4, 3.0), (1e-3, 50.0))]
    bounds = [*sizes, (log(period_s / 2.0), log(SLOWEST_S))]
    found = [
        minimize(cost, np.log([0.3 * whole, whole, s]), method="L-BFGS-B", bounds=bounds)
        for s in BEGINS_S
    ]
    best = min(found, key=lambda f: float(f.fun))
    least = np.array([sizes[1][0], bounds[2][0]])
    white = minimize_scalar(lambda w: cost(np.append(w, least)), bounds=sizes[0], method="bounded")
    white_V, smooth_V, forgets_s = np.exp(best.x / [2.0, 2.0, 1.0]).tolist()
    if float(white.fun) - float(best.fun) < GAIN or forgets_s > NEARLY * SLOWEST_S:
        return None
    return max(white_V, LEAST_WHITE * smooth_V), Wander(size_V=smooth_V, forgets_s=forgets_s)


def _jumps(values_V: FloatArray) -> bool:
    """Values (n,) stand, and move by much now and then: normal noise through no filter does."""
    change_V = np.diff(values_V)
    return float(np.std(change_V)) > JUMPS * float(np.median(np.abs(change_V))) / NORMAL


def _spectrum(wander: Wander, samples: int, period_s: float) -> FloatArray:
    """(n // 2 + 1,) of so many samples, as `rfft` has it, over their number."""
    at = np.arange(samples, dtype=np.float64)
    follows = wander.follows(period_s * np.minimum(at, samples - at))
    return np.asarray(wander.size_V**2 * np.abs(np.fft.rfft(follows)))


def _alone(residual_V: FloatArray, current_A: FloatArray, period_s: float) -> FloatArray:
    """(n,) without what is slow, and what follows the current."""
    width = 2 * min(max(round(SLOW_S / period_s), 1), (residual_V.size - 1) // 2) + 1
    counts = np.convolve(np.ones(residual_V.size), np.ones(width), mode="same")

    def quick(values: FloatArray) -> FloatArray:
        return np.asarray(values - np.convolve(values, np.ones(width), mode="same") / counts)

    reach = min(REACH, residual_V.size // 60)
    lagged = [np.roll(current_A, k) for k in range(-reach, reach + 1)]
    columns = np.column_stack([quick(x) for x in (*lagged, current_A**2, current_A**3)])
    own_V = quick(residual_V)
    usual = np.abs(own_V) < FAR * np.median(np.abs(own_V)) / NORMAL
    slopes = np.linalg.lstsq(columns[usual], own_V[usual], rcond=None)[0]
    left_V = own_V - columns @ slopes
    most_V = FAR * float(np.median(np.abs(left_V))) / NORMAL
    return np.asarray(np.clip(left_V, -most_V, most_V))
