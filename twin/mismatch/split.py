"""What is fitted and what is judged: whole recordings if there are several, else blocks of one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from twin.effects import ClockShift, SensorLag
from twin.mismatch.coloured import smooth_noise
from twin.mismatch.fit import Data, Fitted
from twin.mismatch.flight import BoolArray, Flight, FloatArray, MismatchError
from twin.mismatch.idle import idle_ways
from twin.mismatch.left import left_V, never_full
from twin.mismatch.noise import Noise, Whitener, whitener
from twin.mismatch.problem import Problem
from twin.mismatch.quiet import answers_ohm, quieted
from twin.mismatch.stated import loss_ways
from twin.mismatch.unseen import SOC_IN_FLIGHT, unseen
from twin.mismatch.wander import Wander
from twin.mismatch.white import (
    LEAST_V,
    SURE,
    agreed_V,
    current_noise,
    step_V,
    white_V,
    with_steps_V,
)
from twin.pack import Pack
from twin.simulate import simulate

SLOW_V, SLOW_S = 3e-4, 20.0
"""A cell: error of the twin against converged solutions (tests/reference), and its memory."""
ALONG_V, ALL_ALONG_S = 2e-4, 1e5
"""A cell: what of that and of another solver's follows the current, and does not forget. 22 flights
of nine LiPo packs by one with 12 points a layer were 0.06 to 0.18 mV a cell off, rms: a resistance
that dropped 0.09 to 0.22 mV, an offset that stayed, and 0.02 to 0.05 mV else."""
STATED_S = 200.0
"""Over which the stated error of a calibrated twin forgets. It is one of equilibria and losses that
follow the charge: in slow discharges of two cells it fell to 1/e in 195 to 1080 s; the shortest."""
SLOW = 0.5
"""Of its squares, the share of that. The rest are losses, most of them off all along (`stated`)."""
ALONG, ALONG_S = 0.25, 5.0
"""Of its squares, the share that follows the current and forgets within seconds. In drive cycles of
two cells 0.2 to 0.4 of the squares changed within 20 s, in steady discharges 0.02 to 0.04."""
TOGETHER_S = 1.0
"""Where an error of the twin is stated, samples over so long count as their mean. Levels tell
little then and changes from sample to sample nearly all, and these are for a good part the noise of
the recorded current: a twin that answers to it less, a colder one with its Tafel kinetics, would
look better. Of a pack 8 K too cold at 10 Hz, nothing else, 20 mV stated: -8.5 to -9.1 K and 17 to
39 mV left held out by samples, -8.1 to -8.2 K and 4 to 6 mV by means."""
BLOCKS = 7
"""Of a single recording, every second one held out. An odd number: what shows as a battery empties,
as a weak cell does, is in the last block alone, and no fit knows of it where that is held out."""
GAP_S = 5.0  # between blocks, longer than what is remembered in the fast part of a residual
FEW_BEYOND = 0.05  # of the samples
ALONE = (6.0, 3.0)  # deviations: of a sample more, of its neighbours less
ALSO_SURE = 9.0
"""Of what chance makes of noise of a current, as `white.SURE`, where another recording of the same
pack has such noise: it is the same sensor's."""
SHARPER = 0.9  # of the noise that was thought, or its inverse
LEAST_SAMPLES = 40  # half a minute of a voltage that is measured every 0.8 s has so many
LEAST_OF_A_PART = 5  # of a single recording: what is fitted of it, and what is held out
LEAST_S = 15.0

Recorded = tuple[tuple[Flight, Whitener], ...]


def split(
    fitted: Sequence[Flight], held_out: Sequence[Flight], *, slow_V: float | None = None
) -> Data:
    """The recordings with what is noise in them.

    Without `held_out` the last of several is held out; of a single one every second block. `slow_V`
    is the twin's own error of a pack, by tests it was not fitted to; None takes that of its
    numerics.

    Raises:
        MismatchError: too little to judge.
    """
    if not fitted:
        raise MismatchError("no recording to explain")
    for flight in (*fitted, *held_out):
        check(flight)
    if not held_out and len(fitted) > 1:
        fitted, held_out = fitted[:-1], fitted[-1:]
    if held_out:
        seen = [(f, own_whitener(f, noise)) for f, noise in _all_seen((*fitted, *held_out), slow_V)]
        return Data(tuple(seen[: len(fitted)]), tuple(seen[len(fitted) :]))
    whole, noise = as_seen(fitted[0], slow_V)
    own, ahead = (((part, own_whitener(part, noise)),) for part in _blocks(whole))
    return Data(own, ahead)


