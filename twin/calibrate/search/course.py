"""The order of a search: who works next, from where, and when that changes.

The idea is that of strategically switching metaheuristics (Kim et al., J. Energy Storage, 2023):
judge from samples of the objective which algorithm suits it, test that on the way and switch, and
resample particles to leave local optima. There a network trained on benchmark functions judges;
here nothing is trained:

1. `sample`: a Latin hypercube. Its features (`landscape.py`) weigh the members, and again when
   samples of resampled populations have been added.
2. `lead`: one member works, in slices of evaluations. Its credit is by how much the
   median of the best points of all fell, for each evaluation of its last slices.
3. `test`: now and then another member works for a slice, in turns from its own population and from
   the best points met lately. With the higher credit it leads from there on. Tests get rarer while
   the leader holds, and frequent again when it changes.
4. `resample`: a member that has collapsed or stagnates starts anew, elsewhere (`resample.py`).
   While nobody earns credit, every second slice goes to the lowest run that still improves, the
   others by weight.

A course depends on the costs told alone: not on time, nor on how many evaluations there will be.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from twin.calibrate.search.landscape import landscape, suitability
from twin.calibrate.search.members import MEMBERS, SMALLEST_BATCH, Member, Seed
from twin.calibrate.search.resample import Found, anew, from_shared, spread_out

FloatArray = npt.NDArray[np.float64]

SAMPLES = 8  # per dimension, before the first member
SLICE = 20  # evaluations per dimension
FIRST_TEST, LAST_TEST = 2, 8  # slices of the leader between tests, while it holds


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


@dataclass(slots=True, eq=False)
class _Run:
    """A member at work from one start: how it gets on."""

    member: Member
    best: tuple[float, FloatArray] | None = None
    improved: bool = False  # in its last slice

    def take(self, points: FloatArray, costs: FloatArray) -> None:
        """Tell the member, remember the best."""
        self.member.tell(costs)
        at = int(np.argmin(costs))
        if self.best is None or costs[at] < self.best[0]:
            self.best, self.improved = (float(costs[at]), points[at]), True


@dataclass(slots=True, eq=False)
class _Seat:
    """An algorithm: its runs, of which the last is at work, and what it has earned."""

    name: str
    weight: float = 1.0
    runs: list[_Run] = field(default_factory=list)
    credit: float = 0.0  # fall of the elite's median cost per evaluation of the last slices
    evaluations: int = 0
    levelled: int = 0
    starts: int = 0
    tests: int = 0

    def share(self) -> float:
        """Evaluations it has had for its weight, since shares were last levelled."""
        return (self.evaluations - self.levelled) / self.weight

    def height(self) -> float:
        """Best cost of its run while that improves, else infinite."""
        run = self.runs[-1] if self.runs else None
        return run.best[0] if run and run.best and run.improved else np.inf


class Course:
    """One search, told what its points cost; `turns` is the whole of it."""

    def __init__(
        self, dimension: int, seed: int, start: FloatArray, members: Sequence[str] = tuple(MEMBERS)
    ) -> None:
        self._k, self._start = dimension, start
        self._random = np.random.default_rng(seed)
        self._seats = [_Seat(name) for name in members]
        self._slice = max(80, SLICE * dimension)
        self._elite_costs = np.full(4 * dimension, np.inf)
        self._lately: list[tuple[FloatArray, FloatArray]] = []
        self._spread: list[tuple[FloatArray, FloatArray]] = []
        self._basins: list[tuple[float, FloatArray]] = []
        self._best, self._best_by = (np.inf, np.full(dimension, 0.5)), ""
        self._since_test, self._interval, self._idle = 0, FIRST_TEST, 0

    def turns(self) -> Turns:
        """Proposals without end; each is to be answered by its costs."""
        yield from self._sample()
        leader = max(self._seats, key=lambda s: s.weight)
        while True:
            while leader.credit > 0:
                yield from self._work(leader, Stage.LEAD)
                self._since_test += 1
                if self._since_test >= self._interval and len(self._seats) > 1:
                    leader = yield from self._tested(leader)
            for seat in self._seats:
                seat.levelled = seat.evaluations
            while leader.credit <= 0:
                leader = yield from self._nobody_earns()

    def _sample(self) -> Turns:
        count = max(2 * SMALLEST_BATCH, SAMPLES * self._k)
        cover = spread_out(count, self._k, self._random)
        points = np.vstack([self._start, cover])
        costs = yield Proposal(points, "sample", Stage.SAMPLE)
        self._take(points, costs, "sample")
        self._spread.append((points, costs))
        self._weigh()
        for seat in self._seats:
            seat.credit = np.inf  # until it has worked

    def _weigh(self) -> None:
        points = np.vstack([p for p, _ in self._spread])
        costs = np.concatenate([c for _, c in self._spread])
        weights = suitability(landscape(points, costs))
        for seat in self._seats:
            seat.weight = weights[seat.name]

    def _nobody_earns(self) -> Generator[Proposal, FloatArray, _Seat]:
        """A slice of who is nearest to earning, or has had least; it leads if it earns."""
        self._idle += 1
        self._since_test, self._interval = 0, FIRST_TEST
        lowest = min(self._seats, key=_Seat.height)
        by_share = self._idle % 2 or lowest.height() == np.inf
        seat = min(self._seats, key=_Seat.share) if by_share else lowest
        seat.credit = 0.0
        yield from self._work(seat, Stage.LEAD)
        return seat

    def _tested(self, leader: _Seat) -> Generator[Proposal, FloatArray, _Seat]:
        """Who leads after another member's slice."""
        rival = min((s for s in self._seats if s is not leader), key=_Seat.share)
        rival.tests += 1
        self._since_test = 0
        shared = bool(rival.runs) and rival.tests % 2 == 0
        seed = from_shared(rival.name, self._found(self._lately), self._random) if shared else None
        if seed is not None:
            self._run(rival, seed)
        rival.credit = 0.0
        yield from self._work(rival, Stage.TEST)
        if rival.credit > leader.credit:
            self._interval = FIRST_TEST
            return rival
        self._interval = min(LAST_TEST, 2 * self._interval)
        if seed is not None and len(rival.runs) > 1:
            rival.runs.pop()
        return leader

    def _work(self, seat: _Seat, stage: Stage) -> Turns:
        """One slice of `seat`, and what it earned."""
        if not seat.runs:
            stage = self._renew(seat, stage)
        run, used, before = seat.runs[-1], 0, self._elite_median()
        run.improved = False
        while used < self._slice and not run.member.exhausted():
            points = run.member.ask()
            if not len(points):
                break
            costs = yield Proposal(points, seat.name, stage)
            if stage is Stage.RESAMPLE and not used and len(points) >= 2 * self._k:
                self._spread.append((points, costs))
            run.take(points, costs)
            self._take(points, costs, seat.name)
            used += len(points)
        seat.evaluations += used
        gain = (before - self._elite_median()) / max(used, 1)
        seat.credit = (seat.credit + gain) / 2 if 0 < seat.credit < np.inf and gain > 0 else gain
        if run.member.exhausted():
            seat.runs.remove(run)
            seat.credit = 0.0
            if run.best is not None:
                self._basins.append(run.best)

    def _renew(self, seat: _Seat, stage: Stage) -> Stage:
        """A new start of `seat`: from the samples at first, else where it has not been."""
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
        self._run(seat, seed)
        return stage

    def _run(self, seat: _Seat, seed: Seed) -> None:
        """At work from now on; of those before, the first is kept to return to."""
        seat.runs = [*seat.runs[:1], _Run(MEMBERS[seat.name](seed))]

    def _elite_median(self) -> float:
        return float(np.median(self._elite_costs))

    def _take(self, points: FloatArray, costs: FloatArray, name: str) -> None:
        size = self._elite_costs.size
        self._elite_costs = np.sort(np.append(self._elite_costs, costs))[:size]
        self._lately.append((points, costs))
        while sum(len(c) for _, c in self._lately[1:]) > 2 * self._slice:
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
