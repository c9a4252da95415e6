"""Recordings, and a twin with some hypotheses in it: whitened residuals and their derivatives.

Coordinates q are standard deviations of the prior from its centre: those of the hypotheses, then
the start of each recording (its state of charge is never known exactly), so that a wrong start
cannot pose as physics, nor physics be eaten by more than the start's tolerance.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from os import cpu_count
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from twin.mismatch.bagged import stretches
from twin.mismatch.channels import Whitening, channels
from twin.mismatch.flight import Flight
from twin.mismatch.hypothesis import Hypothesis, coordinate_of, value_of
from twin.mismatch.left import beyond_cut_offs, left_V
from twin.mismatch.noise import Whitener
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

A = TypeVar("A")
B = TypeVar("B")

START_SOC = 0.002
"""Tolerance of the state of charge at the start, standard deviation."""
DIFFERENCE = 1e-4
"""Of coordinates, forward. A simulation is smooth in its numbers: one step a sample, Newton to
rounding; derivatives agree with the exact ones of `sensitivity.py` to 1e-3 (test). Measurement
faults change the load, for which those have none, and no hypothesis waits for a compiler."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Whitened residuals of some recordings at a point, and their derivative there.

    Attributes:
        residuals: (m,) unit variance if nothing is left out.
        slopes: (m, k) their derivative by the coordinates.
        rms_V: recorded minus simulated there, samples that count.
    """

    residuals: FloatArray
    slopes: FloatArray
    rms_V: float


class Problem:
    """`hypotheses` in all `flights` at once.

    Attributes:
        flights: the recordings.
        hypotheses: what is in the twin beyond what it is configured to have.
    """

    def __init__(
        self, data: Sequence[tuple[Flight, Whitener]], hypotheses: Sequence[Hypothesis]
    ) -> None:
        self.flights, self.hypotheses = tuple(f for f, _ in data), tuple(hypotheses)
        self._whiteners = tuple(w for _, w in data)
        self._channels = tuple(channels(f) for f in self.flights)
        packs = [beyond_cut_offs(f.pack) for f in self.flights]
        self._packs, pack = tuple(packs), packs[0]
        self._kept: dict[bytes, Evidence] = {}
        self._terms = [
            (p, limits)
            for h in hypotheses
            for p, limits in zip(h.priors(pack), h.bounds(pack), strict=True)
        ]

    def beside(self, more: Sequence[Hypothesis], q: FloatArray) -> tuple["Problem", FloatArray]:
        """With more hypotheses at the centre of their priors, and q (k,) there."""
        data = tuple(zip(self.flights, self._whiteners, strict=True))
        wider = Problem(data, [*self.hypotheses, *more])
        return wider, np.insert(q, len(self._terms), np.zeros(wider.size - self.size))

    @property
    def size(self) -> int:
        """Coordinates."""
        return len(self._terms) + len(self.flights)

    @property
    def own_V(self) -> float:
        """The twin's own error, as it is taken to be in the recordings."""
        return max((w.noise.own_V for w in self._whiteners), default=0.0)

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) least and largest coordinates."""
        ends = [tuple(coordinate_of(p, v) for v in limits) for p, limits in self._terms]
        ends += [
            (-p.initial_soc / START_SOC, (1.0 - p.initial_soc) / START_SOC) for p in self._packs
        ]
        low, high = zip(*ends, strict=True)
        return np.array(low), np.array(high)

    def starts(self) -> list[FloatArray]:
        """Points a fit may begin at."""
        return self._points([h.begins(self._packs[0]) for h in self.hypotheses])

    def starts_from(self, known: Mapping[str, Mapping[str, float]]) -> list[FloatArray]:
        """The same with the `known` numbers of some hypotheses instead of their own starts."""
        ways = [
            (tuple(known[h.id][name] for name in h.fitted),)
            if h.id in known
            else h.begins(self._packs[0])
            for h in self.hypotheses
        ]
        return self._points(ways)

    def _points(self, ways: Sequence[tuple[tuple[float, ...], ...]]) -> list[FloatArray]:
        """Every way of each hypothesis with every way of the others."""
        points: list[tuple[float, ...]] = [()]
        for own in ways:
            points = [(*a, *b) for a in points for b in own]
        return [
            np.array(
                [coordinate_of(p, v) for (p, _), v in zip(self._terms, point, strict=True)]
                + [0.0] * len(self.flights)
            )
            for point in points
        ]

    def values(self, q: FloatArray) -> dict[str, dict[str, float]]:
        """Hypothesis -> number -> value."""
        given = iter(self._values(q))
        return {h.id: {name: next(given) for name in h.fitted} for h in self.hypotheses}

    def stds(self, q: FloatArray, of_q: FloatArray) -> dict[str, dict[str, float]]:
        """The same of standard deviations (k,) of the coordinates."""
        scale = [
            p.prior_std * (value_of(p, x) if p.logarithmic else 1.0)
            for (p, _), x in zip(self._terms, q.tolist(), strict=False)
        ]
        given = iter(s * e for s, e in zip(scale, of_q.tolist(), strict=False))
        return {h.id: {name: next(given) for name in h.fitted} for h in self.hypotheses}

    def told(self, of_q: FloatArray, share: float) -> dict[str, tuple[str, ...]]:
        """Numbers whose deviation is below that share of the prior's; all of one without any."""
        given = iter(of_q.tolist())
        near = {h.id: {name: next(given) < share for name in h.fitted} for h in self.hypotheses}
        return {
            name: tuple(k for k, is_told in own.items() if is_told or not any(own.values()))
            for name, own in near.items()
        }

    def pack(self, q: FloatArray, flight: int) -> Pack:
        """The twin of one recording; ValueError if no cell has these values."""
        pack, given = self._packs[flight], iter(self._values(q))
        for h in self.hypotheses:
            pack = h.within(pack, [next(given) for _ in h.fitted])
        start = pack.initial_soc + START_SOC * float(q[len(self._terms) + flight])
        return replace(pack, initial_soc=min(max(start, 0.0), 1.0))

    def residual_V(self, q: FloatArray, flight: int) -> FloatArray:
        """(n,) recorded minus simulated, see `left_V`."""
        return self._residuals(q, flight)[0]

    def _residuals(self, q: FloatArray, flight: int) -> list[FloatArray]:
        """(n,) of the voltage, and of each channel beyond it."""
        own, pack = self.flights[flight], self._packs[flight]
        solution: Solution | None
        try:
            solution = simulate(self.pack(q, flight), own.load)
        except ValueError:
            solution = None
        return [
            left_V(own, pack, solution),
            *(c.residual(solution) for c in self._channels[flight]),
        ]

    def _whiten(self, flight: int) -> list[Whitener | Whitening]:
        """In the order of `_residuals`."""
        return [self._whiteners[flight], *(c.whiten for c in self._channels[flight])]

    def judged(self, flight: int) -> npt.NDArray[np.int64]:
        """(j,) which samples count."""
        return self._whiteners[flight].at

    @property
    def heavy_tailed(self) -> bool:
        """An error of the twin is stated, see `Noise`."""
        return any(w.noise.heavy_tailed for w in self._whiteners)

    def stretches(self) -> tuple[npt.NDArray[np.int64], ...]:
        """(m,) of each recording: where its residuals are, see `bagged.stretches`."""
        return tuple(
            stretches(
                np.concatenate([flight.time_s[w.samples] for w in self._whiten(k)]),
                self._whiteners[k].noise.slow_s,
            )
            for k, flight in enumerate(self.flights)
        )

    def rms_V(self, q: FloatArray) -> float:
        """Recorded minus simulated, samples that count."""
        return self._rms_V(parallel(lambda k: self.residual_V(q, k), range(len(self.flights))))

    def _rms_V(self, residuals_V: Sequence[FloatArray]) -> float:
        """Of all samples that count, one (n,) a recording."""
        counted = [r[self.judged(k)] for k, r in enumerate(residuals_V)]
        return float(np.sqrt(np.mean(np.concatenate(counted) ** 2)))

    def whitened(self, q: FloatArray, flight: int) -> FloatArray:
        """(m,) of one recording."""
        both = zip(self._whiten(flight), self._residuals(q, flight), strict=True)
        return np.concatenate([whiten(r[:, None])[:, 0] for whiten, r in both])

    def evidence(self, q: FloatArray) -> Evidence:
        """Of all recordings; kept, since fits begin where effects were looked at and end there."""
        key = q.tobytes()
        if key not in self._kept:
            self._kept[key] = self._evidence(q)
        return self._kept[key]

    def _evidence(self, q: FloatArray) -> Evidence:
        high = self.bounds[1]
        jobs = [
            (flight, column)
            for flight in range(len(self.flights))
            for column in [-1, *self._columns(flight)]
        ]

        def at(job: tuple[int, int]) -> list[FloatArray]:
            flight, column = job
            return self._residuals(_moved(q, column, high) if column >= 0 else q, flight)

        done = dict(zip(jobs, parallel(at, jobs), strict=True))
        rows, slopes = [], []
        for flight in range(len(self.flights)):
            own = list(self._columns(flight))
            steps = np.array([_moved(q, c, high)[c] - q[c] for c in own])
            for k, whiten in enumerate(self._whiten(flight)):
                here = done[flight, -1][k]
                changes = np.column_stack([done[flight, c][k] - here for c in own]) / steps
                white = whiten(np.column_stack([here, changes]))
                whole = np.zeros((white.shape[0], q.size))
                whole[:, own] = white[:, 1:]
                rows.append(white[:, 0])
                slopes.append(whole)
        rms_V = self._rms_V([done[flight, -1][0] for flight in range(len(self.flights))])
        return Evidence(np.concatenate(rows), np.vstack(slopes), rms_V)

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals, those of the prior included, and their derivative."""
        e = self.evidence(q)
        return np.concatenate([e.residuals, -q]), np.vstack([e.slopes, -np.eye(q.size)])

    def cost(self, q: FloatArray) -> float:
        """Half the sum of squares."""
        parts = parallel(lambda k: self.whitened(q, k), range(len(self.flights)))
        return 0.5 * float(sum(p @ p for p in parts) + q @ q)

    def _values(self, q: FloatArray) -> list[float]:
        return [
            min(max(value_of(p, x), limits[0]), limits[1])
            for (p, limits), x in zip(self._terms, q.tolist(), strict=False)
        ]

    def _columns(self, flight: int) -> list[int]:
        return [*range(len(self._terms)), len(self._terms) + flight]


def parallel(work: Callable[[A], B], items: Sequence[A]) -> list[B]:
    """As `map`, in as many threads as there are processors: the compiled kernel frees the lock."""
    if len(items) == 1:
        return [work(items[0])]
    with ThreadPoolExecutor(cpu_count() or 1) as pool:
        return list(pool.map(work, items))


def _moved(q: FloatArray, column: int, high: FloatArray) -> FloatArray:
    """A little along one coordinate, away from its upper bound."""
    out = q.copy()
    out[column] += DIFFERENCE if q[column] + DIFFERENCE <= high[column] else -DIFFERENCE
    return out
