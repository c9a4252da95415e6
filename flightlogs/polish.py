"""The last milliseconds: maximum likelihood of the reference given the kriged sensor.

On Gaussian currents with the spectrum of a synthetic flight its errors are within a third of the
Cramer-Rao bound. That bound is 8 ppm of drift for 300 s and falls with the power 3/2 of the length:
no method knows the drift of a short flight to 20 ppm from currents at 5 and 10 Hz.
"""

from dataclasses import dataclass

import numpy as np

from flightlogs.krige import Variogram, cross_pairs, fit_variogram, krige, own_pairs
from flightlogs.log import FloatArray
from flightlogs.refine import TAIL, ClockMap, Pair, tail_weights

OWN_REACH = 20
"""Sample distances in the sensor's own variogram: 2 s at 10 Hz."""
CROSS_EDGES_S = np.arange(0.0, 0.61, 0.01)
CROSS_REACH = 6
"""Samples of the sensor on each side of one of the reference that make pairs with it."""
DIFFERENCE_S = (0.008, 0.005) + 12 * (0.004,)
"""Half widths of the difference quotients, step by step."""
LEARN_AT = (0, 2, 4)
"""Steps before which the variogram is learnt anew; the search does not end before the second."""
SETTLED = 0.1
"""A step smaller than this times the standard deviation ends the search."""
LARGEST_STEP_S = 0.02
INFLATION = 1.5
"""Of the standard deviations: the variogram is learnt from the samples it is used on, and errors of
60 synthetic flights (seeds 0 to 59 of the benchmark) were 1.4 and 1.7 times the sandwich's."""
MEMORY_S = 2.0
"""Scores are taken to be correlated over this time."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """The reference as the sensor predicts it under one map of the clocks.

    Attributes:
        loss: (m,) negative log likelihood of each sample.
        expected: (m,) current at the reference's stamps as the sensor gives it, in its units.
        residual: (m,) reference, in units of the sensor and without bias and trend, - expected.
        gain: sensor per reference.
        bias: sensor - gain reference, mean over the trend.
    """

    loss: FloatArray
    expected: FloatArray
    residual: FloatArray
    gain: float
    bias: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Polished:
    """The map of the clocks, how well it is known, and what remains.

    Attributes:
        clock: the map.
        middle_std_s: standard deviation of the map at the middle of the reference.
        drift_std: of the drift, dimensionless; nearly uncorrelated with the former.
        reference_s: (m,) stamps of the reference that have sensor samples around them.
        comparison: at the optimum.
        converged: False if the last step was not small against the uncertainty.
    """

    clock: ClockMap
    middle_std_s: float
    drift_std: float
    reference_s: FloatArray
    comparison: Comparison
    converged: bool


def covered(pair: Pair, clock: ClockMap) -> Pair:
    """The pair without the reference's samples that lie in holes of the sensor or outside it."""
    at, t = clock.to_sensor(pair.reference_s), pair.sensor_s
    after = np.clip(np.searchsorted(t, at), 1, len(t) - 1)
    near = (t[after] - t[after - 1]) < 2.5 * float(np.median(np.diff(t)))
    keep = near & (at >= t[0]) & (at <= t[-1])
    return Pair(
        sensor_s=t,
        sensor=pair.sensor,
        reference_s=pair.reference_s[keep],
        reference=pair.reference[keep],
    )


def compare(pair: Pair, clock: ClockMap, variogram: Variogram) -> Comparison:
    """Likelihood of the reference given the sensor; gain, bias, trend and scale profiled out."""
    u = pair.position(pair.reference_s)
    estimate, variance = krige(
        clock.to_sensor(pair.reference_s), pair.sensor_s, pair.sensor, variogram
    )
    columns = np.column_stack([estimate, np.ones_like(u), u, u**2])
    relative = variance + variogram.reference_noise
    relative = relative / max(float(np.mean(relative)), 1e-12) + 1e-3
    weight = 1.0 / relative
    for _ in range(4):
        root = np.sqrt(weight)
        c = np.linalg.lstsq(columns * root[:, None], pair.reference * root, rcond=None)[0]
        residual = pair.reference - columns @ c
        heavy, scale2 = tail_weights(residual**2 / relative)
        weight = heavy / relative
    z2 = residual**2 / relative
    loss = 0.5 * (TAIL + 1.0) * np.log1p(z2 / (TAIL * scale2)) + 0.5 * np.log(relative * scale2)
    return Comparison(
        loss=np.asarray(loss),
        expected=estimate,
        residual=np.asarray(residual / c[0]),
        gain=1.0 / float(c[0]),
        bias=-float(np.mean(columns[:, 1:] @ c[1:])) / float(c[0]),
    )