def check(flight: Flight) -> None:
    """MismatchError if there is too little in a recording to judge anything."""
    count = int(np.count_nonzero(flight.judged))
    if count < LEAST_SAMPLES:
        raise MismatchError(
            f"{flight.name}: {count} samples with current and voltage in flight, "
            f"expected {LEAST_SAMPLES} or more: give a longer recording"
        )
    judged_s = flight.time_s[flight.judged]
    if judged_s[-1] - judged_s[0] < LEAST_S:
        raise MismatchError(
            f"{flight.name}: {judged_s[-1] - judged_s[0]:.0f} s of flight, expected "
            f"{LEAST_S:.0f} s or more: give a longer recording"
        )


def _all_seen(flights: Sequence[Flight], slow_V: float | None) -> Sequence[tuple[Flight, Noise]]:
    """Recordings of one pack, `as_seen`; where one has noise in its current, others likely too.

    That of their voltage is one, if they agree.
    """
    seen = [as_seen(f, slow_V) for f in flights]
    if any(noise.current_A for _, noise in seen):
        seen = [
            own if own[1].current_A else as_seen(f, slow_V, sure=ALSO_SURE)
            for f, own in zip(flights, seen, strict=True)
        ]
    return _agreed(seen)


def _agreed(seen: Sequence[tuple[Flight, Noise]]) -> list[tuple[Flight, Noise]]:
    """With the white noise that they have together, see `agreed_V`."""
    whites_V = agreed_V(
        [noise.white_V for _, noise in seen], [int(f.judged.sum()) for f, _ in seen]
    )
    return [(f, replace(n, white_V=own)) for (f, n), own in zip(seen, whites_V, strict=True)]


def as_seen(flight: Flight, slow_V: float | None, *, sure: float = SURE) -> tuple[Flight, Noise]:
    """A recording with the likeliest current, and what is chance in it, by the twin as configured.

    If that is empty within the first half, by the voltage alone from there on.
    """
    residual_V, told = _by_the_twin(flight)
    expected = _expected(flight.pack.series, slow_V)
    told, noise = _quieted(told, expected, never_full(flight.pack), residual_V, sure)
    if noise.current_A:
        flight = replace(told, judged=flight.judged)
        residual_V, told = _by_the_twin(flight)
    return flight, replace(noise, white_V=_white_V(told, noise, residual_V) or LEAST_V)


def _expected(series: int, slow_V: float | None) -> Noise:
    """Of any recording: the error of the twin, that of its numerics where none is stated."""
    if slow_V is None:
        return Noise(
            white_V=LEAST_V,
            slow_V=SLOW_V * series,
            slow_s=SLOW_S,
            along_V=ALONG_V * series,
            along_s=ALL_ALONG_S,
        )
    return Noise(
        white_V=LEAST_V,
        slow_V=slow_V * sqrt(SLOW),
        slow_s=STATED_S,
        along_V=slow_V * sqrt(ALONG),
        along_s=ALONG_S,
        losses_V=slow_V * sqrt(1 - SLOW - ALONG),
        heavy_tailed=True,
        together_s=TOGETHER_S,
    )


def _by_the_twin(flight: Flight) -> tuple[FloatArray, Flight]:
    """(n,) residuals, and the recording with what counts where they tell its noise."""
    simulated_V = simulate(never_full(flight.pack), flight.load).voltage_V
    n = simulated_V.size
    residual_V = np.append(flight.voltage_V[:n] - simulated_V, flight.voltage_V[n:])
    before = np.arange(residual_V.size) < n
    half = np.count_nonzero(flight.judged) / 2
    longer = before if np.count_nonzero(flight.judged[:n]) >= half else ~before
    return residual_V, replace(flight, judged=flight.judged & longer)


def own_whitener(flight: Flight, noise: Noise, pack: Pack | None = None) -> Whitener:
    """`pack`: the twin that says how a voltage moves with what is not known; that as configured."""
    own = flight.recorded_load
    between = unseen(
        pack or flight.pack, own, noise.current_A,
        flown=noise.flown, soc_std=0.0 if flight.start_open else SOC_IN_FLIGHT,
    )  # fmt: skip
    if between is not None and flight.recorded is not None:
        between = between.at(flight.time_s, own.time_s)
    ways_V = [idle_ways(pack or flight.pack, flight)]
    if noise.losses_V:
        ways_V.append(loss_ways(pack or flight.pack, flight, noise.losses_V))
    return whitener(
        flight.time_s, flight.judged, noise, flight.load.current_A, between, np.hstack(ways_V)
    )


