"""The likeliest current behind what an instrument recorded: Wiener's filter, by least squares.

What the instrument does to the current is undone, and its noise with it: the noise alone would
change faster than the current. N. Wiener, Extrapolation, Interpolation, and Smoothing of Stationary
Time Series (1949).
"""

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.linalg import solveh_banded

from twin.effects.effect import Parameter

FloatArray = npt.NDArray[np.float64]

SENSOR = Parameter(
    name="noise_A", unit="A", value=0.1, lower=0.02, upper=2.0, prior_std=1.0, logarithmic=True
)
"""White noise of a current sensor on a vehicle, standard deviation: so much of a recording is not
taken for a change of the current. Of one that is not off it changes nothing."""


def likeliest(  # noqa: PLR0913
    seen: sparse.csc_array, flowed: sparse.csc_array, recorded_A: FloatArray, near_A: FloatArray,
    time_s: FloatArray, noise_A: float,
) -> FloatArray:  # fmt: skip
    """(n,) the current: `flowed` z, of the likeliest z, the current's increments being normal.

    z is that of least |seen z - recorded|^2 / noise_A^2 + |increments of flowed z|^2 / v.

    Args:
        seen: (n, n) z -> what the instrument records of it.
        flowed: (n, n) z -> current.
        recorded_A: (n,)
        near_A: (n,) a current whose increments are about as large: v is their mean square, as if
            it were sampled all the time as often as in the quarter with the densest samples.
        time_s: (n,)
        noise_A: of the instrument, standard deviation.
    """
    changes = flowed[1:] - flowed[:-1]
    steps = float(np.ptp(time_s) / np.quantile(np.diff(time_s), 0.25))
    weight = noise_A**2 * steps / float(np.sum(np.diff(near_A) ** 2))
    normal = (seen.T @ seen + weight * (changes.T @ changes)).tocoo()
    reach = int(np.max(normal.row - normal.col))
    bands = np.stack([np.pad(normal.diagonal(-k), (0, k)) for k in range(reach + 1)])
    return np.asarray(flowed @ solveh_banded(bands, seen.T @ recorded_A, lower=True))
