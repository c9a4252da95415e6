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
NEIGHBOUR_S = 0.2
"""Between a sample and the neighbours that foretell it, whatever the rate of the log."""
IN_FLIGHT = 0.3
"""Of the 95th percentile: less current than this is ground."""

Sensor = tuple[FloatArray, FloatArray]
"""Stamps and current."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """How far the residual is from what two records of one current leave.

    Attributes:
        redness: slow variance of the residual / what its fast part lets expect of white noise.
        surprise: residual power / that of predicting each sample of the reference from its own
            neighbours NEIGHBOUR_S apart, in flight. A sensor of the same current knows better
            than the neighbours; a stranger does not.
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


def unforetold(values: FloatArray, apart: int) -> float:
    """Power of predicting each sample from neighbours `apart` samples away, in flight.

    By the cubic through two on each side.
    """
    near, far = apart, 2 * apart
    middle = values[far:-far]
    beside = values[near : -far - near] + values[far + near : -near]
    beyond = values[: -2 * far] + values[2 * far :]
    flying = middle > IN_FLIGHT * np.percentile(values, 95)
    return bounded_power((middle - (4 * beside - beyond) / 6)[flying])


def apartness(time_s: FloatArray, current: FloatArray, spacing_s: float) -> float:
    """How much worse a sensor foretells itself from neighbours `spacing_s` than NEIGHBOUR_S apart.

    1.0 if its own samples do not tell these distances from each other.

    Args:
        time_s: (n,) stamps of the sensor, strictly increasing.
        current: (n,) finite.
        spacing_s: between the samples of the reference, after those too near are left out.
    """
    step_s = float(np.median(np.diff(time_s)))
    apart, usual = (max(1, round(s / step_s)) for s in (spacing_s, NEIGHBOUR_S))
    if apart == usual:
        return 1.0
    even = np.interp(np.arange(time_s[0], time_s[-1], step_s), time_s, current)
    return unforetold(even, apart) / max(unforetold(even, usual), 1e-12)


def surprise(reference: FloatArray, residual: FloatArray, spacing_s: float, own: Sensor) -> float:
    """Power of `residual` / power of predicting `reference` from neighbours NEIGHBOUR_S apart.

    Nearer neighbours are passed over. Where the samples are further apart, the power at
    NEIGHBOUR_S is theirs divided by how much worse the sensor foretells itself so far apart.
    """
    every = max(1, round(NEIGHBOUR_S / spacing_s))
    thin = reference[::every]
    flying = thin[2:-2] > IN_FLIGHT * np.percentile(thin, 95)
    left = bounded_power(residual[::every][2:-2][flying])
    return left / max(unforetold(thin, 1), 1e-12) * apartness(*own, every * spacing_s)


def judge(
    expected: FloatArray, residual: FloatArray, spacing_s: float, own: Sensor
) -> Evidence | None:
    """Evidence from a comparison; None if fewer than two stretches were in flight.

    Args:
        expected: (m,) current as the sensor gives it at the reference's stamps.
        residual: (m,) reference - expected, in the same units.
        spacing_s: of the stamps.
        own: the sensor's stamps and current, as long as the reference lasts.
    """
    fast_n = max(2, round(FAST_S / spacing_s))
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
        surprise=surprise(expected + residual, residual, spacing_s, own),
        correlation=float(np.corrcoef(a, b)[0, 1]),
        liveliness=float(
            np.sqrt(np.median(signal)) / np.mean(expected[: len(in_flight)][in_flight])
        ),
        stretches=int(np.sum(flying)),
    )
