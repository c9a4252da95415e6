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

from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np
import numpy.typing as npt

from twin.mismatch.kalman import Filter, State, filter_of
from twin.mismatch.wander import Wander

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
        losses_V: of that by numbers of the twin that are off all along, see `stated`.
        heavy_tailed: the twin errs by far more in a few samples than in all others, see `tamed`.
        together_s: samples over so long are taken as one, their mean; 0: each by itself.
        current_A: of the recorded current, from sample to sample; 0 where none is sure.
        ohm: by which a twin answers to that.
        left: of what the likeliest current (`quiet`) is off by, through that resistance.
        smooth: of the voltage, which was filtered before it was logged (`coloured`).
        flown: the pack had flown before the recording, which begins under load (`begun`).
    """

    white_V: float
    slow_V: float
    slow_s: float
    along_V: float = 0.0
    along_s: float = 1.0
    losses_V: float = 0.0
    heavy_tailed: bool = False
    together_s: float = 0.0
    current_A: float = 0.0
    ohm: float = 0.0
    left: Wander | None = None
    smooth: Wander | None = None
    flown: bool = False

    @property
    def by_chance_V(self) -> float:
        """Of a sample, by the noise of voltage and current."""
        return hypot(self.white_V, *(w.size_V for w in (self.left, self.smooth) if w))

    def lasting_V(self, period_s: float) -> float:
        """White noise whose means over many samples, `period_s` apart, vary as those of all do."""
        lasts = [
            w.size_V * sqrt(max(1.0, 2.0 * w.forgets_s / period_s))
            for w in (self.left, self.smooth)
            if w
        ]
        return hypot(self.white_V, *lasts)

    def through(self, ohm: float) -> "Noise":
        """Of a twin that answers by so much to the noise of the current."""
        if self.left is None:
            return self
        left = replace(self.left, size_V=self.left.size_V * ohm / self.ohm)
        return replace(self, ohm=ohm, left=left)

    @property
    def own_V(self) -> float:
        """The twin's own error, all of its parts."""
        return hypot(self.slow_V, self.along_V, self.losses_V)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unseen:
    """Standard deviations of a voltage by what flowed between the samples.

    Attributes:
        walk_V: (n,) by what the charge is off after a second; it grows as a random walk does.
        walk_s: (n,) for how long it has walked.
        quick_V: (n,) by what surfaces answer beyond that.
        quick: how they forget that, each by its share: wanders of 1 V, rms, all together.
        paused_V: (n,) by what they answer after pauses of the logger.
        paused_s: (n,) for how long they have forgotten that, the time over which they do being 1 s.
        begun_V: (n, k) by what they answer to what flowed before the recording, in k ways that do
            not depend on each other.
    """

    walk_V: FloatArray
    walk_s: FloatArray
    quick_V: FloatArray
    quick: tuple[Wander, ...]
    paused_V: FloatArray
    paused_s: FloatArray
    begun_V: FloatArray

    def at(self, where: FloatArray, own: FloatArray) -> "Unseen":
        """At other places (m,) than its `own` (n,), along straight lines."""
        names = ("walk_V", "walk_s", "quick_V", "paused_V", "paused_s")
        ways = [np.interp(where, own, way_V) for way_V in self.begun_V.T]
        return replace(
            self,
            **{k: np.interp(where, own, getattr(self, k)) for k in names},
            begun_V=np.reshape(ways, (len(ways), where.size)).T,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Whitener:
    """Filters columns over the judged samples of one recording, or means of them.

    Attributes:
        at: (j,) which samples of the recording are judged.
        first: (m,) where in `at` each mean begins.
        noise: what is expected of a sample.
        unexpected: of the means, what those before do not tell.
        begun: of a pack that had flown before.
    """

    at: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    noise: Noise
    unexpected: Filter
    begun: "Begun | None" = None

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
        white = self.unexpected(means_from(columns[self.at], self.first))
        return tamed(white) if self.noise.heavy_tailed else white

    def settled(self, residual_V: FloatArray) -> FloatArray:
        """(j,) of (n,): the judged samples, without what flowed before at its likeliest."""
        own_V = residual_V[self.at]
        return own_V if self.begun is None else own_V - self.begun.likeliest_V(own_V, self.first)


@dataclass(frozen=True, slots=True, eq=False)
class Begun:
    """What flowed before a recording, in the voltage of its judged samples.

    Attributes:
        ways_V: (j, k) as in `Unseen`.
        unexpected: of the means, without these ways.
        white: (m, k) the ways as they are in that.
    """

    ways_V: FloatArray
    unexpected: Filter
    white: FloatArray

    def likeliest_V(self, residual_V: FloatArray, first: npt.NDArray[np.int64]) -> FloatArray:
        """(j,) of residuals (j,): each way by as much as is likeliest, if all vary by 1."""
        left = self.unexpected(means_from(residual_V[:, None], first))[:, 0]
        inner = np.eye(self.white.shape[1]) + self.white.T @ self.white
        return np.asarray(self.ways_V @ np.linalg.solve(inner, self.white.T @ left))


def whitener(  # noqa: PLR0913
    time_s: FloatArray,
    judged: BoolArray,
    noise: Noise,
    current_A: FloatArray | None = None,
    between: Unseen | None = None,
    ways_V: FloatArray | None = None,
) -> Whitener:
    """For one recording.

    Args:
        time_s: (n,) of its samples.
        judged: (n,) which of them count.
        noise: what is expected of them.
        current_A: (n,) where part of the twin's own error follows it.
        between: what flowed between them.
        ways_V: (n, k) in which it may be off all along, see `stated`, `idle`; k may be 0.
    """
    at = np.flatnonzero(judged)
    first = taken_together(time_s[at], noise.together_s)
    t_all = time_s[at]
    t, size = t_all[first], first.size
    drive = np.zeros(size) if current_A is None else means_from(current_A[at], first)
    drive = drive * sqrt(size) / max(float(np.linalg.norm(drive)), np.finfo(float).tiny)
    dt = np.diff(t)
    states = [
        _wanders(np.ones(size), dt, Wander(size_V=noise.slow_V, forgets_s=noise.slow_s)),
        _wanders(drive, dt, Wander(size_V=noise.along_V, forgets_s=noise.along_s)),
        *(
            _wanders(_of_means(left, t_all, first), dt, left)
            for left in (noise.left, noise.smooth)
            if left
        ),
    ]
    if ways_V is not None and ways_V.any() and size:
        states.append(_stays(means_from(ways_V[at], first)))
    white = noise.white_V**2 / np.diff(np.append(first, at.size))
    if between is not None and size:
        kinds = between.walk_V, between.quick_V, between.paused_V
        walk, quick, paused = (means_from(v[at], first) for v in kinds)
        walk_s, paused_s = (v[at][first] for v in (between.walk_s, between.paused_s))
        states += [
            _walks(walk, walk_s),
            *(_wanders(quick * _of_means(w, t_all, first), dt, w) for w in between.quick),
            _wanders(paused, np.diff(paused_s), Wander(size_V=1.0, forgets_s=1.0)),
        ]
        if between.begun_V.any():
            ways, rested = means_from(between.begun_V[at], first), filter_of(states, white)
            begun = Begun(between.begun_V[at], rested, rested(ways))
            return Whitener(at, first, noise, filter_of([*states, _stays(ways)], white), begun)
    return Whitener(at, first, noise, filter_of(states, white))


def _of_means(wander: Wander, time_s: FloatArray, first: npt.NDArray[np.int64]) -> FloatArray:
    """(m,) standard deviation of means from each of `first` to the next, that of a sample being 1.

    The samples of each are taken to be as far apart as usual.
    """
    counts = np.diff(np.append(first, time_s.size))
    period_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else 1.0
    sizes = {1: 1.0}
    for count in set(counts.tolist()) - {1}:
        later = np.arange(1, count)
        follows = (count - later) @ wander.follows(period_s * later)
        sizes[count] = sqrt((count + 2.0 * float(follows)) / count**2)
    return np.array([sizes[count] for count in counts.tolist()])


def _wanders(drive: FloatArray, dt: FloatArray, wander: Wander) -> State:
    """In proportion to `drive` (m,)."""
    keep = wander.keep(dt)
    one = np.eye(keep.shape[-1])
    added = wander.size_V**2 * (one - keep @ keep.transpose(0, 2, 1))
    return State(np.outer(drive, one[0]), wander.size_V**2 * np.diag(one), keep, added)


def _stays(drive: FloatArray) -> State:
    """Of so many sizes, each in proportion to its `drive` (m, k), of variance 1."""
    m, k = drive.shape
    keep = np.broadcast_to(np.eye(k), (max(m - 1, 0), k, k))
    return State(drive, np.ones(k), keep, np.zeros_like(keep))


def _walks(drive: FloatArray, walked_s: FloatArray) -> State:
    """A random walk, its variance as large as the time (m,) it has walked."""
    added = np.diff(walked_s)[:, None, None]
    return State(drive[:, None], walked_s[:1], np.ones_like(added), added)


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
