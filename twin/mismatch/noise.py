"""The noise of a recording, and residuals freed of all that noise and the twin's own error explain.

What differs by chance: white noise of the voltage (with its steps, and the current's noise through
the resistance), estimated from the recording, and what flowed between its samples (`unseen`). What
differs without meaning: the twin is never exact; its own error wanders slowly, and of a calibrated
twin a share of it is one of losses, which follows the current. Filtered by what is known of all
these, residuals become numbers that are independent and have variance 1 if nothing else is in them.

Source of the filter: the Kalman filter of Ornstein-Uhlenbeck processes, and of a random walk, seen
in white noise, which knows nothing before the first sample but how far they wander, and in a gap
forgets as they do (Anderson, Moore, Optimal Filtering, 1979, chapter 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_banded

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

HUBER = 1.345  # deviations, up to which squares count: 95 % efficient if all are normal


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Of the residuals of one recording.

    Attributes:
        white_V: standard deviation from sample to sample.
        slow_V: of the twin's own error.
        slow_s: time over which that forgets.
        along_V: of that in proportion to the current, where it is as large as its rms.
        along_s: time over which that forgets.
        heavy_tailed: the twin errs by far more in a few samples than in all others, see `tamed`.
        together_s: samples over so long are taken as one, their mean; 0: each by itself.
        current_A: of the recorded current, from sample to sample; 0 where none is sure.
        left_V: of what the likeliest current (`quiet`) is off by, through the twin's resistance.
        left_s: time over which that forgets.
    """

    white_V: float
    slow_V: float
    slow_s: float
    along_V: float = 0.0
    along_s: float = 1.0
    heavy_tailed: bool = False
    together_s: float = 0.0
    current_A: float = 0.0
    left_V: float = 0.0
    left_s: float = 1.0

    @property
    def by_chance_V(self) -> float:
        """Of a sample, by the noise of voltage and current."""
        return hypot(self.white_V, self.left_V)

    @property
    def own_V(self) -> float:
        """The twin's own error, both parts."""
        return hypot(self.slow_V, self.along_V)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unseen:
    """Standard deviations of a voltage by what flowed between the samples.

    Attributes:
        walk_V: (n,) by what the charge is off after a second; it grows as a random walk does.
        walk_s: (n,) for how long it has walked.
        quick_V: (n,) by what surfaces answer beyond that.
        quick_s: time over which they forget.
        paused_V: (n,) by what they answer after pauses of the logger.
        paused_s: (n,) for how long they have forgotten that, the time over which they do being 1 s.
    """

    walk_V: FloatArray
    walk_s: FloatArray
    quick_V: FloatArray
    quick_s: float
    paused_V: FloatArray
    paused_s: FloatArray

    def at(self, where: FloatArray, own: FloatArray) -> "Unseen":
        """At other places (m,) than its `own` (n,), along straight lines."""
        names = ("walk_V", "walk_s", "quick_V", "paused_V", "paused_s")
        return replace(self, **{k: np.interp(where, own, getattr(self, k)) for k in names})


@dataclass(frozen=True, slots=True, eq=False)
class Whitener:
    """Filters columns over the judged samples of one recording, or means of them.

    Attributes:
        at: (j,) which samples of the recording are judged.
        first: (m,) where in `at` each mean begins.
        noise: what is expected of a sample.
        bands: of the filter, see `_bands`.
        deviation_V: (m,) of each mean, by those before it.
    """

    at: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    noise: Noise
    bands: FloatArray
    deviation_V: FloatArray

    @property
    def samples(self) -> npt.NDArray[np.int64]:
        """(m,) of each mean the first."""
        return self.at[self.first]

    def __call__(self, columns: FloatArray) -> FloatArray:
        """(m, 1 + k) whitened, of residuals and k derivatives (n, 1 + k): the judged samples.

        Where the noise is heavy-tailed, `tamed`.
        """
        if not self.at.size:
            return columns[self.at]
        x = means_from(columns[self.at], self.first)
        below = self.bands.shape[0] - 1
        given = np.zeros((below * x.shape[0], x.shape[1]))
        given[below - 1 :: below] = x
        innovations = solve_banded((below, 0), self.bands, given)[below - 1 :: below]
        white = np.asarray(innovations / self.deviation_V[:, None])
        return tamed(white) if self.noise.heavy_tailed else white


