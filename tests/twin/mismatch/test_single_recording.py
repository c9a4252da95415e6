"""One flight until a battery is empty: what shows at its end alone, and what must not."""

import pytest

from benchmarks.single_flights import flown, told_by_rest
from twin.effects import AnyEffect, SeriesResistance, WeakCell
from twin.mismatch import Verdict, explain
from twin.mismatch.hypothesis import HYPOTHESES

FEW = [
    h
    for h in HYPOTHESES
    if h.id in ("series_resistance", "solid_diffusion_negative", "weak_cell", "current_gain")
]
OF_CHARGE = [h for h in HYPOTHESES if h.id in ("weak_cell", "initial_soc", "series_resistance")]


@pytest.mark.long
@pytest.mark.parametrize(("seed", "every"), [(7, 2), (20, 2), (21, 2), (22, 2), (7, 10), (20, 10)])
def test_a_thinned_current_is_no_physics_where_a_battery_empties(seed: int, every: int) -> None:
    """Without what flows unseen the first has a diffusion of 1.016, the fourth no name; without
    what surfaces answer to it the last two, at 1 Hz, have no name."""
    assert explain([flown(None, seed, every)], hypotheses=FEW).verdict is Verdict.NONE


@pytest.mark.parametrize(
    "truth",
    [
        WeakCell(capacity_factor=0.93),
        pytest.param(SeriesResistance(resistance_ohm=0.004), marks=pytest.mark.long),
    ],
)
def test_what_shows_at_the_end_is_named(truth: AnyEffect) -> None:
    finding = explain([flown(truth, 0)], hypotheses=FEW)
    assert finding.verdict is Verdict.NAMED
    (effect,) = finding.effects
    assert effect.id == truth.id
    for number in effect.parameters:
        assert abs(number.value - getattr(truth, number.name)) < 4 * number.std
    assert finding.errors.held_out_after < 1.2 * finding.errors.noise


@pytest.mark.long
def test_a_cell_out_of_balance_is_named_alone_where_the_voltage_at_rest_told_the_charge() -> None:
    """That voltage says what the cells hold on average; the others hold more (here 2.8 %)."""
    truth = WeakCell(soc_offset=-0.12)
    told = told_by_rest(flown(truth, 12), truth)
    finding = explain([told], hypotheses=OF_CHARGE)
    (effect,) = finding.effects
    assert effect.id == truth.id
    for number in effect.parameters:
        assert abs(number.value - getattr(truth, number.name)) < 4 * number.std
