"""An aged cell beside the twin of the fresh one: what it lost, and what it still holds.

The list was written before any of it was judged. The Sony VTC6 over 268 missions: its twin is
calibrated to the first check-up; its error is what it misses of the second one, after 50 missions,
which has lost 2.5 % already and makes that error large rather than small. It is given a check-up
after a third and two thirds of its life and at its end, and the next one to judge by; what that one
gave is the capacity that is asked for. At C/5 from full to empty what shows is charge: lithium that
no longer cycles or material that is cut off, and a terminal voltage does not tell for certain
which; resistance grows with it.

Not made: missions of the aged cell. They were resampled to 30 s, and by that the charge of one with
75 s of take-off is known to 4 % (1.83 to 2.00 Ah in the first three), as much as the cell lost in
half its life. Panasonic: the recordings end before the reference tests of the aged cell. Leaf: the
aged module and the new cell are not one make of cell at two ages but two cells; its cells are
unlike (`trials_weak.py`).
"""

from functools import partial
from pathlib import Path

import numpy as np

from proof.capacity import CURRENT, EMPTY, FITTED
from proof.question import Question, Recording
from proof.recorded.calibrated import Calibrated
from proof.recorded.instruments import by_cycler
from proof.recorded.measured import NotHere, RealTest
from proof.recorded.replay import whole_V
from proof.recorded.vtc6 import DRAWN_A, Life, fresh, life
from proof.trial import NoTrial, Trial
from proof.truth import Truth
from twin.load import Load
from twin.pack import Pack

SOURCE = "Sony VTC6 3 Ah, missions of an aircraft (Carnegie Mellon, resampled by mjihoon930)"
LIST = ((100, 150), (200, 250), (250, 251), (150, 200))
"""Missions before the check-up that is fitted, and before the one that is held out. The last was
written down later, before it was run, and run once; the others show both of its check-ups."""
UNSEEN = 50
LOSSES = (
    "lithium_inventory_loss",
    "active_material_loss_negative",
    "active_material_loss_positive",
)
WITH_AGE = ("film_resistance", "series_resistance")


def ageing_trials(folder: Path, cache: Path) -> tuple[Trial, ...]:
    """All of LIST."""
    return tuple(
        Trial(name=f"trial-m{k:02d}", source=SOURCE, make=partial(_made, ages, folder, cache))
        for k, ages in enumerate(LIST, start=1)
    )


def _made(ages: tuple[int, int], folder: Path, cache: Path) -> tuple[Question, Truth]:
    try:
        own = life(folder)
    except NotHere as e:
        raise NoTrial(str(e)) from e
    base = fresh(own, cache)
    tests = [own.test(f"recording-{k}", rows) for k in ages for n, rows in own.check_ups if n == k]
    first, later = (_until_empty(t) for t in tests)
    floor_V = error_of(base, own)
    question = Question(
        pack=by_cycler(base.pack),
        ambient_K=base.pack.initial_K,
        fitted=(_recording(first, "recording-1"),),
        held_out=(_recording(later, "recording-2"),),
        floor_V=floor_V,
    )
    (new,) = (_until_empty(own.test("new", rows)) for n, rows in own.check_ups if n == 0)
    flows = later.current_A > DRAWN_A
    missed_V, new_V = missed(base.pack, first), missed(base.pack, new)
    truth = Truth(
        kind="ageing",
        said=f"the cell after {ages[0]} and {ages[1]} missions, the twin when it was new: "
        f"{later.drawn_C[-1] / 3600:.3f} of {new.drawn_C[-1] / 3600:.3f} Ah at C/5",
        verdicts=("named",),
        effects=(LOSSES,),
        also=(*LOSSES, *WITH_AGE),
        strength=missed_V / floor_V,
        floor_V=floor_V,
        capacity_C=float(later.drawn_C[-1]),
        details={
            CURRENT: float(np.median(later.current_A[flows])),
            EMPTY: float(later.voltage_V[flows].min()),
            "new, Ah": float(new.drawn_C[-1]) / 3600,
            FITTED: float(first.drawn_C[-1]) / 3600,
            "missed of the aged check-up, V rms": missed_V,
            "missed of the new one, V rms": new_V,
        },
    )
    return question, truth


def error_of(base: Calibrated, own: Life) -> float:
    """What the twin of the new cell misses of the check-up after UNSEEN missions [V rms]."""
    (rows,) = (rows for n, rows in own.check_ups if n == UNSEEN)
    return missed(base.pack, _until_empty(own.test("unseen", rows)))


def missed(pack: Pack, test: RealTest) -> float:
    """Measured minus simulated [V rms]; where the simulation ended as at its end."""
    load = Load(time_s=test.time_s, current_A=test.current_A, ambient_K=pack.initial_K)
    return float(np.sqrt(np.mean((test.voltage_V - whole_V(pack, load)) ** 2)))


def _until_empty(test: RealTest) -> RealTest:
    """Without the rest after it: a check-up is over when the cell is empty."""
    return test.part(slice(0, int(np.flatnonzero(test.current_A > DRAWN_A)[-1]) + 1))


def _recording(test: RealTest, name: str) -> Recording:
    return Recording(
        name=name, time_s=test.time_s, current_A=test.current_A, voltage_V=test.voltage_V
    )
