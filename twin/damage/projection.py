"""How many flights a pack lasts: its life in few steps, each as long as the loss allows.

What a flight and its charge change in the kernel's state, once a few cycles are behind it, is a
rate per flight. The life is that rate integrated over the number of flights (Heun's method), the
state being extrapolated over hundreds of flights at once; two cycles are simulated for each rate,
the first to let charge and gradients settle. Source of the idea: Sulzer et al., J. Electrochem.
Soc. 168, 120531 (2021), doi:10.1149/1945-7111/ac39e0.
"""

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from twin.ageing import Aged, Regime, age
from twin.health import Examiner
from twin.inventory import Lithium
from twin.kernel import Backend
from twin.pack import Pack
from twin.pack_model import pack_model
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

SETTLED = 3  # cycles before the first rate
STEP_SHARE = 0.08  # of the first capacity, lost in a step: right to 1 % of flights
MOST_STEPS = 60
LONGEST = 8.0  # a step, over all flights before it: films slow down as they grow
FEWEST = 4  # flights a step
ASTRAY = 2.0  # times what a step was to lose: where a life ends steeply, shorter ones follow it
FILMS = ("film", "crack_film")
"""Of the state: what grows with the root of time, so that its square goes on straight."""
AGES = (
    *FILMS, "plated", "dead", "crack_m", "porosity", "left_n", "trapped_n", "left_p", "trapped_p",
)  # fmt: skip
"""What goes on over many flights; the rest settles, some of it slower than in a cycle."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Projection:
    """A life.

    Attributes:
        flights: (n,) number of flights.
        capacity_C: (n,) of the pack then.
        reached: flights at which the share that was asked for is left; NaN if it never is.
        error: of `reached`: by how much capacity and rates do not agree over the steps.
        ended: why the life ended before, "" if it did not.
    """

    flights: FloatArray
    capacity_C: FloatArray
    reached: float
    error: float
    ended: str


def life(pack: Pack, regime: Regime, *, share: float = 0.8) -> Projection:
    """Repeat `regime` until `share` of the first capacity is left, or the pack cannot go on."""
    return _Life(pack, regime, share).all()


@dataclass(frozen=True, slots=True, eq=False)
class _Rate:
    """Change per flight after `aged`, of the state as `_Life` extrapolates it, and of capacity."""

    aged: Aged
    state: FloatArray
    capacity_C: float


class _Unfinished(Exception):
    """A cycle could not be completed; the text says where and why."""


def _completed(aged: Aged) -> Aged:
    """`aged`, of a whole cycle; _Unfinished."""
    if aged.cycle.status is not Status.DONE:
        raise _Unfinished(f"in the {aged.cycle.stopped_in} {aged.cycle.status.value}")
    return aged


class _Life:
    def __init__(self, pack: Pack, regime: Regime, share: float) -> None:
        self._pack, self._regime = pack, regime
        self._model, self._kinds = pack_model(pack, None, Backend.AUTO), pack.cells()
        self._examiner = Examiner(pack)
        self._share = share

    def all(self) -> Projection:
        begun = list(islice(age(self._pack, self._regime), SETTLED + 1))
        whole_C = begun[0].cycle.health.capacity_C
        flights, capacity, fades_C, ended = [0.0], [whole_C], [], ""
        try:
            aged = _completed(begun[-1])
            flights.append(float(aged.cycle.number))
            capacity.append(aged.cycle.health.capacity_C)
            while capacity[-1] > self._share * whole_C and len(flights) < MOST_STEPS:
                aged, count, fade_C = self._step(aged, flights[-1], STEP_SHARE * whole_C)
                flights.append(flights[-1] + count)
                capacity.append(aged.cycle.health.capacity_C)
                fades_C.append(fade_C)
        except _Unfinished as e:
            ended = str(e)
        course = np.array(flights), np.array(capacity)
        return _projected(*course, self._share, _missed_C(*course, np.array(fades_C)), ended)

    def _step(self, aged: Aged, behind: float, most_C: float) -> tuple[Aged, float, float]:
        """The pack some flights later, how many, and what the first of them cost [C]."""
        before = self._rate(aged)
        fade_C = max(-before.capacity_C, most_C / (LONGEST * behind))
        count = float(np.clip(most_C / fade_C, FEWEST, LONGEST * behind))
        passed = before.aged.cycle.number - aged.cycle.number
        while True:
            after = self._rate(self._later(before.aged, (count - passed) * before.state))
            mean = (before.state + after.state) / 2
            later = self._later(before.aged, (count - passed) * mean)
            lost_C = aged.cycle.health.capacity_C - later.cycle.health.capacity_C
            if lost_C <= ASTRAY * most_C or count == FEWEST:
                return later, count, -before.capacity_C
            count = max(count / 2, FEWEST)

    def _rate(self, aged: Aged) -> _Rate:
        """Of the second of two cycles: the first lets charge and gradients settle."""
        first, second = map(_completed, islice(age(self._pack, self._regime, after=aged), 2))
        change = self._ageing(self._straight(second.state) - self._straight(first.state))
        fade_C = second.cycle.health.capacity_C - first.cycle.health.capacity_C
        return _Rate(second, change, fade_C)

    def _ageing(self, change: FloatArray) -> FloatArray:
        """The part of a change that goes on."""
        out = np.zeros_like(change)
        for kept, own in zip(self._model.states(out), self._model.states(change), strict=True):
            for name in AGES:
                span = self._model.cell.layout.slice_of(name)
                kept[span] = own[span]
        return out

    def _straight(self, state: FloatArray) -> FloatArray:
        """The state with what grows as a root squared: it changes evenly with the flights."""
        out = state.copy()
        for own in self._model.states(out):
            for name in FILMS:
                own[self._model.cell.layout.slice_of(name)] **= 2
        return out

    def _later(self, aged: Aged, change: FloatArray) -> Aged:
        """`aged` with the state changed by `change`, its lithium and salt kept."""
        out = self._straight(aged.state) + change
        layout = self._model.cell.layout
        parts = zip(
            self._model.states(out), self._model.states(aged.state), self._kinds, strict=True
        )
        for own, before, kind in parts:
            for name in FILMS:
                span = layout.slice_of(name)
                own[span] = np.sqrt(np.maximum(own[span], 0.0))
            lithium = Lithium(layout, kind.values)
            kept, now = lithium.mol(before), lithium.mol(own)
            own[layout.slice_of("salt")] *= kept["electrolyte"] / now["electrolyte"]
            gained = sum(now.values()) - now["electrolyte"]
            gained -= sum(kept.values()) - kept["electrolyte"]
            means = layout.slice_of("modes_n").start
            nodes = slice(means, means + layout.electrodes[0])
            own[nodes] *= 1 - gained / now["negative"]
        health = self._examiner.examine(out, 0.0)
        return replace(aged, state=out, cycle=replace(aged.cycle, health=health))


def _missed_C(flights: FloatArray, capacity_C: FloatArray, fades_C: FloatArray) -> float:
    """By how much the capacity lost in the steps differs from their rates, added.

    Heun's method foresees the rate at the end of a step; the next step finds the true one. Over a
    step, the trapezoid of true rates errs in the same order as the method does.
    """
    known = slice(1, 1 + max(fades_C.size - 1, 0))
    lost_C = -np.diff(capacity_C)[known]
    told_C = np.diff(flights)[known] * (fades_C[:-1] + fades_C[1:]) / 2
    return float(np.abs(lost_C - told_C).sum())


def _projected(
    flights: FloatArray, capacity_C: FloatArray, share: float, doubt_C: float, ended: str
) -> Projection:
    goal_C = share * capacity_C[0]
    reached = error = float("nan")
    if capacity_C[-1] <= goal_C:
        k = int(np.argmax(capacity_C <= goal_C))
        course = PchipInterpolator(flights, capacity_C)
        reached = float(brentq(lambda n: course(n) - goal_C, flights[k - 1], flights[k]))
        error = float(doubt_C / abs(course.derivative()(reached)))
    return Projection(
        flights=flights, capacity_C=capacity_C, reached=reached, error=error, ended=ended
    )
