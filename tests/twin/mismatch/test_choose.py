"""Which effects are fitted: what a linearised twin promises, and what it may miss."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import discharged, flown
from twin.builtin import load_cell
from twin.effects import (
    ClockShift,
    CurrentGain,
    SelfHeating,
    SensorLag,
    SeriesResistance,
    SolidDiffusionNegative,
    SolidDiffusionPositive,
)
from twin.mismatch import choose
from twin.mismatch.fit import Data, Fitted, Known, fit
from twin.mismatch.hypothesis import HYPOTHESES, Hypothesis
from twin.mismatch.problem import Problem
from twin.mismatch.split import split
from twin.pack import Pack


def test_an_effect_under_which_the_twin_bends_is_fitted_whatever_it_promises() -> None:
    """Slow particles promise a ninth of what they take, and lost lithium most of that.

    Only the latter was fitted, and named.
    """
    truth = [SolidDiffusionNegative(diffusivity_factor=0.3)]
    data = split(*([flown(truth, seed=seed, noise_V=20e-3)] for seed in (1, 2)))
    rivals = ("lithium_inventory_loss", "solid_diffusion_negative")
    found = choose.models(data, [h for h in HYPOTHESES if h.id in rivals])
    assert found[0].ids == ("solid_diffusion_negative",)


@pytest.mark.long
def test_of_larger_models_that_is_tried_first_which_would_leave_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And not whichever has least to lose by what the smaller ones leave."""
    monkeypatch.setattr(choose, "TRIED", 1)
    truth = [SolidDiffusionPositive(diffusivity_factor=0.5), CurrentGain(gain=1.05)]
    rivals = (
        "weak_cell", "cold_pack", "active_material_loss_positive", "lithium_inventory_loss",
        "solid_diffusion_negative", "leakage", "ocv_hysteresis",
    )  # fmt: skip
    several = [h for h in HYPOTHESES if h.id in (*rivals, *(e.id for e in truth))]
    data = split([flown(truth, seed=1)], [flown(truth, seed=2)])
    pairs = [m.ids for m in choose.models(data, several, most_effects=2) if len(m.ids) == 2]
    assert ("current_gain", "solid_diffusion_positive") in pairs


@pytest.mark.parametrize(
    ("rates", "stated_V", "promised"),
    [((2.5, 2.0), 0.08, 0.45), ((2.0, 2.5), 0.12, 0.3)],
    ids=["far from what is fitted", "hardly seen in what is fitted"],
)
def test_an_effect_that_promises_little_is_fitted_still(
    rates: tuple[float, float], stated_V: float, promised: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cell that is not warmed is empty at two thirds of 2.5C; at 2C not yet.

    A wrong gain leaves no more than the twin is stated to err by, so nothing seems to be missing.
    """
    real = choose._promise

    def stingy(base: Fitted, h: Hypothesis, shapes: Sequence[choose.Shape]) -> choose.Promise:
        own = real(base, h, shapes)
        if h.id != "self_heating":
            return own
        return replace(own, left=(1 - promised) * choose._squares(base), log_evidence=-np.inf)

    monkeypatch.setattr(choose, "_promise", stingy)
    isothermal = Pack(cell=load_cell("lg_m50"))
    warm = replace(isothermal, effects=(SelfHeating(heat_transfer_W_m2_K=10.0),))
    flights = [discharged(isothermal, warm, seed, rate) for seed, rate in enumerate(rates)]
    few = [h for h in HYPOTHESES if h.id in ("current_gain", "self_heating")]
    found = choose.models(split(flights[:1], flights[1:], slow_V=stated_V), few)
    assert [m.ids for m in found[:2]] == [("self_heating",), ("current_gain",)]
    assert found[0].fitted.held_out_rms_V() < 0.1 * found[1].fitted.held_out_rms_V()


def test_what_may_win_is_said_by_squares_also_where_tails_are_heavy() -> None:
    """By Huber's loss the linearised twin promises little of what is far.

    With it only the heat and a gain were fitted.
    """
    isothermal = Pack(cell=load_cell("lg_m50"))
    warm = replace(isothermal, effects=(SelfHeating(heat_transfer_W_m2_K=10.0),))
    flights = [discharged(isothermal, warm, seed, rate) for seed, rate in enumerate((2.5, 2.0))]
    rivals = ("current_gain", "self_heating", "cold_pack", "electrolyte_transport")
    few = [h for h in HYPOTHESES if h.id in rivals]
    found = choose.models(split(flights[:1], flights[1:], slow_V=0.08), few)
    assert found[0].ids == ("self_heating",)
    assert ("electrolyte_transport",) in [m.ids for m in found]


def test_an_effect_of_many_starts_promises_what_it_may_keep_about_one() -> None:
    """No clock is early and late at once, though two shifts together would explain the voltage."""
    shifts = [flown([ClockShift(shift_s=shift)], seed=1) for shift in (-2.5, 2.5)]
    both = replace(shifts[0], voltage_V=np.mean([own.voltage_V for own in shifts], axis=0))
    data = split([both], [both])
    clock = next(h for h in HYPOTHESES if h.id == "clock_shift")
    null, alone = fit(data, []), fit(data, [clock])
    promise = choose._promise(null, clock, choose.shapes_of(data.problems([clock])[0], null))
    possible = choose._squares(null) - choose._squares(alone)
    assert choose._squares(null) - promise.left < 2.5 * possible


def test_what_extends_the_best_is_tried_whatever_else_promises_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Combinations with a clock had promised so much that none with the lag was fitted."""
    monkeypatch.setattr(choose._Looked, "together", lambda *_: None)
    truth = [SensorLag(lag_s=0.5), SeriesResistance(resistance_ohm=0.01)]
    few = [h for h in HYPOTHESES if h.id in {"sensor_lag", "series_resistance", "clock_shift"}]
    data = split([flown(truth, seed=1)], [flown(truth, seed=2)])
    assert choose.models(data, few)[0].ids == ("sensor_lag", "series_resistance")
    assert max(len(m.ids) for m in choose.models(data, few, most_effects=1)) == 1


def test_a_larger_model_begins_at_what_it_lacks_as_if_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A clock that was right beside nothing was lost beside reactions: no start of it was near.

    One alone begins at its own starts, and several are followed: a bad contact of one cell was lost
    where only that which missed least was.
    """
    begun: dict[tuple[str, ...], list[set[str]]] = {}

    def watched(data: Data, chosen: list[Hypothesis], known: list[Known], *more: Problem) -> Fitted:
        begun[tuple(h.id for h in chosen)] = [set(numbers) for numbers in known]
        return fit(data, chosen, known, *more)

    monkeypatch.setattr(choose, "fit", watched)
    truth = [ClockShift(shift_s=-0.4), CurrentGain(gain=1.05)]
    few = [h for h in HYPOTHESES if h.id in {e.id for e in truth}]
    data = split([flown(truth, seed=1)], [flown(truth, seed=2)])
    assert choose.models(data, few)[0].ids == ("clock_shift", "current_gain")
    both = {"clock_shift", "current_gain"}
    assert sorted(map(len, begun["clock_shift", "current_gain"])) == [1, 2]
    assert both in begun["clock_shift", "current_gain"]
    assert begun["clock_shift",] == begun["current_gain",] == []
