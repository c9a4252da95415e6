"""The charge a twin gives in a check-up: from full to the voltage at which the check-up ended."""

from dataclasses import replace

import numpy as np

from proof.truth import Truth
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

CURRENT, EMPTY = "check-up, A", "check-up ended at, V"
"""Of `Truth.details`: current of the pack in the check-up, discharge positive, and its last
voltage."""
FITTED = "fitted, Ah"
"""Likewise: what the recording that is fitted gave."""
SAMPLES = 400
LONGEST = 1.6  # of the nominal capacity: no check-up gives more


def predicted_capacity_C(pack: Pack, truth: Truth) -> float:
    """Of a pack that is full, in the check-up of which `truth` says current and end."""
    assert truth.details is not None
    return capacity_C(pack, float(truth.details[CURRENT]), float(truth.details[EMPTY]))


def capacity_C(pack: Pack, current_A: float, empty_V: float) -> float:
    """Charge drawn at `current_A` from the start of `pack` until it is down to `empty_V` [C]."""
    cell = replace(pack.cell, lower_cut_off_V=empty_V / pack.series)
    longest_s = LONGEST * pack.rated_C / current_A
    time_s = np.linspace(0.0, longest_s, SAMPLES)
    load = Load(time_s=time_s, current_A=np.full(SAMPLES, current_A), ambient_K=pack.initial_K)
    return current_A * simulate(replace(pack, cell=cell), load).stopped_s
