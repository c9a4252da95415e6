"""The order of a search: who works next, from where, and when that changes.

The idea is that of strategically switching metaheuristics (Kim et al., J. Energy Storage, 2023):
judge from samples of the objective which algorithm suits it, test that on the way and switch, and
resample particles to leave local optima. There a network trained on benchmark functions judges;
here nothing is trained:

1. `sample`: a Latin hypercube. Its features (`landscape.py`) weigh the members, and again when
   samples of resampled populations have been added.
2. `lead`: one member works, in slices of evaluations: at first CMA-ES, which ends soonest and so
   costs least where it is the wrong one, or one that has come lower in its tests. When a run has
   ended the landscape has more than one basin; from then on the member leads whose run promises
   most (`promise.py`): where it will stand if it goes on as it does. So a slow run that goes on
   falling takes over from fast ones that end early.
3. `test`: a tenth of the evaluations, and all while no run promises anything better than what has
   been found, go to the other members in turns, by weights that fall as their runs end in vain.
4. `resample`: a run that gains nothing any more, or has no prospect of reaching what has been
   found, is over: its member starts anew, elsewhere (`resample.py`). Others wait as they are.

A course depends on the costs told alone: not on time, nor on how many evaluations there will be.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from twin.calibrate.search.landscape import landscape, suitability
from twin.calibrate.search.members import MEMBERS, SMALLEST_BATCH, Member
from twin.calibrate.search.promise import expected, remaining
from twin.calibrate.search.resample import Found, anew, from_shared, spread_out

FloatArray = npt.NDArray[np.float64]

SAMPLES = 8  # per dimension, before the first member
SLICE, GENERATIONS = 20, 5  # evaluations per dimension in a slice, generations at least
TESTS = 0.1  # of the evaluations, while a run leads
LEADS, LASTS = 1.0, 4.0  # times as many slices again, in which a run is to reach what was found
NOTHING = 1e-7  # of what a run has gained since its first slice: no gain


class Stage(StrEnum):
    """What a batch of evaluations is for."""

    SAMPLE = "sample"
    LEAD = "lead"
    TEST = "test"
    RESAMPLE = "resample"


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """(m, k) points to evaluate, by whom and what for."""

    points: FloatArray
    algorithm: str
    stage: Stage


Turns = Generator[Proposal, FloatArray, None]


class _Elite:
    """The lowest of the costs told."""

    def __init__(self, size: int) -> None:
        self._size, self._costs = size, np.empty(0)

    def take(self, costs: FloatArray) -> None:
        """Costs that were told."""
        self._costs = np.sort(np.append(self._costs, costs))[: self._size]

    def level(self) -> float:
        """Their median: how far it has come, not moved by one lucky point."""
        return float(np.median(self._costs))


@dataclass(slots=True, eq=False)
class _Run:
    """A member at work from one start."""

    member: Member
    size: int
    elite: _Elite
    levels: list[float] = field(default_factory=list)  # after the first batch and each slice
    best: tuple[float, FloatArray] | None = None

    def take(self, points: FloatArray, costs: FloatArray) -> None:
        """Tell the member, remember the best."""
        self.member.tell(costs)
        self.elite.take(costs)
        at = int(np.argmin(costs))
        if self.best is None or costs[at] < self.best[0]:
            self.best = float(costs[at]), points[at]
        if not self.levels:
            self.levels.append(self.elite.level())


@dataclass(slots=True, eq=False)
class _Seat:
    """An algorithm, its run, and how often it has started and been tested."""

    name: str
    weight: float = 1.0
    run: _Run | None = None
    starts: int = 0
    ends: int = 0
    wins: int = 0  # ends where nothing better had been found
    tested: int = 0  # evaluations

    def share(self) -> float:
        """Evaluations in tests for its weight, which falls when its runs end in vain."""
        return self.tested / self.weight * (1 + self.ends) / (1 + self.wins)

    def level(self) -> float:
        """Of its run."""
        return self.run.levels[-1] if self.run else np.inf

    def promise(self) -> float:
        """Level its run may reach."""
        return expected(self.run.levels, LEADS) if self.run else np.inf


class Course:
    """One search, told what its points cost; `turns` is the whole of it."""

    def __init__(
        self, dimension: int, seed: int, start: FloatArray, members: Sequence[str] = tuple(MEMBERS)
    ) -> None:
        self._k, self._start = dimension, start
        self._random = np.random.default_rng(seed)
        self._seats = [_Seat(name) for name in members]
        self._elite = _Elite(4 * dimension)
        self._lately: list[tuple[FloatArray, FloatArray]] = []
        self._spread: list[tuple[FloatArray, FloatArray]] = []
        self._basins: list[tuple[float, FloatArray]] = []
        self._best, self._best_by = (np.inf, np.full(dimension, 0.5)), ""
        self._evaluations = 0

    def turns(self) -> Turns:
        """Proposals without end; each is to be answered by its costs."""
        yield from self._sample()
        yield from self._work(self._seats[0], Stage.LEAD)
        while True:
            leader = self._leader()
            if leader is None or self._test_due():
                yield from self._test(leader)
            else:
                yield from self._work(leader, Stage.LEAD)

    def _leader(self) -> _Seat | None:
        """The lowest run; once one has ended, that which promises most, if more than was found."""
        open_to = [s for s in self._seats if s.run and not self._over(s.run)]
        if not any(s.ends for s in self._seats):
            return min(open_to, key=_Seat.level, default=None)
        best = min(open_to, key=_Seat.promise, default=None)
        return best if best and best.promise() < self._elite.level() else None

    def _over(self, run: _Run) -> bool:
        """It will gain nothing any more, or not reach what has been found."""
        if expected(run.levels, LASTS) > self._elite.level():
            return True
        return len(run.levels) > 2 and remaining(run.levels) <= NOTHING * (
            run.levels[1] - run.levels[-1]
        )

    def _test_due(self) -> bool:
        tested = sum(s.tested for s in self._seats) + self._slice(None)
        return len(self._seats) > 1 and tested <= TESTS * self._evaluations

    def _test(self, leader: _Seat | None) -> Turns:
        """A slice of who but `leader` has had least for its weight."""
        rivals = [s for s in self._seats if s is not leader]
        rival = min(rivals, key=_Seat.share)
        before = self._evaluations
        yield from self._work(rival, Stage.TEST)
        rival.tested += self._evaluations - before

    def _sample(self) -> Turns:
        count = max(2 * SMALLEST_BATCH, SAMPLES * self._k)
        cover = spread_out(count, self._k, self._random)
        points = np.vstack([self._start, cover])
        costs = yield Proposal(points, "sample", Stage.SAMPLE)
        self._take(points, costs, "sample")
        self._spread.append((points, costs))
        self._weigh()

    def _weigh(self) -> None:
        points = np.vstack([p for p, _ in self._spread])
        costs = np.concatenate([c for _, c in self._spread])
        weights = suitability(landscape(points, costs))
        for seat in self._seats:
            seat.weight = weights[seat.name]

    def _slice(self, run: _Run | None) -> int:
        """Evaluations; without a run those of a small population."""
        return max(80, SLICE * self._k, GENERATIONS * run.size if run else 0)

    def _work(self, seat: _Seat, stage: Stage) -> Turns:
        """One slice of `seat`, by a new run if that at hand has no prospect."""
        if seat.run is None or self._over(seat.run):
            stage = self._renew(seat, stage)
        assert seat.run is not None
        run, used = seat.run, 0
        while used < self._slice(run) and not run.member.exhausted():
            points = run.member.ask()
            if not len(points):
                break
            costs = yield Proposal(points, seat.name, stage)
            if stage is Stage.RESAMPLE and not used and len(points) >= 2 * self._k:
                self._spread.append((points, costs))
            run.take(points, costs)
            self._take(points, costs, seat.name)
            used += len(points)
        if used:
            run.levels.append(run.elite.level())
        if run.member.exhausted():
            self._end(seat)

    def _end(self, seat: _Seat) -> None:
        """Its run is given up, what it found is remembered."""
        if seat.run is not None and seat.run.best is not None:
            self._basins.append(seat.run.best)
            seat.ends += 1
            seat.wins += seat.run.best[0] <= self._best[0]
        seat.run = None

    def _renew(self, seat: _Seat, stage: Stage) -> Stage:
        """A new start of `seat`: from the samples at first, else where it has not been."""
        self._end(seat)
        seed = None
        if seat.starts == 0:
            seed = from_shared(seat.name, self._found(self._spread[:1]), self._random)
        elif seat.name == "cma" and self._best_by != "cma":
            seed = from_shared(seat.name, self._found(self._lately), self._random)
        if seed is None:
            seed = anew(seat.name, self._found(self._lately), max(0, seat.starts - 1), self._random)
            stage = Stage.RESAMPLE
            self._weigh()
        seat.starts += 1
        seat.run = _Run(MEMBERS[seat.name](seed), seed.size, _Elite(4 * self._k))
        return stage

    def _take(self, points: FloatArray, costs: FloatArray, name: str) -> None:
        self._elite.take(costs)
        self._evaluations += len(costs)
        self._lately.append((points, costs))
        while sum(len(c) for _, c in self._lately[1:]) > 2 * self._slice(None):
            del self._lately[0]
        at = int(np.argmin(costs))
        if costs[at] < self._best[0]:
            self._best, self._best_by = (float(costs[at]), points[at]), name

    def _found(self, batches: list[tuple[FloatArray, FloatArray]]) -> Found:
        points = np.vstack([p for p, _ in batches])
        costs = np.concatenate([c for _, c in batches])
        order = np.argsort(costs, kind="stable")[: max(20, 3 * self._k)]
        basins = [p for _, p in sorted(self._basins, key=lambda b: b[0])]
        return Found(
            elite=points[order], costs=costs[order], basins=np.array([self._best[1], *basins])
        )
