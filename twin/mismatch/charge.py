"""What the charge drawn is off by because a current is known at its samples only.

Between two samples of a current that never rests the straight line has another mean than the
current. The errors of the intervals are as good as independent, so that the charge drawn so far is
off by a random walk: nothing in mid discharge, and the first of all errors where a cell is nearly
empty and its voltage falls as from a cliff.
"""

from dataclasses import replace
from math import sqrt

import numpy as np

from twin.load import Between, Load
from twin.mismatch.flight import FloatArray
from twin.mismatch.problem import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate

SOC_STEP = 1e-4


def walk_C(load: Load) -> float:
    """What the charge drawn is off by after a second, standard deviation [C].

    Taking every other sample only changes the charge of the intervals; from there to every fourth
    it changes again, by more. As much as from a fourth to a half it changes from the half to the
    whole, it does from the whole to the current itself, but no more than from the half (of a
    current that is nothing but noise from sample to sample). Nothing where the steps were
    programmed.
    """
    if load.between is Between.HOLD or load.time_s.size < 2:
        return 0.0
    whole, half, fourth = (_thinned(load, every) for every in (1, 2, 4))
    nearer, further = (_changed_C2(a, b) for a, b in ((whole, half), (half, fourth)))
    variance_C2 = nearer * min(1.0, nearer / further) if further > 0 else nearer
    return sqrt(variance_C2 / float(load.time_s[-1] - load.time_s[0]))


def walk_V(pack: Pack, load: Load) -> FloatArray:
    """(n,) the same in the voltage of a pack: by how much that moves with the charge [V]."""
    error_C = walk_C(load)
    if not error_C:
        return np.zeros(load.time_s.size)
    wide = beyond_cut_offs(pack)
    less = replace(wide, initial_soc=wide.initial_soc - min(SOC_STEP, wide.initial_soc / 2))
    as_is, lower = (simulate(p, load).voltage_V for p in (wide, less))
    n = min(as_is.size, lower.size)
    if not n:
        return np.zeros(load.time_s.size)
    whole_C = pack.scale * pack.parallel * pack.cell.nominal_capacity_C
    step_C = (wide.initial_soc - less.initial_soc) * whole_C
    change_V = (as_is[:n] - lower[:n]) * error_C / step_C
    return np.append(change_V, np.full(load.time_s.size - n, change_V[-1]))


def _thinned(load: Load, every: int) -> Load:
    return replace(load, time_s=load.time_s[::every], current_A=load.current_A[::every])


def _changed_C2(load: Load, thinner: Load) -> float:
    """Squares of what the intervals of every other sample draw otherwise, all of them [C2]."""
    both = load.drawn_C()[::2], thinner.drawn_C()
    return float(np.sum(np.diff(both[0] - both[1]) ** 2))
