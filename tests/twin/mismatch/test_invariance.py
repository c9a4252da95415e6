"""What must not matter to a verdict, and what must lower its confidence; short, few hypotheses."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown
from twin.effects import CurrentGain, SeriesResistance
from twin.load import Load
from twin.mismatch import Finding, Flight, Verdict, explain
from twin.mismatch.hypothesis import HYPOTHESES

TRUTH = SeriesResistance(resistance_ohm=0.01)
FEW = [h for h in HYPOTHESES if h.id in ("series_resistance", "current_gain")]


def flight(seed: int, seconds: float = 60.0) -> Flight:
    return flown([TRUTH], seed=seed, seconds=seconds)


def found(*flights: Flight, ahead: tuple[Flight, ...] = ()) -> Finding:
    return explain(flights, ahead, hypotheses=FEW)


def resistance(finding: Finding) -> tuple[float, float]:
    """Value and standard deviation."""
    assert finding.verdict is Verdict.NAMED
    (effect,) = finding.effects
    assert effect.id == "series_resistance"
    (value,) = effect.parameters
    return value.value, value.std


def test_the_order_of_flights_changes_nothing() -> None:
    one, two, last = flight(1), flight(2), flight(3)
    first, second = found(one, two, ahead=(last,)), found(two, one, ahead=(last,))
    assert resistance(first) == pytest.approx(resistance(second), rel=1e-4)
    assert [c.ids for c in first.candidates] == [c.ids for c in second.candidates]


def test_more_data_with_the_same_evidence_keeps_the_verdict_and_narrows_the_value() -> None:
    few, more = found(flight(1)), found(flight(1), flight(2), ahead=(flight(3),))
    (_, wide), (value, narrow) = resistance(few), resistance(more)
    assert narrow < wide
    assert value == pytest.approx(0.01, abs=4 * narrow + 0.001)  # as in test_explain: noise of I


@pytest.mark.parametrize("poor", ["1 Hz", "20 s"])
def test_a_poorer_recording_has_the_same_verdict_with_less_confidence(poor: str) -> None:
    whole = flight(1, 120.0)
    made = {"1 Hz": thinned(whole, 10), "20 s": flight(1, 20.0)}[poor]
    (value, sure), (other, less) = resistance(found(whole)), resistance(found(made))
    assert less > sure
    assert other == pytest.approx(value, abs=4 * less)


@pytest.mark.long
def test_a_gap_leaves_the_verdict_and_takes_confidence() -> None:
    """Which falls on average: each deviation is scaled by the variance and the correlation time of
    400 residuals, and those of nothing but noise scatter by a third, more than a gap takes."""
    sure, less = [], []
    for seed in (1, 2, 3, 4):
        whole = flight(seed, 120.0)
        t = whole.time_s
        seen_V = np.where((t < 30) | (t > 70), whole.voltage_V, np.nan)
        (value, std), (other, wider) = (
            resistance(found(own)) for own in (whole, replace(whole, voltage_V=seen_V))
        )
        assert other == pytest.approx(value, abs=4 * wider)
        sure.append(std)
        less.append(wider)
    assert np.mean(less) > np.mean(sure)


def thinned(own: Flight, every: int) -> Flight:
    """As a slower logger would have written it."""
    load = Load(time_s=own.time_s[::every], current_A=own.load.current_A[::every])
    return Flight(
        name=own.name,
        pack=own.pack,
        load=load,
        voltage_V=own.voltage_V[::every],
        judged=own.judged[::every],
        motion=own.motion[::every],
    )


def test_a_gain_in_one_of_two_flights_is_never_named_for_both() -> None:
    with_it, without = flown([CurrentGain(gain=1.1)], seed=1), flown(seed=2)
    finding = explain([with_it], [without], hypotheses=FEW)
    assert finding.verdict in (Verdict.AMBIGUOUS, Verdict.UNKNOWN)
