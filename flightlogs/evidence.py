"""Are these two records of one current? What a flight of the same plan cannot imitate.

Two flights of one plan share manoeuvres and differ in every gust. Two records of one flight differ
by the noise of the instruments and by what lies between samples, which is white. So what counts
is the slow part of the residual, beyond what white noise puts there, against the slow part of
the current, in each stretch of the flight on its own: stretches of calm hover, where a repeated
plan shares nothing, weigh as much as the manoeuvres.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from flightlogs.log import FloatArray

FAST_S, SLOW_S, STRETCH_S = 1.0, 10.0, 10.0
IN_FLIGHT = 0.3
"""Of the 95th percentile: less current than this is ground."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """How far the residual is from what two records of one current leave.

    Attributes:
        redness: slow variance of the residual / what its fast part lets expect of white noise.
        surprise: residual power / that of predicting each sample of the reference from its own
            neighbours (cubic through two on each side), in flight. A sensor of the same current
            knows better than the neighbours; a stranger does not.
        correlation: of the slow parts, over the flight.
        liveliness: slow standard deviation / mean current, in flight.
        stretches: how many were judged.
    """

    redness: float
    surprise: float
    correlation: float
    liveliness: float
    stretches: int


def bounded_power(v: FloatArray) -> float:
    """Mean square with outliers held at four standard deviations of the bulk."""
    return float(np.mean(np.minimum(v**2, 16 * 2.2 * np.median(v**2))))


def surprise(reference: FloatArray, residual: FloatArray) -> float:
    """Power of `residual` / power of predicting `reference` from its own neighbours, in flight."""
    z = reference
    own = z[2:-2] - (4 * (z[1:-3] + z[3:-1]) - (z[:-4] + z[4:])) / 6
    flying = z[2:-2] > IN_FLIGHT * np.percentile(z, 95)
    return bounded_power(residual[2:-2][flying]) / max(bounded_power(own[flying]), 1e-12)


def judge(expected: FloatArray, residual: FloatArray, spacing_s: float) -> Evidence | None:
    """Evidence from a comparison; None if fewer than two stretches were in flight.

    Args:
        expected: (m,) current as the sensor gives it at the reference's stamps.
        residual: (m,) reference - expected, in the same units.
        spacing_s: of the stamps.
    """
    fast_n = max(3, round(FAST_S / spacing_s))
    slow_n = max(10 * fast_n, round(SLOW_S / spacing_s))
    n = max(slow_n, round(STRETCH_S / spacing_s))
    if len(expected) < 2 * n:
        return None

    def slow(v: FloatArray) -> FloatArray:
        short = uniform_filter1d(v, fast_n, mode="nearest")
        return np.asarray(short - uniform_filter1d(v, slow_n, mode="nearest"))

    slow_residual, slow_expected = slow(residual), slow(expected)
    fast_residual = residual - uniform_filter1d(residual, fast_n, mode="nearest")
    white = (1 / fast_n - 1 / slow_n) / (1 - 1 / fast_n)  # slow / fast variance of white noise
    starts = range(0, len(expected) - n + 1, n)
    flying = np.array(
        [np.mean(expected[k : k + n]) > IN_FLIGHT * np.percentile(expected, 95) for k in starts]
    )
    if np.sum(flying) < 2:
        return None

    def power(v: FloatArray) -> FloatArray:
        return np.asarray(np.array([np.mean(v[k : k + n] ** 2) for k in starts])[flying])

    left, noise, signal = power(slow_residual), power(fast_residual), power(slow_expected)
    in_flight = np.repeat(flying, n)
    a = slow_expected[: len(in_flight)][in_flight]
    b = a + slow_residual[: len(in_flight)][in_flight]
    return Evidence(
        redness=float(np.median(left) / max(white * float(np.median(noise)), 1e-12)),
        surprise=surprise(expected + residual, residual),
        correlation=float(np.corrcoef(a, b)[0, 1]),
        liveliness=float(
            np.sqrt(np.median(signal)) / np.mean(expected[: len(in_flight)][in_flight])
        ),
        stretches=int(np.sum(flying)),
    )
