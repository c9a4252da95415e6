"""Recordings, and a twin with some hypotheses in it: whitened residuals and their derivatives.

Coordinates q are standard deviations of the prior from its centre, independent of each other
(`Hypothesis.mixes`): those of the hypotheses, then the start of each recording (its state of charge
is never known exactly), so that a wrong start cannot pose as physics, nor physics be eaten by more
than the start's tolerance.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from twin.at_rest import OVERFULL
from twin.kernel import Backend
from twin.lanes import LANES
from twin.mismatch.bagged import stretches
from twin.mismatch.channels import Whitening, channels
from twin.mismatch.flight import Flight
from twin.mismatch.hypothesis import Hypothesis, coordinate_of, value_of
from twin.mismatch.left import beyond_cut_offs, left_V
from twin.mismatch.noise import Whitener
from twin.pack import Pack
from twin.simulate import Run, run_all, solution_of
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]

AT_ONCE = LANES * (os.cpu_count() or 1)
"""Simulations whose whole responses are held."""
DIFFERENCE = 1e-4
"""Of coordinates, forward. A simulation is smooth in its numbers: one step a sample, Newton to
rounding; derivatives agree with the exact ones of `sensitivity.py` to 1e-3 (test). Measurement
faults change the load, for which those have none, and no hypothesis waits for a compiler."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """Whitened residuals of some recordings at a point, and their derivative there.

    Attributes:
        residuals: (m,) unit variance if nothing is left out.
        slopes: (m, k) their derivative by the coordinates.
        left_V: (s,) recorded minus simulated there, samples that count; without what flowed before.
        by_start_V: (s, flights) derivative of that by the coordinate of each start.
    """

    residuals: FloatArray
    slopes: FloatArray
    left_V: FloatArray
    by_start_V: FloatArray

    @property
    def rms_V(self) -> float:
        """Of `left_V`."""
        return rms(self.left_V)


class Problem:
    """`hypotheses` in all `flights` at once.

    Attributes:
        flights: the recordings.
        hypotheses: what is in the twin beyond what it is configured to have.
    """

    def __init__(
        self, data: Sequence[tuple[Flight, Whitener]], hypotheses: Sequence[Hypothesis]
    ) -> None:
        self.hypotheses, no_rest = tuple(hypotheses), any(h.no_rest for h in hypotheses)
        self.flights = tuple(f.beside(no_rest=no_rest) for f, _ in data)
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
        self._mixes = block_diag(np.zeros((0, 0)), *(h.mixes for h in hypotheses))

    def beside(self, more: Sequence[Hypothesis], q: FloatArray) -> tuple["Problem", FloatArray]:
        """With more hypotheses at the centre of their priors, and q (k,) there: the same starts."""
        wider = self._with([*self.hypotheses, *more])
        return wider, np.insert(q, len(self._terms), np.zeros(wider.size - self.size))

    def without(self, place: int, q: FloatArray) -> tuple["Problem", FloatArray]:
        """Without one of the hypotheses, and q (k,) of the others: the same starts."""
        before, own = self.hypotheses[:place], self.hypotheses[place]
        first = sum(len(h.fitted) for h in before)
        rest = self._with([*before, *self.hypotheses[place + 1 :]])
        return rest, np.delete(q, range(first, first + len(own.fitted)))

    def _with(self, hypotheses: Sequence[Hypothesis]) -> "Problem":
        """Starts as well known as here."""
        other = Problem(tuple(zip(self.flights, self._whiteners, strict=True)), hypotheses)
        other.flights = self.flights
        return other

    @property
    def size(self) -> int:
        """Coordinates."""
        return len(self._terms) + len(self.flights)

    @property
    def own_V(self) -> float:
        """The twin's own error, as it is taken to be in the recordings."""
        return max((w.noise.own_V for w in self._whiteners), default=0.0)

    @property
    def noise_V(self) -> float:
        """Noise of a sample, by voltage and current, rms over the recordings."""
        return float(np.sqrt(np.mean([w.noise.by_chance_V**2 for w in self._whiteners])))

    @property
    def lasting_V(self) -> float:
        """The same of noise whose means over many samples vary as those of this do."""
        both = zip(self.flights, self._whiteners, strict=True)
        own = [(w.noise, np.diff(f.time_s[w.at])) for f, w in both]
        sizes = [noise.lasting_V(float(np.median(dt)) if dt.size else 1.0) for noise, dt in own]
        return float(np.sqrt(np.mean(np.square(sizes))))

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) least and largest coordinates; where numbers depend on each other, no less wide."""
        own = np.diag(self._mixes).tolist()
        both = zip(self._terms, own, strict=True)
        ends = [tuple(coordinate_of(p, v) / d for v in limits) for (p, limits), d in both]
        ends += [
            (-p.initial_soc / f.start_std, (_fullest(p) - p.initial_soc) / f.start_std)
            for p, f in zip(self._packs, self.flights, strict=True)
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
        mixed = [
            [coordinate_of(p, v) for (p, _), v in zip(self._terms, point, strict=True)]
            for point in points
        ]
        return [
            np.append(np.linalg.solve(self._mixes, x), np.zeros(len(self.flights))) for x in mixed
        ]

    def values(self, q: FloatArray) -> dict[str, dict[str, float]]:
        """Hypothesis -> number -> value."""
        given = iter(self._values(q))
        return {h.id: {name: next(given) for name in h.fitted} for h in self.hypotheses}

    def stds(self, q: FloatArray, covariance: FloatArray) -> dict[str, dict[str, float]]:
        """Standard deviations of the same, by the covariance (k, k) of the coordinates."""
        n = len(self._terms)
        own = np.sqrt(np.diag(self._mixes @ covariance[:n, :n] @ self._mixes.T))
        scale = [
            p.prior_std * (value_of(p, x) if p.logarithmic else 1.0)
            for (p, _), x in zip(self._terms, self._mixed(q), strict=True)
        ]
        given = iter(s * e for s, e in zip(scale, own.tolist(), strict=True))
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
        moved = self.flights[flight].start_std * float(q[len(self._terms) + flight])
        start = pack.initial_soc + moved
        return replace(pack, initial_soc=min(max(start, 0.0), _fullest(pack)))

    def residual_V(self, q: FloatArray, flight: int) -> FloatArray:
        """(n,) recorded minus simulated, see `left_V`."""
        return self._residuals([(q, flight)])[0][0]

    def beyond(self, q: FloatArray, flight: int) -> npt.NDArray[np.bool_]:
        """(n,) where a cell of the twin is emptier than its cut-off allows."""
        least_V = self.flights[flight].pack.cell.lower_cut_off_V
        out = np.zeros(self.flights[flight].time_s.size, dtype=bool)
        (solution,) = self._simulated([(q, flight)])
        if solution is not None:
            out[: solution.voltage_V.size] = (solution.cell_voltage_V < least_V).any(axis=0)
            out[solution.voltage_V.size :] = solution.status is Status.LOWER_CUT_OFF
        return out

    def _residuals(self, asked: Sequence[tuple[FloatArray, int]]) -> list[list[FloatArray]]:
        """Of coordinates and a recording each: (n,) of the voltage, and of each channel."""
        parts = [asked[k : k + AT_ONCE] for k in range(0, len(asked), AT_ONCE)]
        return [
            [
                left_V(self.flights[flight], self._packs[flight], solution),
                *(c.residual(solution) for c in self._channels[flight]),
            ]
            for part in parts
            for (_, flight), solution in zip(part, self._simulated(part), strict=True)
        ]

    def _simulated(self, asked: Sequence[tuple[FloatArray, int]]) -> list[Solution | None]:
        """None where no cell has these values."""
        runs = [self._run(q, flight) for q, flight in asked]
        run_all(run for run in runs if run)
        both = zip(runs, asked, strict=True)
        return [solution_of(r, r.pack, self.flights[k].load) if r else None for r, (_, k) in both]

    def _run(self, q: FloatArray, flight: int) -> Run | None:
        try:
            load = self.flights[flight].load
            return Run(self.pack(q, flight), load, None, Backend.AUTO, None)
        except ValueError:
            return None

    @property
    def _whiten(self) -> list[list[Whitener | Whitening]]:
        """Of each recording, in the order of `_residuals`."""
        both = zip(self._whiteners, self._channels, strict=True)
        return [[own, *(c.whiten for c in more)] for own, more in both]

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
                np.concatenate([flight.time_s[w.samples] for w in self._whiten[k]]),
                self._whiteners[k].noise.slow_s,
            )
            for k, flight in enumerate(self.flights)
        )

    def rms_V(self, q: FloatArray) -> float:
        """Recorded minus simulated, samples that count; without what flowed before."""
        both = zip(self._whiteners, self._residuals(self._each([q])), strict=True)
        return rms(np.concatenate([whiten.settled(own[0]) for whiten, own in both]))

    def whitened(self, points: Sequence[FloatArray]) -> list[list[FloatArray]]:
        """(m,) of each recording, at each of the coordinates."""
        done = iter(self._residuals(self._each(points)))
        return [[_white(own, next(done)) for own in self._whiten] for q in points]

    def _each(self, points: Sequence[FloatArray]) -> list[tuple[FloatArray, int]]:
        return [(q, flight) for q in points for flight in range(len(self.flights))]

    def evidence(self, q: FloatArray) -> Evidence:
        """Of all recordings; kept, since fits begin where effects were looked at and end there."""
        key = q.tobytes()
        if key not in self._kept:
            self._kept[key] = self._evidence(q)
        return self._kept[key]

    def _evidence(self, q: FloatArray) -> Evidence:
        moved = [
            [_moved(q, column, self.bounds[1]) for column in self._columns(flight)]
            for flight in range(len(self.flights))
        ]
        asked = [(at, flight) for flight, own in enumerate(moved) for at in (q, *own)]
        done, rows, slopes = iter(self._residuals(asked)), [], []
        left_V, by_start_V = [], []
        for flight, points in enumerate(moved):
            here, *there = (next(done) for _ in (q, *points))
            own = list(self._columns(flight))
            steps = np.array([at[c] - q[c] for at, c in zip(points, own, strict=True)])
            settled = self._whiteners[flight].settled
            left_V.append(settled(here[0]))
            by_start_V.append(settled((there[-1][0] - here[0]) / steps[-1])[:, None])
            for k, whiten in enumerate(self._whiten[flight]):
                changes = np.column_stack([r[k] - here[k] for r in there]) / steps
                white = whiten(np.column_stack([here[k], changes]))
                whole = np.zeros((white.shape[0], q.size))
                whole[:, own] = white[:, 1:]
                rows.append(white[:, 0])
                slopes.append(whole)
        return Evidence(
            residuals=np.concatenate(rows),
            slopes=np.vstack(slopes),
            left_V=np.concatenate(left_V),
            by_start_V=block_diag(*by_start_V),
        )

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals, those of the prior included, and their derivative."""
        e = self.evidence(q)
        return np.concatenate([e.residuals, -q]), np.vstack([e.slopes, -np.eye(q.size)])

    def costs(self, points: Sequence[FloatArray]) -> list[float]:
        """Half the sum of squares at each, those of the prior included."""
        both = zip(points, self.whitened(points), strict=True)
        return [0.5 * float(sum(r @ r for r in own) + q @ q) for q, own in both]

    def cost(self, q: FloatArray) -> float:
        """Of one, by `evidence`: slopes cost little beside it, and are asked for where it is least.

        Simulations go side by side.
        """
        residuals, _ = self.linearised(q)
        return 0.5 * float(residuals @ residuals)

    def _values(self, q: FloatArray) -> list[float]:
        return [
            min(max(value_of(p, x), limits[0]), limits[1])
            for (p, limits), x in zip(self._terms, self._mixed(q), strict=True)
        ]

    def _mixed(self, q: FloatArray) -> list[float]:
        """Numbers of the hypotheses in deviations of their priors."""
        mixed: list[float] = (self._mixes @ q[: len(self._terms)]).tolist()
        return mixed

    def _columns(self, flight: int) -> list[int]:
        return [*range(len(self._terms)), len(self._terms) + flight]


def _fullest(pack: Pack) -> float:
    """Most that its start may be stated as."""
    return OVERFULL if pack.soc_by_rest else 1.0


def rms(values: FloatArray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _white(ways: Sequence[Whitener | Whitening], residuals: Sequence[FloatArray]) -> FloatArray:
    """(m,) of one recording."""
    both = zip(ways, residuals, strict=True)
    return np.concatenate([whiten(r[:, None])[:, 0] for whiten, r in both])


def _moved(q: FloatArray, column: int, high: FloatArray) -> FloatArray:
    """A little along one coordinate, away from its upper bound."""
    out = q.copy()
    out[column] += DIFFERENCE if q[column] + DIFFERENCE <= high[column] else -DIFFERENCE
    return out
