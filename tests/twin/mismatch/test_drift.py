"""A voltage that drifts is no effect, and an effect is no drift."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown
from twin.effects import OcvHysteresis
from twin.mismatch import drift
from twin.mismatch.drift import drift_in
from twin.mismatch.explain import explain
from twin.mismatch.finding import Verdict
from twin.mismatch.fit import Data, fit
from twin.mismatch.flight import Flight
from twin.mismatch.hypothesis import HYPOTHESES, PRIOR
from twin.mismatch.noise import whitener
from twin.mismatch.split import split
from twin.mismatch.wander import Wander

FEW = [
    h
    for h in HYPOTHESES
    if h.id in ("current_gain", "initial_soc", "ocv_hysteresis", "voltage_gain")
]


def drifting(seed: int, end_V: float) -> Flight:
    flight = flown(seed=seed)
    return replace(flight, voltage_V=flight.voltage_V + np.linspace(0.0, end_V, flight.time_s.size))


def null_of(data: Data) -> float:
    fitted = fit(data, ())
    return fitted.log_evidence(1.0) - data.log_size


def test_without_any_size_a_drift_is_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """As probable as that nothing is left out, but for what was believed before."""
    monkeypatch.setattr(drift, "SHARES", (1e-9,))
    data = split([flown(seed=1), flown(seed=2)], [flown(seed=3)])
    null = fit(data, ())
    found = drift_in(data, null, 1.0)
    assert found.log_evidence == pytest.approx(null.log_evidence(1.0) + np.log(PRIOR), abs=0.5)
    assert found.all_said


@pytest.mark.parametrize("forgets_s", [100.0, 1000.0])
def test_it_is_as_probable_as_by_a_filter(
    forgets_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same wander as a state of the noise, and as ways of their own."""
    size_V = 0.03
    data = split([drifting(1, 0.03), drifting(2, 0.05)], [drifting(3, -0.04)])
    usual_V = float(np.mean([f.voltage_V.mean() for f, _ in data.fitted]))
    monkeypatch.setattr(drift, "SHARES", (size_V / usual_V,))
    monkeypatch.setattr(drift, "FORGETS_S", (forgets_s,))
    wander = Wander(size_V=size_V, forgets_s=forgets_s, damping=1.0)

    whole = [*data.fitted, *data.held_out]
    seen = [
        (f, whitener(f.time_s, f.judged, replace(w.noise, smooth=wander), f.load.current_A))
        for f, w in whole
    ]
    plain = [(f, whitener(f.time_s, f.judged, w.noise, f.load.current_A)) for f, w in whole]
    with_it, without = (Data(tuple(own[:2]), tuple(own[2:])) for own in (seen, plain))
    gained = null_of(with_it) - null_of(without)
    null = fit(without, ())
    by_ways = drift_in(without, null, 1.0).log_evidence - np.log(PRIOR) - null.log_evidence(1.0)
    assert gained > 100.0
    assert by_ways == pytest.approx(gained, rel=3e-3)


@pytest.mark.long
def test_sensors_that_drift_each_in_its_way_are_told_in_words() -> None:
    finding = explain([drifting(1, 0.03), drifting(2, 0.05)], [drifting(3, -0.04)], hypotheses=FEW)
    assert finding.verdict is not Verdict.NAMED
    assert any("A voltage that drifts slowly" in remark for remark in finding.remarks)


@pytest.mark.parametrize("end_V", [0.04, -0.06])
def test_a_drift_that_is_alike_in_all_flights_has_no_name(end_V: float) -> None:
    """Effects that shape themselves to it predict what was held out."""
    first, second, last = (drifting(seed, end_V) for seed in (1, 2, 3))
    finding = explain([first, second], [last], hypotheses=FEW)
    assert finding.verdict is Verdict.UNKNOWN
    (by_mV,) = (
        float(said.removeprefix("A voltage that drifts slowly, by ").partition(" ")[0])
        for said in finding.remarks
        if said.startswith("A voltage that drifts slowly")
    )
    assert by_mV == pytest.approx(1e3 * abs(end_V), rel=0.2)


def test_hysteresis_is_no_drift() -> None:
    """Though as slow."""
    truth = [OcvHysteresis(negative_amplitude_V=0.01, positive_amplitude_V=0.01)]
    first, second, last = (flown(truth, seed=seed) for seed in (1, 2, 3))
    finding = explain([first, second], [last], hypotheses=FEW)
    assert finding.verdict is Verdict.NAMED
    assert [e.id for e in finding.effects] == ["ocv_hysteresis"]
