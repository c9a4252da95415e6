"""Offset and drift beyond the grid of the search, to a few milliseconds.

Both currents are smoothed by the same local polynomial, which can be evaluated at any instant,
with its slope. What motors and ESCs do above 5 Hz is folded into both recordings, each in its own
way, and would pull an interpolating fit towards lags that put sample upon sample; the smoothing
removes it. What it wastes of the evidence is recovered by polish.py.
"""

from dataclasses import dataclass

import numpy as np

from flightlogs.log import FloatArray

REACH = 3.0
"""Half length of the window in standard deviations."""
TAIL = 4.0
"""Degrees of freedom of Student's t: glitches and spikes then hardly pull."""
ITERATIONS = 30
LARGEST_STEP_S = 0.05
"""Of an iteration: beyond it the slope of the current says nothing about its course."""


@dataclass(frozen=True, slots=True)
class ClockMap:
    """t_reference = t_sensor (1 + drift) + offset_s."""

    offset_s: float
    drift: float

    def to_reference(self, sensor_s: FloatArray) -> FloatArray:
        """Times on the reference's clock."""
        return np.asarray(sensor_s * (1.0 + self.drift) + self.offset_s)

    def to_sensor(self, reference_s: FloatArray) -> FloatArray:
        """Times on the sensor's clock."""
        return np.asarray((reference_s - self.offset_s) / (1.0 + self.drift))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pair:
    """Samples of two instruments.

    Attributes:
        sensor_s: (n,) stamps of the sensor, strictly increasing.
        sensor: (n,) finite.
        reference_s: (m,) stamps of the reference, on its own clock, strictly increasing.
        reference: (m,) finite.
    """

    sensor_s: FloatArray
    sensor: FloatArray
    reference_s: FloatArray
    reference: FloatArray

    @property
    def middle_s(self) -> float:
        """Of the reference: there offset and drift are nearly uncorrelated."""
        return 0.5 * float(self.reference_s[-1] + self.reference_s[0])

    @property
    def half_s(self) -> float:
        """Half the length of the reference: turns a drift into a time."""
        return 0.5 * float(self.reference_s[-1] - self.reference_s[0])

    def position(self, reference_s: FloatArray) -> FloatArray:
        """-1 at the first stamp of the reference, 1 at the last."""
        return np.asarray((reference_s - self.middle_s) / self.half_s)

    def moved(self, clock: ClockMap, p: FloatArray) -> ClockMap:
        """`clock` with p[0] + p[1] position [s] added to the times it gives on the sensor's."""
        rate = 1.0 / (1.0 + clock.drift) + p[1] / self.half_s
        at_zero = -clock.offset_s / (1.0 + clock.drift) + p[0] - p[1] * self.middle_s / self.half_s
        return ClockMap(offset_s=float(-at_zero / rate), drift=float(1.0 / rate - 1.0))


def smooth(
    at_s: FloatArray, time_s: FloatArray, x: FloatArray, width_s: float
) -> tuple[FloatArray, FloatArray]:
    """Local quadratic with Gaussian weights: value and slope (q,) at any instant.

    Exact for a quadratic whatever the stamps; NaN where fewer than five samples lie in the window
    or none close by on one side (holes are not bridged).

    Source:
        Fan, Gijbels, Local Polynomial Modelling and Its Applications (1996), section 3.1.
    """
    step = float(np.median(np.diff(time_s)))
    count = min(2 * int(np.ceil(REACH * width_s / step)) + 1, len(time_s))
    nearest = np.searchsorted(time_s, at_s) - count // 2
    index = np.clip(nearest, 0, len(time_s) - count)[:, None] + np.arange(count)
    d = (time_s[index] - at_s[:, None]) / width_s
    inside = np.abs(d) <= REACH
    weight = np.where(inside, np.exp(-0.5 * d**2), 0.0)
    moment = [np.sum(weight * d**k, axis=1) for k in range(5)]
    right = np.stack([np.sum(weight * d**k * x[index], axis=1) for k in range(3)], axis=-1)
    near = max(1.0, 1.5 * step / width_s)
    good = np.any((d >= 0) & (d <= near), axis=1) & np.any((d <= 0) & (d >= -near), axis=1)
    good &= np.sum(inside, axis=1) >= 5
    normal = np.empty((len(at_s), 3, 3))
    for i in range(3):
        for j in range(3):
            normal[:, i, j] = moment[i + j]
    normal[~good] = np.eye(3)
    c = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
    return np.where(good, c[:, 0], np.nan), np.where(good, c[:, 1] / width_s, np.nan)


def tail_weights(z2: FloatArray) -> tuple[FloatArray, float]:
    """Weights (n,) of squared residuals under Student's t, and their scale squared.

    Source:
        Lange, Little, Taylor, J. Am. Stat. Assoc. 84, 881 (1989), doi:10.2307/2290063.
    """
    scale2 = max(2.2 * float(np.median(z2)), 1e-12)  # of a normal distribution
    for _ in range(10):
        weight = (TAIL + 1.0) / (TAIL + z2 / scale2)
        scale2 = max(float(np.mean(weight * z2)), 1e-12)
    return np.asarray((TAIL + 1.0) / (TAIL + z2 / scale2)), scale2


def refine(pair: Pair, clock: ClockMap, *, width_s: float) -> tuple[ClockMap, float]:
    """Gauss-Newton on offset, drift, gain and a slow quadratic trend, robust to spikes.

    Args:
        pair: the two currents.
        clock: right within the correlation time of the smoothed current.
        width_s: of the smoothing.

    Returns:
        The map, and the share (0..1) of the reference's smoothed variance left unexplained.
    """
    at = clock.to_sensor(pair.reference_s)
    reference, _ = smooth(pair.reference_s, pair.reference_s, pair.reference, width_s)
    p, share = np.zeros(2), 1.0
    for _ in range(ITERATIONS):
        u = pair.position(pair.reference_s)
        estimate, slope = smooth(at + p[0] + p[1] * u, pair.sensor_s, pair.sensor, width_s)
        used = np.isfinite(estimate) & np.isfinite(reference)
        if np.sum(used) < 20:
            return clock, 1.0
        u, estimate, slope, y = u[used], estimate[used], slope[used], reference[used]
        linear = np.column_stack([estimate, np.ones_like(u), u, u**2])
        c = np.linalg.lstsq(linear, y, rcond=None)[0]
        weight, scale2 = tail_weights((y - linear @ c) ** 2)
        c = np.linalg.lstsq(linear * weight[:, None] ** 0.5, y * weight**0.5, rcond=None)[0]
        full = np.column_stack([c[0] * slope, c[0] * slope * u, linear])
        delta = np.linalg.lstsq(
            full * weight[:, None] ** 0.5, (y - linear @ c) * weight**0.5, rcond=None
        )[0]
        step = np.clip(delta[:2], -LARGEST_STEP_S, LARGEST_STEP_S)
        p, share = p + step, min(1.0, scale2 / max(float(np.var(y)), 1e-12))
        if np.max(np.abs(step)) < 1e-5:
            break
    return pair.moved(clock, p), share