def learn(pair: Pair, clock: ClockMap, before: Variogram | None) -> Variogram:
    """Variogram from the sensor alone, or with what the reference adds once a map is known."""
    own = own_pairs(pair.sensor_s, pair.sensor, OWN_REACH)
    if before is None:
        return fit_variogram(own, (np.empty(0), np.empty(0)))
    there = compare(pair, clock, before)
    z, at = there.expected + there.residual, clock.to_sensor(pair.reference_s)
    near = np.searchsorted(pair.sensor_s, at)[:, None] + np.arange(-CROSS_REACH, CROSS_REACH)
    near = np.clip(near, 0, len(pair.sensor_s) - 1)
    lags = pair.sensor_s[near] - at[:, None]
    differences = pair.sensor[near] - z[:, None]
    return fit_variogram(own, cross_pairs(lags.ravel(), differences.ravel(), CROSS_EDGES_S))


def long_run(scores: FloatArray, reach: int) -> FloatArray:
    """(k, k) covariance of the sum of (n, k) scores that are correlated over `reach` samples.

    Source:
        Newey, West, Econometrica 55, 703 (1987), doi:10.2307/1913610.
    """
    s = scores - np.mean(scores, axis=0)
    total = np.asarray(s.T @ s)
    for k in range(1, min(reach, len(s) - 1) + 1):
        term = s[k:].T @ s[:-k]
        total = total + (1.0 - k / (reach + 1.0)) * (term + term.T)
    return total


def differentiate(
    pair: Pair, clock: ClockMap, variogram: Variogram, h: float
) -> tuple[FloatArray, FloatArray]:
    """(m, 2) scores and (2, 2) curvature of the loss by central differences of half width h."""

    def loss(a: float, b: float) -> FloatArray:
        return compare(pair, pair.moved(clock, np.array([a, b])), variogram).loss

    plus, minus = [loss(h, 0), loss(0, h)], [loss(-h, 0), loss(0, -h)]
    scores = np.column_stack([(a - b) / (2 * h) for a, b in zip(plus, minus, strict=True)])
    twice = 2 * np.sum(loss(0, 0))
    mixed = np.sum(loss(h, h) + loss(-h, -h) - loss(h, -h) - loss(-h, h)) / (4 * h**2)
    own = [(np.sum(a) + np.sum(b) - twice) / h**2 for a, b in zip(plus, minus, strict=True)]
    return scores, np.array([[own[0], mixed], [mixed, own[1]]])


def polish(pair: Pair, clock: ClockMap) -> Polished:
    """Newton's method on the likelihood, the variogram learnt again on the way.

    The covariance is the sandwich of curvature and long-run variance of the scores: it holds for
    residuals that are correlated over MEMORY_S and of changing size, and for a likelihood that
    is only approximately the right one.

    Args:
        pair: the two currents.
        clock: right within about 10 ms (`refine`).
    """
    pair = covered(pair, clock)
    reach = round(MEMORY_S / float(np.median(np.diff(pair.reference_s))))
    variogram = learn(pair, clock, learn(pair, clock, None))
    for k, h in enumerate(DIFFERENCE_S):
        if k in LEARN_AT:
            variogram = learn(pair, clock, variogram)
        scores, curvature = differentiate(pair, clock, variogram, h)
        uphill = bool(np.min(np.linalg.eigvalsh(curvature)) > 0)
        if not uphill:
            curvature = scores.T @ scores + 1e-9 * np.eye(2)  # far from the maximum
        inverse = np.linalg.inv(curvature)
        covariance = inverse @ long_run(scores, reach) @ inverse
        step = -inverse @ np.sum(scores, axis=0)
        step *= min(1.0, LARGEST_STEP_S / max(float(np.max(np.abs(step))), 1e-12))
        clock = pair.moved(clock, step)
        std = INFLATION * np.sqrt(np.diag(covariance))
        settled = uphill and bool(np.all(np.abs(step) < SETTLED * std + 1e-5))
        if settled and k > LEARN_AT[1]:
            break
    return Polished(
        clock=clock,
        middle_std_s=float(std[0]),
        drift_std=float(std[1]) / pair.half_s,
        reference_s=pair.reference_s,
        comparison=compare(pair, clock, variogram),
        converged=settled,
    )
