"""What is unexpected in samples, beneath which states wander: `filter_of`.

Source: the Kalman filter, Anderson, Moore, Optimal Filtering (1979), chapter 4; its gains depend on
no sample, so that it is a linear system of equations in few bands.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg.blas import dtbsv

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """One thing of s numbers that wanders beneath m samples.

    Attributes:
        drive: (m, s) of it in each of them.
        begun: (s,) its variance at the first.
        keep: (m - 1, s, s) of it from a sample to the next.
        added: (m - 1, s, s) to its covariance.
    """

    drive: FloatArray
    begun: FloatArray
    keep: FloatArray
    added: FloatArray

    @property
    def idle(self) -> bool:
        """It changes no sample."""
        return not (self.drive.any() and (self.begun.any() or self.added.any()))


@dataclass(frozen=True, slots=True, eq=False)
class Filter:
    """Of m samples.

    Attributes:
        bands: of its equations, see `_bands`.
        every: of these a sample.
        deviation: (m,) of each sample, by those before it.
    """

    bands: FloatArray
    every: int
    deviation: FloatArray

    def __call__(self, columns: FloatArray) -> FloatArray:
        """(m, k) innovations of columns (m, k), each in its deviations."""
        given = np.zeros((columns.shape[1], self.every * columns.shape[0]))
        given[:, self.every - 1 :: self.every] = columns.T
        below = self.bands.shape[0] - 1
        for one in given if columns.size else ():
            dtbsv(below, self.bands, one, lower=1, diag=1, overwrite_x=1)
        return np.asarray(given[:, self.every - 1 :: self.every] / self.deviation).T


def filter_of(states: Sequence[State], white: FloatArray) -> Filter:
    """`white` (m,): of each sample the variance of its white noise."""
    own = [s for s in states if not s.idle]
    drive = np.hstack([np.empty((white.size, 0)), *(s.drive for s in own)])
    steps = max(white.size - 1, 0)
    keep, added = (_blocks(a, steps) for a in ([s.keep for s in own], [s.added for s in own]))
    known = np.diag(np.concatenate([np.empty(0), *(s.begun for s in own)]))
    gains, variance = np.empty(drive.shape), np.empty(white.size)
    for k in range(white.size):  # Riccati's recursion; `known`: before a sample is seen
        along = known @ drive[k]
        variance[k] = drive[k] @ along + white[k]
        gains[k] = along / variance[k]
        if k < steps:
            known = keep[k] @ (known - gains[k][:, None] * along) @ keep[k].T + added[k]
    bands = _bands(drive, keep, np.einsum("nij,nj->ni", keep, gains[:-1]))
    return Filter(bands, drive.shape[1] + 1, np.sqrt(variance))


def _blocks(of_states: Sequence[FloatArray], steps: int) -> FloatArray:
    """(steps, p, p) with those (steps, s, s) of each state on the diagonal."""
    ends = np.cumsum([0, *(own.shape[-1] for own in of_states)]).tolist()
    out = np.zeros((steps, ends[-1], ends[-1]))
    for own, begin, end in zip(of_states, ends[:-1], ends[1:], strict=True):
        out[:, begin:end, begin:end] = own
    return out


def _bands(drive: FloatArray, keep: FloatArray, gained: FloatArray) -> FloatArray:
    """(p + 1 + widest, (p + 1) m): the filter as equations in turn; row j is j below the diagonal.

    `widest` is 1 where each state keeps to itself, and more by as many places as two are apart of
    which one goes into the other.

    For each sample x in turn: what is expected of the states s, and the innovation e,
    s[n] = keep s[n-1] + gained e[n-1], e[n] = x[n] - drive[n] s[n].
    """
    parts = drive.shape[1]
    every = parts + 1
    apart = np.abs(np.subtract(*np.nonzero(keep.any(axis=0))))
    widest = 1 + int(apart.max(initial=0))
    bands = np.zeros((every + widest, every * drive.shape[0]), order="F")
    bands[0] = 1.0
    for k in range(parts):
        bands[parts - k, k::every] = drive[:, k]
        bands[k + 1, parts:-every:every] = -gained[:, k]
        for j in range(max(k - widest + 1, 0), min(k + widest, parts)):
            bands[every + k - j, j:-every:every] = -keep[:, k, j]
    return bands
