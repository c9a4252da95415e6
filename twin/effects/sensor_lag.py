"""The current sensor follows late and smooths."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from twin.effects.effect import Parameter

FloatArray = npt.NDArray[np.float64]

WIDTH = 5
"""Samples of the parabola through which a rate of change is read: noise counts a third."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLag:
    """The sensor follows the current with a first-order lag: I = I_rec + tau I_rec'."""

    lag_s: float = 0.0

    id: ClassVar[str] = "sensor_lag"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="lag_s", unit="s", value=0.0, lower=0.0, upper=3.0, prior_std=0.3),
    )
    balance: ClassVar[str] = "current"
    equation: ClassVar[str] = r"\tau\,\dot I_\mathrm{rec} = I - I_\mathrm{rec}"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = "the voltage answers before the current changes; gusts are too small"

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:
        """(n,) the current in the pack."""
        return recorded_A + self.lag_s * slope(time_s, recorded_A)


def slope(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """(n,) rate of change: of the parabola through WIDTH samples around each; one-sided at ends."""
    n = time_s.size
    width = min(WIDTH, n)
    if width < 2:
        return np.zeros(n)
    first = np.clip(np.arange(n) - width // 2, 0, n - width)
    window = first[:, None] + np.arange(width)
    t = time_s[window] - time_s[:, None]
    terms = np.stack([np.ones_like(t), t, t**2], axis=-1)[..., : min(3, width)]
    solved = np.linalg.pinv(terms) @ values[window][..., None]
    return np.asarray(solved[:, 1, 0], dtype=float)
