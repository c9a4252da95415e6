"""Recordings that stay unexplained together, and what each says alone."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from reports.mismatch.summary import errors_of, headline
from tests.twin.mismatch.recordings import flown
from tests.twin.mismatch.test_begun import late
from twin.effects import CurrentGain
from twin.mismatch import HYPOTHESES, Flight, Verdict, contradict, explain
from twin.mismatch.contradict import agree
from twin.mismatch.decide import Decision
from twin.mismatch.finding import NamedEffect, Value

GAINS = [h for h in HYPOTHESES if h.id == "current_gain"]


def shift(value: float, std: float = 0.01) -> tuple[Value, ...]:
    return (Value(name="shift_s", value=value, std=std, unit="s"),)


def said(effect: str, value: float, **instead: float) -> Any:
    alike = {name: shift(own) for name, own in instead.items()}
    named = NamedEffect(
        id=effect, pack_id=effect, probability=1.0, parameters=shift(value), instead=alike,
        equation="", source="", signature="",
    )  # fmt: skip
    return SimpleNamespace(effects=(named,) if effect else ())


@pytest.mark.parametrize(
    ("decisions", "alike"),
    [
        ([said("clock_shift", 0.08), said("clock_shift", 0.10)], True),
        ([said("clock_shift", 0.08), said("clock_shift", 0.13)], False),
        ([said("clock_shift", 0.08), said("clock_shift", 0.10), said("clock_shift", 0.13)], False),
        ([said("clock_shift", 0.08), said("sensor_lag", 0.08)], False),
        ([said("clock_shift", 0.08), said("sensor_lag", 0.2, clock_shift=0.10)], True),
        ([said("clock_shift", 0.08), said("sensor_lag", 0.08, clock_shift=0.13)], False),
        ([said("cold_pack", 1.0, clock_shift=0.1), said("sensor_lag", 0.2, clock_shift=0.1)], True),
        ([said("clock_shift", 0.08), said("", 0.0)], False),
        ([said("", 0.0), said("", 0.0)], True),
    ],
)
def test_what_agrees(decisions: list[Any], alike: bool) -> None:  # noqa: FBT001
    assert agree(cast(Any, decisions)) is alike


@pytest.mark.parametrize("recorded", [flown, late], ids=["from rest", "from in flight on"])
def test_recordings_of_two_sensors_are_ambiguous_and_each_is_told(
    recorded: Callable[..., Flight],
) -> None:
    """One reads 8 % too little, the other 8 % too much."""
    finding = explain(
        [recorded((CurrentGain(gain=1.08),), seed=1)],
        [recorded((CurrentGain(gain=0.92),), seed=2)],
        hypotheses=GAINS,
    )
    assert finding.verdict is Verdict.AMBIGUOUS
    assert [r.split(" with ")[0] for r in finding.remarks if " alone: " in r] == [
        "flight 1 alone: current_gain", "flight 2 alone: current_gain",
    ]  # fmt: skip
    assert finding.contradictory
    assert not any("is not named" in r for r in finding.remarks)
    said = headline(finding)
    assert said.startswith("The recordings contradict each other")
    assert "gain of the current sensor is in some and not in others" in said
    assert [twin for twin, _ in errors_of(finding)] == ["as configured"]


@pytest.mark.parametrize(
    ("shifts_s", "verdict"), [((0.08, 0.1), Verdict.UNKNOWN), ((0.08, 0.2), Verdict.AMBIGUOUS)]
)
def test_what_all_say_alike_and_is_not_so_together_stays_unknown(
    shifts_s: tuple[float, float], verdict: Verdict, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a double layer, which the library lacks, is a clock to each recording alone."""
    alone = iter(
        Decision(
            verdict=Verdict.NAMED, model=cast(Any, None), effects=said("clock_shift", s).effects
        )
        for s in shifts_s
    )
    monkeypatch.setattr(contradict, "search", lambda data, *_, **__: (data, ()))
    monkeypatch.setattr(contradict, "scale_of", lambda _: 1.0)
    monkeypatch.setattr(contradict, "decide", lambda *_, **__: next(alone))
    together = Decision(verdict=Verdict.UNKNOWN, model=cast(Any, None), effects=())
    told, remarks = contradict.contradiction(
        together, [flown(seed=1), flown(seed=2)], (), slow_V=None, progress=lambda _: None
    )
    assert told.verdict is verdict
    assert len(remarks) == (2 if verdict is Verdict.AMBIGUOUS else 0)
    for e in told.effects:  # of all, not of the last
        (shift,) = e.parameters
        assert shift.value == pytest.approx(np.mean(shifts_s))
        assert shift.std == pytest.approx(np.hypot(0.01, np.std(shifts_s)))