def whitener(
    time_s: FloatArray,
    judged: BoolArray,
    noise: Noise,
    current_A: FloatArray | None = None,
    between: Unseen | None = None,
) -> Whitener:
    """For one recording.

    Args:
        time_s: (n,) of its samples.
        judged: (n,) which of them count.
        noise: what is expected of them.
        current_A: (n,) where part of the twin's own error follows it.
        between: what flowed between them.
    """
    at = np.flatnonzero(judged)
    first = taken_together(time_s[at], noise.together_s)
    t, size = time_s[at][first], first.size
    drive = np.zeros(size) if current_A is None else means_from(current_A[at], first)
    drive = drive * sqrt(size) / max(float(np.linalg.norm(drive)), np.finfo(float).tiny)
    dt = np.diff(t)
    wanders = [
        _wanders(np.ones(size), dt, noise.slow_s, noise.slow_V),
        _wanders(drive, dt, noise.along_s, noise.along_V),
        _wanders(np.ones(size), dt, noise.left_s, noise.left_V),
    ]
    if between is not None and size:
        kinds = between.walk_V, between.quick_V, between.paused_V
        walk, quick, paused = (means_from(v[at], first) for v in kinds)
        walk_s, paused_s = (v[at][first] for v in (between.walk_s, between.paused_s))
        wanders += [
            _State(walk, float(walk_s[0]), np.ones(dt.size), np.diff(walk_s)),
            _wanders(quick, dt, between.quick_s, 1.0),
            _wanders(paused, np.diff(paused_s), 1.0, 1.0),
        ]
    states = [s for s in wanders if s.drive.any() and (s.begun or s.added.any())]
    white = noise.white_V**2 / np.diff(np.append(first, at.size))
    gains, deviation_V = _gains(states, white)
    return Whitener(at, first, noise, _bands(states, gains), deviation_V)


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """One thing that wanders beneath m samples.

    Attributes:
        drive: (m,) of it in each of them.
        begun: its variance at the first.
        keep: (m - 1,) of it from a sample to the next.
        added: (m - 1,) to its variance.
    """

    drive: FloatArray
    begun: float
    keep: FloatArray
    added: FloatArray


def _wanders(drive: FloatArray, dt: FloatArray, memory_s: float, size: float) -> _State:
    """An Ornstein-Uhlenbeck process of such a standard deviation."""
    keep = np.exp(-dt / memory_s)
    return _State(drive, size**2, keep, size**2 * (1.0 - keep**2))


def taken_together(time_s: FloatArray, together_s: float) -> npt.NDArray[np.int64]:
    """(m,) first of the samples that are taken together; each by itself where they are few."""
    if time_s.size < 2 or 2 * float(np.median(np.diff(time_s))) > together_s:
        return np.arange(time_s.size)
    return beginnings(time_s, together_s)


def beginnings(time_s: FloatArray, together_s: float) -> npt.NDArray[np.int64]:
    """(m,) first of the samples (n,) of each period so long that has any."""
    return np.unique((time_s - time_s[0]) // together_s, return_index=True)[1]


def means_from(values: FloatArray, first: npt.NDArray[np.int64]) -> FloatArray:
    """Means of the rows from each of `first` (m,) to the next."""
    counts = np.diff(np.append(first, values.shape[0])).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(np.add.reduceat(values, first, axis=0) / counts)


def _gains(states: Sequence[_State], white: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(m, p) of each of p states by an innovation, and its deviation (m,): Riccati's recursion.

    `white` (m,): of each sample the variance of its white noise [V2].
    """
    drives = _columns([s.drive for s in states], white.size)
    added = _columns([s.added for s in states], white.size - 1)
    keep = _columns([s.keep for s in states], white.size - 1)
    keeps = keep[:, :, None] * keep[:, None, :]
    gains, variance = np.empty(drives.shape), np.empty(white.size)
    known = np.diag([s.begun for s in states])  # their covariance before a sample is seen
    for k, (drive, own) in enumerate(zip(drives, white.tolist(), strict=True)):
        along = known @ drive
        variance[k] = drive @ along + own
        gains[k] = along / variance[k]
        if k < keeps.shape[0]:
            known = keeps[k] * (known - gains[k][:, None] * along)
            known.flat[:: known.shape[0] + 1] += added[k]
    return gains, np.sqrt(variance)


def _columns(of_states: Sequence[FloatArray], size: int) -> FloatArray:
    return np.array(of_states).reshape(len(of_states), max(size, 0)).T


def _bands(states: Sequence[_State], gains: FloatArray) -> FloatArray:
    """(p + 2, (p + 1) m): the filter as equations in turn; row j is j below the diagonal.

    For each sample x in turn: what is expected of each state s, and the innovation e,
    s[n] = keep (s[n-1] + gain e[n-1]), e[n] = x[n] - sum of drive[n] s[n].
    """
    parts, every = len(states), len(states) + 1
    bands = np.zeros((parts + 2, every * gains.shape[0]))
    bands[0] = 1.0
    for k, state in enumerate(states):
        bands[parts - k, k::every] = state.drive
        bands[every, k:-every:every] = -state.keep
        bands[k + 1, parts:-every:every] = -state.keep * gains[:-1, k]
    return bands


def tamed(whitened: FloatArray) -> FloatArray:
    """Whitened residuals (n,) with Huber's loss as their squares, and derivatives with them.

    What is stated of a twin's error is one of hours of tests and says nothing of its size where a
    load has just been switched: of a cold discharge of 1.5 h, eight samples of an LG M50 made over
    90 % of all squares. Beyond HUBER a residual r counts by 2 HUBER |r| - HUBER^2. P. J. Huber,
    Robust estimation of a location parameter, Ann. Math. Stat. 35, 73 (1964).

    Args:
        whitened: (n, 1 + k) the residuals, then their derivatives by k numbers.
    """
    size = np.abs(whitened[:, 0])
    root = np.sqrt(2.0 * HUBER * np.maximum(size, HUBER) - HUBER**2)
    out = whitened * (HUBER / root)[:, None]
    out[:, 0] = np.sign(whitened[:, 0]) * root
    return np.where((size > HUBER)[:, None], out, whitened)
