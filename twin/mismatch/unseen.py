"""What flowed between the samples of a current, and what it did to the voltage.

Between two samples of a current that never rests the straight line has another mean than the
current. The errors of the intervals are as good as independent, so that the charge drawn so far is
off by a random walk: nothing in mid discharge, and the first of all errors where a cell is nearly
empty and its voltage falls as from a cliff. And until a particle has spread what it gave, its
surface answers by more: that is forgotten within seconds. Where the logger paused, whole gusts are
missed (`pauses`): the walk leaps, and what follows is forgotten more slowly.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, log, prod, sqrt

import numpy as np
from scipy.optimize import nnls

from twin.effects import CurrentGain
from twin.load import Between, Load
from twin.mismatch.begun import preceded, slower
from twin.mismatch.flight import FloatArray
from twin.mismatch.left import beyond_cut_offs
from twin.mismatch.noise import Unseen
from twin.mismatch.pauses import Pause, filled, pauses
from twin.mismatch.wander import Wander
from twin.pack import Pack
from twin.simulate import as_flowed, simulate, simulate_all

SOC_STEP = 1e-4
CURRENTS = 4
"""That may as well have flowed; a surface answers by what the twin says of so many."""
UNEVEN = 10.0
"""Of four intervals the longest over the shortest, beyond which a cycler put samples where its
current changed, and a straight line between them is right; loggers are late by less."""
BRIEF = (
    0.01  # of the usual interval: nothing unseen flows in one that only parts the sides of a step
)
AS_LARGE = 5  # samples in turn, over which that is averaged
SHORTEST, LONGER = 0.5, 4.0  # samples: in so many it may be forgotten, and in so many times more
LAGS, ENOUGH = 24, 4  # at which it is seen how; one of a recording's length is seen so often
LEAST_SHARE = 0.01  # of its variance
KEPT = 0.01  # of what follows a pause, from one sample to the next, at least
WAYS = 12  # in which a current may have flowed where the logger paused, or before
SOC_IN_FLIGHT = 0.005  # of which a state of charge that was told in flight may be off
SHAPES = 8  # of what follows: with 4 a bad contact in flight was a cell of another charge besides
MOST_KEPT = 0.9999  # of what follows, likewise
LONG_AGO = 50.0  # times what it takes to forget: a pause begins anew


def unseen(
    pack: Pack, load: Load, noise_A: float = 0.0, *,
    flown: bool = False, soc_std: float = SOC_IN_FLIGHT,
) -> Unseen | None:  # fmt: skip
    """By the twin `pack`; None if nothing is unseen, or the twin is empty at once.

    Args:
        pack: as it began.
        load: as it was recorded.
        noise_A: that of a current of which the likeliest course is taken: what that leaves of slow
            noise draws charge as what flows between samples does.
        flown: the pack may have flown before.
        soc_std: of its state of charge then, which nothing but this lets be off.
    """
    gain = prod(e.gain for e in pack.effects if isinstance(e, CurrentGain))
    pack, load = as_flowed(pack, load)
    off_C = hypot(walk_C(load), gain * noise_A * sqrt(float(np.median(np.diff(load.time_s)))))
    wide = beyond_cut_offs(pack)
    if not off_C:
        return None
    as_is_V = simulate(wide, load).voltage_V
    per_C = per_coulomb(wide, load, as_is_V)
    if per_C.size < AS_LARGE:
        return None
    random, dt = np.random.default_rng(0), np.diff(load.time_s)
    off_by_C = off_C * np.sqrt(dt) * (dt > BRIEF * np.median(dt))
    ways_C = off_by_C * random.standard_normal((CURRENTS, dt.size))

    def quick(drawn_C: FloatArray, done_V: FloatArray) -> FloatArray:
        walked_C, n = np.append(0.0, np.cumsum(drawn_C)), min(done_V.size, per_C.size)
        out = np.zeros(per_C.size)
        out[:n] = done_V[:n] - as_is_V[:n] + walked_C[:n] * per_C[:n]
        return out

    done = simulate_all([(wide, _with_between(load, drawn_C)) for drawn_C in ways_C])
    quick_V = np.array([quick(c, s.voltage_V[::2]) for c, s in zip(ways_C, done, strict=True)])
    squares = np.convolve(np.mean(quick_V**2, axis=0), np.ones(AS_LARGE) / AS_LARGE, mode="same")
    size_V = np.sqrt(np.maximum(squares, np.finfo(float).tiny))
    holes, n = pauses(load), load.time_s.size
    per_C = np.append(per_C, np.full(n - per_C.size, per_C[-1]))
    paused_V, forgets_s = _after(holes, wide, load, as_is_V, per_C)
    walk_s, paused_s = load.time_s - load.time_s[0], load.time_s / forgets_s
    walk_s = walk_s + flown * (soc_std * pack.window_C / off_C) ** 2
    for hole in holes:
        walk_s[hole.after + 1 :] += hole.variance_C2(load) / off_C**2
        paused_s[hole.after + 1 :] += LONG_AGO
    return Unseen(
        walk_V=off_C * per_C,
        walk_s=walk_s,
        quick_V=np.append(size_V, np.full(n - size_V.size, size_V[-1])),
        quick=forgotten(quick_V / size_V, float(np.median(dt))),
        paused_V=paused_V,
        paused_s=paused_s,
        begun_V=_before(wide, load) if flown else np.zeros((n, 0)),
    )


def forgotten(answers: FloatArray, period_s: float) -> tuple[Wander, ...]:
    """Wanders of first order, of variance 1 together, that follow themselves as `answers` do.

    Diffusion forgets as no exponential does: of an LG M50 at 1 Hz half within 10 s, a fifth not
    within 40, and one that has lost as much after a second promises that nothing is left by then.

    Args:
        answers: (ways, n) of variance 1.
        period_s: from sample to sample.
    """
    n = answers.shape[1]
    most = max(n // ENOUGH, 1)
    lags = np.unique(np.append(0, np.geomspace(1, most, LAGS).astype(int)))
    follows = [float(np.mean(answers[:, k:] * answers[:, : n - k])) for k in lags.tolist()]
    forgets = SHORTEST * LONGER ** np.arange(max(log(most / SHORTEST, LONGER), 1))
    shares, _ = nnls(np.exp(-lags[:, None] / forgets), np.array(follows))
    shares = shares / max(shares.sum(), np.finfo(float).tiny)
    return tuple(
        Wander(size_V=sqrt(share), forgets_s=period_s * samples)
        for share, samples in zip(shares.tolist(), forgets.tolist(), strict=True)
        if share > LEAST_SHARE
    )


def _after(
    holes: Sequence[Pause], pack: Pack, load: Load, as_is_V: FloatArray, per_C: FloatArray
) -> tuple[FloatArray, float]:
    """(n,) by what surfaces may answer after pauses [V], and over what time they forget it [s]."""
    n, out = as_is_V.size, np.zeros(load.time_s.size)
    if not holes:
        return out, 1.0
    random = np.random.default_rng(0)
    ways = [filled(load, holes, random) for _ in range(WAYS)]
    done = simulate_all([(pack, way) for way, _ in ways])
    answers_V = np.zeros((WAYS, n))
    for own_V, (way, at), solution in zip(answers_V, ways, done, strict=True):
        m = min(n, int(np.searchsorted(at, solution.voltage_V.size)))
        walked_C = way.drawn_C()[at[:m]] - load.drawn_C()[:m]
        own_V[:m] = solution.voltage_V[at[:m]] - as_is_V[:m] + walked_C * per_C[:m]
    squares = np.mean(answers_V**2, axis=0)
    out[:n] = np.sqrt(squares)
    inside = np.ones(n - 1, dtype=bool)
    inside[[h.after for h in holes if h.after < n - 1]] = False
    both = float(np.sum(np.mean(answers_V[:, 1:] * answers_V[:, :-1], axis=0)[inside]))
    whole = float(np.sum(np.sqrt(squares[1:] * squares[:-1])[inside]))  # 0: empty before a pause
    kept = min(max(both / max(whole, np.finfo(float).tiny), KEPT), MOST_KEPT)
    return out, float(np.median(np.diff(load.time_s))) / -log(kept)


def _before(pack: Pack, load: Load) -> FloatArray:
    """(n, SHAPES) of what surfaces answer to what flowed before, each by as much as it varies [V].

    The principal components of so many ways, about what a pack answers that was at rest.
    """
    random, answers_V = np.random.default_rng(0), np.zeros((0, load.time_s.size))
    least = 0  # samples that a twin goes on for, as it does that is no slower
    for kind in slower(pack):
        for own in kind:
            own_V, lasts = _begun(own, load, random)
            if lasts >= least:
                answers_V, least = np.vstack([answers_V, own_V]), least or lasts
                break
    shapes, sizes, _ = np.linalg.svd(answers_V.T, full_matrices=False)
    return np.asarray((shapes * sizes / sqrt(len(answers_V)))[:, :SHAPES])


def _begun(pack: Pack, load: Load, random: np.random.Generator) -> tuple[FloatArray, int]:
    """(WAYS, n) by how much it answers otherwise than from rest [V], and for how many samples."""
    rested_V = simulate(pack, load).voltage_V
    starts = [preceded(pack, load, random) for _ in range(WAYS)]
    done = simulate_all([(started, whole) for started, whole, _ in starts])
    answers_V = np.zeros((WAYS, load.time_s.size))
    lasts = rested_V.size
    for answer_V, (_, _, more), solution in zip(answers_V, starts, done, strict=True):
        there_V = solution.voltage_V[more:]
        m = min(there_V.size, rested_V.size)
        answer_V[:m] = there_V[:m] - rested_V[:m]
        lasts = min(lasts, m)
    return answers_V, lasts


def walk_C(load: Load) -> float:
    """What the charge drawn is off by after a second, standard deviation [C].

    Taking every other sample only changes the charge of the intervals; from there to every fourth
    it changes again, by more. As much as from a fourth to a half it changes from the half to the
    whole, it does from the whole to the current itself, but no more than from the half (of a
    current that is nothing but noise from sample to sample). Nothing where the steps were
    programmed; where samples are UNEVEN, as much as elsewhere.
    """
    if load.between is Between.HOLD:
        return 0.0
    dt = _in_turn(np.diff(load.time_s), 4)
    even = dt.max(axis=1) <= UNEVEN * dt.min(axis=1)
    if not even.any():
        return 0.0
    whole, half, fourth = (_thinned(load, every) for every in (1, 2, 4))
    nearer_C2 = np.sum(_in_turn(_changed_C(whole, half) ** 2, 2)[: even.size][even])
    further_C2 = np.sum(_changed_C(half, fourth)[: even.size][even] ** 2)
    variance_C2 = nearer_C2 * min(1.0, nearer_C2 / further_C2) if further_C2 > 0 else nearer_C2
    return sqrt(variance_C2 / float(np.sum(dt[even])))


def per_coulomb(pack: Pack, load: Load, as_is_V: FloatArray) -> FloatArray:
    """(m,) [V/C] by how much a voltage (n,) is lower when more charge was drawn before, m <= n."""
    more_C = pack.window_C * (-SOC_STEP if pack.initial_soc < SOC_STEP else SOC_STEP)
    moved_V = simulate(pack.emptier(more_C), load).voltage_V
    n = min(as_is_V.size, moved_V.size)
    return np.asarray((as_is_V[:n] - moved_V[:n]) / more_C)


def _with_between(load: Load, drawn_C: FloatArray) -> Load:
    """The same at its samples, with so much more drawn between them."""
    dt = np.diff(load.time_s)
    time_s, current_A = (np.zeros(2 * load.time_s.size - 1) for _ in range(2))
    time_s[::2], current_A[::2] = load.time_s, load.current_A
    time_s[1::2] = load.time_s[:-1] + dt / 2
    current_A[1::2] = (load.current_A[:-1] + load.current_A[1:]) / 2 + 2 * drawn_C / dt
    return replace(load, time_s=time_s, current_A=current_A)


def _thinned(load: Load, every: int) -> Load:
    return replace(load, time_s=load.time_s[::every], current_A=load.current_A[::every])


def _changed_C(load: Load, thinner: Load) -> FloatArray:
    """(m,) what the intervals of every other sample draw otherwise."""
    return np.diff(load.drawn_C()[::2] - thinner.drawn_C())


def _in_turn(values: FloatArray, size: int) -> FloatArray:
    """(n // size, size) of (n,), so many in each row."""
    return values[: values.size // size * size].reshape(-1, size)