def sharpened(data: Data, best: Fitted, *, stated: bool = True) -> Data | None:
    """With the noise by what `best` leaves; None if that is hardly another than it was.

    What follows the current in a way that the twin as configured has not looks like noise at first,
    and conceals what the noise of the current does. Some samples do not count, if they are few:
    those at an end where a clock of that twin is off and nothing says what flowed; and unless an
    error of the twin is `stated`, those at which a cell of it is beyond its cut-off (a volt is lost
    there within seconds, and a thousandth of the charge decides when), and those that stand alone.
    """

    def of(problem: Problem, q: FloatArray, own: Recorded, sure: float) -> Iterator[_Left]:
        for k, (flight, w) in enumerate(own):
            left = problem.residual_V(q, k)
            pack, none = problem.pack(q, k), np.zeros_like(flight.judged)
            unheard = _few(_unheard(pack, flight.time_s), flight)
            empty = none if stated else _few(problem.beyond(q, k) & ~unheard, flight)
            far = none if stated else _few(_standing_alone(w, left) & ~(empty | unheard), flight)
            kept = replace(flight, judged=flight.judged & ~(empty | far | unheard))
            told = _by_what_is_left(kept, w.noise, pack, left, sure)
            counts = int(empty.sum()), int(far.sum()), int(unheard.sum())
            yield replace(told, beyond=counts[0], alone=counts[1], unheard=counts[2])

    def all_of(sure: float) -> Data:
        left = [
            *of(best.problem, best.q, data.fitted, sure),
            *of(best.judge, best.ahead_q, data.held_out, sure),
        ]
        agreed = _agreed([(own.flight, own.noise) for own in left])
        seen = [own.whitened(noise) for own, (_, noise) in zip(left, agreed, strict=True)]
        return Data(
            fitted=tuple(seen[: len(data.fitted)]),
            held_out=tuple(seen[len(data.fitted) :]),
            beyond=sum(own.beyond for own in left),
            alone=sum(own.alone for own in left),
            unheard=sum(own.unheard for own in left),
            near=best.problem.values(best.q),
        )

    finer = all_of(ALSO_SURE if _noisy(data) else SURE)
    if _noisy(finer) and not _noisy(data):
        finer = all_of(ALSO_SURE)
    known_V, told_V = (
        np.array([w.noise.by_chance_V for _, w in (*own.fitted, *own.held_out)])
        for own in (data, finer)
    )
    alike = bool(np.all(np.abs(np.log(told_V / known_V)) < -np.log(SHARPER)))
    smooth = any(w.noise.smooth for _, w in (*finer.fitted, *finer.held_out))
    more = _noisy(finer) or smooth or finer.beyond + finer.alone + finer.unheard > 0
    return None if alike and not more else finer


def _noisy(data: Data) -> bool:
    """Of one recording at least the current has noise."""
    return any(w.noise.current_A for _, w in (*data.fitted, *data.held_out))


def counted(data: Data) -> int:
    """Samples that count, of all recordings."""
    return sum(int(f.judged.sum()) for f, _ in (*data.fitted, *data.held_out))


def _few(some: BoolArray, flight: Flight) -> BoolArray:
    """Those that count, none if they are no few."""
    own = flight.judged & some
    few = np.count_nonzero(own) <= FEW_BEYOND * np.count_nonzero(flight.judged)
    return own if few else np.zeros_like(own)


def _unheard(pack: Pack, time_s: FloatArray) -> BoolArray:
    """(n,) samples of which the current would have been recorded before the first, or later."""
    then_s = time_s + sum(e.shift_s for e in pack.effects if isinstance(e, ClockShift))
    return np.asarray((then_s < time_s[0]) | (then_s > time_s[-1]))


def _standing_alone(whiten: Whitener, residual_V: FloatArray) -> BoolArray:
    """(n,) samples far from what those before tell, unlike their neighbours."""
    size = np.abs(whiten(residual_V[:, None])[:, 0])
    out = np.zeros(residual_V.size, dtype=bool)
    if size.size:
        beside = np.maximum(np.append(size[1:], 0.0), np.append(0.0, size[:-1]))
        out[whiten.at] = (size > ALONE[0]) & (beside < ALONE[1])
    return out


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Left:
    """A recording, its noise, and the twin `pack` that left so much of it.

    Attributes:
        residual_V: (n,) recorded minus simulated.
        beyond: samples that do not count, since a cell is beyond its cut-off there,
        alone: since they stand alone,
        unheard: and since a clock is off, so that nothing tells their current.
    """

    flight: Flight
    noise: Noise
    pack: Pack
    residual_V: FloatArray
    beyond: int = 0
    alone: int = 0
    unheard: int = 0

    def whitened(self, noise: Noise) -> tuple[Flight, Whitener]:
        """With this noise, and its colour."""
        coloured = _coloured(self.flight, noise, self.residual_V)
        return self.flight, own_whitener(self.flight, coloured, self.pack)


