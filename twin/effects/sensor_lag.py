"""The current sensor follows late and smooths."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.linalg import solveh_banded

from twin.effects.effect import Parameter

FloatArray = npt.NDArray[np.float64]

WIDTH = 5  # samples of the polynomial through which a rate of change is read
SENSOR_A = 0.1
"""White noise of a current sensor on a vehicle, standard deviation: so much of a recording is not
taken for a change of the current."""


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
        """(n,) the current in the pack.

        The likeliest one, its increments being normal (Wiener's filter): the rate of change of the
        noise alone would be larger than the current. At no lag it is what was recorded.
        """
        if time_s.size < 2 or not np.ptp(recorded_A):
            return recorded_A
        one = sparse.csc_array(sparse.eye_array(time_s.size))
        near = recorded_A + self.lag_s * (slope_matrix(time_s, 2) @ recorded_A)
        weight = SENSOR_A**2 / float(np.mean(np.diff(near) ** 2))
        unlagged = one + self.lag_s * slope_matrix(time_s, WIDTH - 1)
        likely, same = (_likeliest_A(of, recorded_A, weight) for of in (unlagged, one))
        return recorded_A + likely - same


def _likeliest_A(unlagged: sparse.csc_array, recorded_A: FloatArray, weight: float) -> FloatArray:
    """(n,) unlagged @ z of least |z - recorded|^2 + weight |increments of unlagged @ z|^2."""
    changes = unlagged[1:] - unlagged[:-1]
    n = recorded_A.size
    normal = sparse.eye_array(n) + weight * (changes.T @ changes)
    reach = min(2 * WIDTH, n - 1)  # of what a sample has to do with
    bands = np.stack([np.pad(normal.diagonal(k), (0, k)) for k in range(reach + 1)])
    return np.asarray(unlagged @ solveh_banded(bands, recorded_A, lower=True))


def slope_matrix(time_s: FloatArray, degree: int) -> sparse.csc_array:
    """(n, n) values -> their rate of change.

    Of the polynomial of that `degree` nearest to the WIDTH samples around each, one-sided at ends.
    """
    n = time_s.size
    width = min(WIDTH, n)
    first = np.clip(np.arange(n) - width // 2, 0, n - width)
    window = first[:, None] + np.arange(width)
    t = time_s[window] - time_s[:, None]
    scale_s = np.abs(t).max(axis=1, keepdims=True)
    powers = np.stack([(t / scale_s) ** k for k in range(min(degree + 1, width))], axis=-1)
    weights = np.linalg.pinv(powers)[:, 1, :] / scale_s
    at = np.repeat(np.arange(n), width), window.ravel()
    return sparse.csc_array((weights.ravel(), at), shape=(n, n))
