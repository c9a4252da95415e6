"""A life by few of its cycles: `checked` gives the health of a pack at the check-ups.

Ageing is slow: what one cycle makes of films, cracks and active material changes little from cycle
to cycle. So after the first cycles, all simulated, these are carried over ever more cycles by what
single ones among them change, extrapolated in a straight line (Adams and Bashforth, of second
order). All else forgets its past within a cycle or two and stays as it is, but for what lithium and
salt must do to be kept: the negative particles give what the films have taken.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.ageing import Aged, Regime, first_charge, one_cycle
from twin.health import Examiner, Health
from twin.kernel import Backend
from twin.pack import Pack
from twin.pack_model import pack_model
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

WHOLE = 4
"""Cycles at first that are all simulated: what a new pack settles into."""
STRIDE = 0.15
"""Cycles from one that is simulated to the next, over all before."""
SLOW = (
    "film", "crack_film", "dead", "crack_m", "porosity", "left_n", "left_p", "trapped_n",
    "trapped_p",
)  # fmt: skip
"""What is carried over, of the state of a cell; lithium that is plated comes and goes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """A pack at a moment of its life.

    Attributes:
        cycle: so many since it was new; 0 after the first charge.
        time_s: since it was new.
        health: then.
    """

    cycle: int
    time_s: float
    health: Health


def checked(
    pack: Pack, regime: Regime, until: int, *, at: Sequence[int] = (), stride: float = STRIDE
) -> Iterator[Checked]:
    """Moments of a life of `until` cycles, those of `at` among them; fewer if it ends before.

    `stride` 0 simulates every cycle.
    """
    examiner, leap = Examiner(pack), Leap(pack)
    now = first_charge(pack, regime, examiner)
    yield _told(now)
    wanted, slope, middle = sorted({*at, until}), None, 0.0
    while now.cycle.status is Status.DONE and now.cycle.number < until:
        number = now.cycle.number
        after = one_cycle(pack, regime, examiner, now)
        if after.cycle.status is not Status.DONE:
            return
        new_slope, new_middle = after.state - now.state, number + 0.5
        over = min(int(stride * number) if number >= WHOLE else 0, _next(wanted, number) - 1)
        if over > 0 and slope is not None:
            bend = (new_slope - slope) / (new_middle - middle)
            state = leap(after.state, over * (new_slope + bend * (1.0 + over) / 2))
            now = _later(after, now, state, over, examiner)
        else:
            now = after
        slope, middle = new_slope, new_middle
        yield _told(now)


class Leap:
    """Moves what is slow in the state of every cell of `pack`, and keeps lithium and salt."""

    def __init__(self, pack: Pack) -> None:
        self.model, self._kinds = pack_model(pack, None, Backend.AUTO), pack.cells()
        layout = self.model.cell.layout
        self._slow = np.concatenate([np.arange(layout.size)[layout.slice_of(n)] for n in SLOW])

    def __call__(self, state: FloatArray, change: FloatArray) -> FloatArray:
        """(states,) after `change` of all that is slow; the rest of `change` is not used."""
        out = state.copy()
        cells = zip(*(self.model.states(s) for s in (state, change, out)), self._kinds,
                    strict=True)  # fmt: skip
        for before, by, now, kind in cells:
            now[self._slow] += by[self._slow]
            self._keep(before, now, kind.values)
        return out

    def _keep(self, before: FloatArray, now: FloatArray, values: dict[str, float]) -> None:
        """Salt and lithium of `now` become those of `before`, in place."""
        cell, layout = self.model.cell, self.model.cell.layout
        was, moved = (cell.lithium_mol(s, values) for s in (before, now))
        now[layout.slice_of("salt")] *= was["electrolyte"] / moved["electrolyte"]
        missing = (
            sum(was.values()) - sum(moved.values()) - was["electrolyte"] + moved["electrolyte"]
        )
        means = now[layout.slice_of("modes_n")][: layout.layer("negative").size]  # a view
        means *= 1.0 + missing / moved["negative"]


def _next(wanted: Sequence[int], number: int) -> int:
    """Cycles to the next that is wanted, one at least."""
    return next(n for n in wanted if n > number) - number


def _later(after: Aged, before: Aged, state: FloatArray, over: int, examiner: Examiner) -> Aged:
    """`after` in `state`, `over` cycles later; each took as long as the last."""
    drawn_C = after.net_charge_C + over * (after.net_charge_C - before.net_charge_C)
    cycle = replace(
        after.cycle,
        number=after.cycle.number + over,
        time_s=after.cycle.time_s + over * (after.cycle.time_s - before.cycle.time_s),
        health=examiner.examine(state, drawn_C),
    )
    return Aged(cycle=cycle, state=state, net_charge_C=drawn_C)


def _told(aged: Aged) -> Checked:
    return Checked(cycle=aged.cycle.number, time_s=aged.cycle.time_s, health=aged.cycle.health)