def _by_what_is_left(
    flight: Flight, noise: Noise, pack: Pack, residual_V: FloatArray, sure: float
) -> _Left:
    """With its noise as told by what the twin `pack` leaves, if that is less."""
    flight, own = _quieted(flight, noise, pack, residual_V, sure)
    if own is not noise:
        residual_V = left_V(flight, pack, simulate(pack, flight.load))
    elif own.left:
        own = own.through(answers_ohm(pack, flight, own.left))
    white = _white_V(flight, own, residual_V)
    if white is not None:
        own = replace(own, white_V=min(white, noise.white_V))
    return _Left(flight=flight, noise=own, pack=pack, residual_V=residual_V)


def _coloured(flight: Flight, noise: Noise, residual_V: FloatArray) -> Noise:
    """With its colour; none where an error is stated."""
    at = flight.judged
    if noise.heavy_tailed or np.count_nonzero(at) < LEAST_SAMPLES:
        return noise
    period_s = float(np.median(np.diff(flight.time_s[at])))
    told = smooth_noise(residual_V[at], flight.load.current_A[at], period_s, noise.left)
    return replace(noise, white_V=told[0], smooth=told[1]) if told else noise


def _quieted(
    flight: Flight, noise: Noise, pack: Pack, residual_V: FloatArray, sure: float
) -> tuple[Flight, Noise]:
    """With the likeliest current, if the samples that count are sure that there is noise in it.

    By what the twin `pack` leaves; or if the sensor is stated to be slow, by what is stated.
    """
    at = flight.judged
    own_V = residual_V[at]
    told = current_noise(own_V, flight.voltage_V[at] - own_V, flight.load.current_A[at], sure)
    noise_A = told.size_A if told else _stated_A(flight.pack)
    if not noise_A or noise.current_A:  # once
        return flight, noise
    out, found = quieted(flight, noise_A)
    left = Wander(size_V=found.left_A, forgets_s=found.left_s, damping=found.damping)
    ohm = answers_ohm(pack, out, left)
    own = replace(left, size_V=ohm * found.left_A)
    return out, replace(noise, current_A=noise_A, ohm=ohm, left=own)


def _stated_A(pack: Pack) -> float:
    """Noise of a current whose sensor is stated to be slow, 0 of any other.

    A lag undone makes it many times as much, and no answer of the voltage to it looks like noise.
    """
    return max((e.noise_A for e in pack.effects if isinstance(e, SensorLag)), default=0.0)


def _white_V(flight: Flight, noise: Noise, residual_V: FloatArray) -> float | None:
    """By the samples that count, beside what the likeliest current is off by; None of too few."""
    counted = flight.judged
    dt = np.diff(flight.time_s[counted])
    period_s = float(np.median(dt)) if dt.size else 1.0
    white = white_V(residual_V[counted], flight.load.current_A[counted], period_s, left=noise.left)
    return None if white is None else with_steps_V(white, step_V(flight.voltage_V))


def _blocks(flight: Flight) -> tuple[Flight, Flight]:
    """What is fitted and what is held out: blocks in turn, GAP_S between them in neither."""
    t = flight.time_s
    judged_s = t[flight.judged]
    start_s, length_s = judged_s[0], (judged_s[-1] - judged_s[0]) / BLOCKS
    number = np.clip((t - start_s) // length_s, 0, BLOCKS - 1)
    inside = (t - start_s) - number * length_s >= min(GAP_S, length_s / 3) * (number > 0)
    fitted, held_out = (flight.judged & inside & (number % 2 == place) for place in range(2))
    if (least := min(map(np.count_nonzero, (fitted, held_out)))) < LEAST_OF_A_PART:
        raise MismatchError(
            f"{flight.name}: of its {BLOCKS} parts, fitted and held out in turn, one side has "
            f"{least} samples, expected {LEAST_OF_A_PART} or more: give a recording without such "
            "gaps, or another one to hold out"
        )
    return replace(flight, judged=fitted), replace(flight, judged=held_out)
