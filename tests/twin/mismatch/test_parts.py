"""What each effect of a model does to the voltage."""

from dataclasses import replace

import numpy as np

from tests.twin.mismatch.recordings import flown
from twin.mismatch.hypothesis import HYPOTHESES
from twin.mismatch.parts import parts
from twin.mismatch.problem import Problem
from twin.mismatch.split import split
from twin.simulate import simulate


def test_the_part_of_a_resistance_is_its_drop_and_parts_add_up() -> None:
    """Both effects here are linear and do not act on each other, but for gain times drop."""
    own = flown(seed=1, seconds=30.0)
    data = split([own], [own]).fitted
    chosen = [h for h in HYPOTHESES if h.id in ("series_resistance", "voltage_gain")]
    problem = Problem(data, chosen)
    q = np.array([0.7, 0.0, -0.4, 0.5])  # resistance, where, gain, and the start
    made = {p.effect: p.voltage_V for p in parts(problem, q, 0)}
    values = problem.values(q)
    gain = values["voltage_gain"]["gain"]
    drop_V = values["series_resistance"]["resistance_ohm"] * own.load.current_A
    assert np.abs(made["series_resistance"] + gain * drop_V).max() < 1e-9
    started = problem.pack(np.array([0.0, 0.0, 0.0, 0.5]), 0)
    before_V = simulate(started, own.load).voltage_V
    cross_V = (gain - 1.0) * drop_V  # counted in both
    whole_V = own.voltage_V - problem.residual_V(q, 0) - before_V
    assert np.abs(sum(made.values()) + cross_V - whole_V).max() < 1e-9


def test_without_what_leaks_a_start_is_where_it_was_fitted() -> None:
    """What a rest tells is open beside a leak, and as well known as it was without."""
    own = flown(seed=1, seconds=30.0)
    read = replace(own, pack=replace(own.pack, initial_soc=0.97, soc_by_rest=True))
    leak = [h for h in HYPOTHESES if h.id == "leakage"]
    problem = Problem(split([read], [read]).fitted, leak)
    (part,) = parts(problem, np.array([0.0, 0.7]), 0)
    assert np.abs(part.voltage_V).max() < 1e-9
