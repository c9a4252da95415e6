"""The short form: one step tells which effects are worth a fit, and which it cannot tell apart."""

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown
from twin.effects import AnyEffect, CurrentGain, SeriesResistance
from twin.mismatch import Verdict, explain
from twin.mismatch.fit import fit
from twin.mismatch.hypothesis import HYPOTHESES
from twin.mismatch.screen import alike, promised
from twin.mismatch.split import split

FEW = [
    h
    for h in HYPOTHESES
    if h.id in ("series_resistance", "film_resistance", "current_gain", "voltage_gain")
]


@pytest.mark.parametrize(
    "truth", [SeriesResistance(resistance_ohm=0.01), CurrentGain(gain=1.05)], ids=lambda e: e.id
)
def test_the_short_form_names_what_the_whole_one_does_by_a_single_fit(truth: AnyEffect) -> None:
    flight = flown([truth], seed=1, seconds=60.0)
    models: list[tuple[str, ...]] = []
    short = explain([flight], hypotheses=FEW, short=True, progress=models.append)
    assert models == [(), (short.effects[0].id,)]
    whole = explain([flight], hypotheses=FEW)
    (effect,) = short.effects
    assert truth.id in (effect.id, *effect.equivalent)
    assert short.verdict is Verdict.NAMED
    assert set(whole.effects[0].equivalent) <= {effect.id, *effect.equivalent}


def test_nothing_is_named_in_short_where_nothing_is_left_out() -> None:
    assert explain([flown(seed=1)], hypotheses=FEW, short=True).verdict is Verdict.NONE


def test_one_step_gains_what_a_fit_gains_where_the_twin_is_nearly_linear() -> None:
    data = split([flown([SeriesResistance(resistance_ohm=0.002)], seed=1, seconds=60.0)], [])
    h = next(h for h in FEW if h.id == "series_resistance")
    fitted = fit(data, [h])
    r, j = fitted.problem.linearised(fitted.q)
    evidence = -0.5 * (float(r @ r) + float(np.linalg.slogdet(j.T @ j)[1]))
    null = data.problems(())[0]
    gained = evidence + null.cost(np.zeros(null.size))
    assert promised(data, [h])[h.id] == pytest.approx(gained, rel=0.01)


def test_what_comes_near_is_alike_the_nearer_the_less_was_gained() -> None:
    assert alike({"a": 100.0, "b": 98.0, "c": 96.0}) == ("b",)
    assert alike({"a": 1000.0, "b": 998.0, "c": 993.0}) == ("b", "c")
    assert alike({"a": 5.0}) == ()
