"""`correlation_time`: how much correlated samples tell."""

import numpy as np
import numpy.typing as npt

LAGS_PER_TIME = 5  # the sum over lags ends at so many times itself


def correlation_time(residuals: npt.NDArray[np.float64]) -> float:
    """How many samples tell as much as one: 1 + 2 sum of autocorrelations, at least 1.

    The mean is not taken out: what is off all along says the same in every sample. Where the sum
    ends is of Sokal, Monte Carlo methods in statistical mechanics (1996), section 3.
    """
    n = residuals.size
    if not residuals.any():
        return 1.0
    covariances = np.fft.irfft(np.abs(np.fft.rfft(residuals, 2 * n)) ** 2)[:n]
    sums = 2 * np.cumsum(covariances / covariances[0]) - 1
    enough = np.arange(n) >= LAGS_PER_TIME * sums
    return float(max(1.0, sums[int(np.argmax(enough)) if enough.any() else -1]))
