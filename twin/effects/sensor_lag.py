"""The current sensor follows late and smooths."""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy import sparse

from twin.effects.effect import Parameter
from twin.effects.likely import SENSOR, likeliest

FloatArray = npt.NDArray[np.float64]

WIDTH = 5  # samples of the polynomial through which a rate of change is read


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLag:
    """The sensor follows the current with a first-order lag: I = I_rec + tau I_rec'.

    Attributes:
        lag_s: tau.
        noise_A: white noise of the sensor, standard deviation (`likely`).
    """

    lag_s: float = 0.0
    noise_A: float = SENSOR.value

    id: ClassVar[str] = "sensor_lag"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="lag_s", unit="s", value=0.0, lower=0.0, upper=3.0, prior_std=0.3),
        SENSOR,
    )
    balance: ClassVar[str] = "current"
    equation: ClassVar[str] = r"\tau\,\dot I_\mathrm{rec} = I - I_\mathrm{rec}"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = "the voltage answers before the current changes; gusts are too small"

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:
        """(n,) the current in the pack.

        The likeliest one: `likely`. At no lag it is what was recorded.
        """
        if time_s.size < 2 or not np.ptp(recorded_A):
            return recorded_A
        one = sparse.csc_array(sparse.eye_array(time_s.size))
        near_A = recorded_A + self.lag_s * (slope_matrix(time_s, 2) @ recorded_A)
        unlagged = one + self.lag_s * slope_matrix(time_s, WIDTH - 1)
        likely_A, same_A = (
            likeliest(one, of, recorded_A, near_A, time_s, self.noise_A) for of in (unlagged, one)
        )
        return recorded_A + likely_A - same_A


def slope_matrix(time_s: FloatArray, degree: int) -> sparse.csc_array:
    """(n, n) values -> their rate of change.

    Of the polynomial of that `degree` nearest to the WIDTH samples around each, one-sided at ends.
    """
    return _slope_matrix(time_s.tobytes(), degree)


@lru_cache(maxsize=16)  # the same for every lag
def _slope_matrix(times: bytes, degree: int) -> sparse.csc_array:
    time_s = np.frombuffer(times)
    n = time_s.size
    width = min(WIDTH, n)
    first = np.clip(np.arange(n) - width // 2, 0, n - width)
    window = first[:, None] + np.arange(width)
    t = time_s[window] - time_s[:, None]
    scale_s = np.abs(t).max(axis=1, keepdims=True)
    powers = np.stack([(t / scale_s) ** k for k in range(min(degree + 1, width))], axis=-1)
    weights = np.linalg.pinv(powers)[:, 1, :] / scale_s  # singular to rounding across a pause
    at = np.repeat(np.arange(n), width), window.ravel()
    return sparse.csc_array((weights.ravel(), at), shape=(n, n))
