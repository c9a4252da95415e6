"""Trials whose start no pack file states: a rest before take-off tells it."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from analyze.checks import checked_pack
from analyze.workbench.drawn import Ask, read_drawn
from proof.question import PACK
from proof.simulated import draw as drawing
from proof.simulated.configured import Configured
from proof.simulated.draw import ABOVE, FULL_SOC, REST_S, STATED, Drawn, draw
from proof.simulated.faults import FAULTS, Traces
from proof.simulated.flights import TrueFlight, true_flight
from proof.simulated.rest import Rest, read
from twin.at_rest import OVERFULL

TOLD = Configured(
    cell="lipo_2200", series=4, parallel=1, start_soc=0.97, start_K=293.15, ambient_K=293.15
)
REST = Rest(soc=0.97, seconds=20.0, idle_A=0.0)


def test_one_log_in_six_has_its_start_told_by_a_rest_where_that_can_be_asked() -> None:
    drawn = draw(4, 300)
    rested = [d for d in drawn if d.told_by_rest]
    assert 0.11 < len(rested) / 300 < 0.22
    assert all(STATED.isdisjoint(d.effects) and d.before == 0.0 for d in rested)
    full = np.array([d.told.start_soc for d in rested if ABOVE.isdisjoint(d.effects)])
    above = [d.told.start_soc for d in rested if not ABOVE.isdisjoint(d.effects)]
    assert 0.91 <= min(above) < max(above) <= 0.96
    assert FULL_SOC[0] <= full.min() < 0.96 < 0.99 < full.max() <= FULL_SOC[1]
    rests = [d.told_by_rest for d in rested if d.told_by_rest]
    assert all(rest.soc == d.told.start_soc for rest, d in zip(rests, rested, strict=True))
    assert all(REST_S[0] <= rest.seconds <= REST_S[1] for rest in rests)
    assert 0.3 < np.mean([rest.idle_A == 0.0 for rest in rests]) < 0.7


def test_another_way_is_told_by_a_rest_too_unless_its_pack_is_not_full() -> None:
    others = [d.otherwise(k) for d in draw(4, 300) if d.rest for k in (1, 2, 3)]
    assert {d.told.cell for d in others} == {"lipo_2200", "lg_m50"}
    for d in others:
        assert (d.told_by_rest is None) == (d.told.cell == "lg_m50")
        assert d.told.start_soc == (d.told_by_rest.soc if d.told_by_rest else 0.6)


def test_all_else_of_a_seeds_trials_is_as_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with_it = draw(4, 300)
    monkeypatch.setattr(drawing, "_rest", lambda *_: None)  # draws nothing either
    for one, plain in zip(with_it, draw(4, 300), strict=True):
        assert plain.rest is None
        stated = replace(one.told, start_soc=plain.told.start_soc)
        assert replace(one, rest=None, told=stated) == plain
        assert one.told_by_rest or one.told == plain.told


def flown(rest: Rest = REST, told: Configured = TOLD) -> tuple[TrueFlight, Traces]:
    """A flight after its rest, of a pack that is as the twin believes."""
    whole = true_flight("hover", 1, full_C=told.full_C, drawn=(0.7, 0.7))
    flight = rest.before(whole)
    t, current_A = flight.time_s, flight.current_A
    return flight, Traces(
        time_s=t, current_A=current_A, voltage_V=told.voltage_V(t, current_A),
        drawn=np.linspace(0.0, 0.7, t.size), seed=1,
    )  # fmt: skip


def test_a_rest_comes_before_all_of_the_flight() -> None:
    whole = true_flight("hover", 1, full_C=7920.0, drawn=(0.7, 0.7))
    flight = replace(REST, idle_A=0.3).before(whole)
    assert flight.time_s == pytest.approx(0.1 * np.arange(whole.time_s.size + 200))
    assert np.array_equal(flight.current_A[:200], np.full(200, 0.3))
    assert set(flight.motion[:200]) == {"ground"}
    assert np.array_equal(flight.current_A[200:], whole.current_A)
    assert np.array_equal(flight.motion[200:], whole.motion)
    assert (whole.rest_s, flight.rest_s) == (0.0, 20.0)


@pytest.mark.parametrize("idle_A", [0.0, 0.4])
def test_an_effect_is_as_strong_as_beside_the_start_that_is_read(idle_A: float) -> None:
    """A sensor that reads 0.4 % high shows a fuller pack: half of it is gone in that start."""
    pytest.importorskip("pybamm", reason="PyBaMM makes the truths")
    from proof.simulated.flown import Flown
    from proof.simulated.strength import known_start, missed_V

    flight, seen = flown(replace(REST, idle_A=idle_A))
    plain = Flown(
        recorded=seen, cells_V=seen.voltage_V[None], temperature_K=seen.time_s, flight=flight
    )
    assert missed_V(TOLD, plain) < 6e-3  # slow losses of 0.4 A lower what is read by 1 mV a cell
    high = replace(plain, recorded=FAULTS["voltage_gain"](seen, 4e-3))
    stated = replace(high, flight=replace(flight, rest_s=0.0))
    assert missed_V(TOLD, high) < 0.7 * missed_V(TOLD, stated)
    start = known_start(TOLD, high.recorded)
    assert start.soc_by_rest
    assert start.start_soc == pytest.approx(0.97 + 0.017, abs=2e-3)
    left_V = high.recorded.voltage_V - start.voltage_V(seen.time_s, seen.current_A)
    assert missed_V(TOLD, high) == pytest.approx(float(np.sqrt(np.mean(left_V**2))))


def test_a_rest_that_is_taken_for_none_is_out_of_reach() -> None:
    """By an offset of the current, half a C and more of which is no idling."""
    pytest.importorskip("pybamm", reason="PyBaMM makes the truths")
    from proof.simulated.solves import OutOfReachError
    from proof.simulated.strength import known_start

    _, seen = flown()
    assert known_start(TOLD, FAULTS["current_offset"](seen, 0.3)).start_soc > 0.95
    with pytest.raises(OutOfReachError, match=r"1\.20 A is taken for none"):
        known_start(TOLD, FAULTS["current_offset"](seen, 1.2))


def test_no_charger_leaves_a_pack_that_rests_above_a_full_one_whatever_a_sensor_shows() -> None:
    pytest.importorskip("pybamm", reason="PyBaMM makes the truths")
    from proof.simulated.flown import Flown
    from proof.simulated.solves import OutOfReachError
    from proof.simulated.strength import missed_V

    flight, seen = flown()
    high = FAULTS["voltage_gain"](seen, 0.02)
    sensor, pack = (
        Flown(recorded=high, cells_V=v[None], temperature_K=seen.time_s, flight=flight)
        for v in (seen.voltage_V, high.voltage_V)
    )
    assert missed_V(TOLD, sensor) > 0.1
    with pytest.raises(OutOfReachError, match=r"4\.254 V a cell: a charger stops at 4\.200"):
        missed_V(TOLD, pack)


def test_a_sensor_that_reads_high_shows_more_than_a_full_pack_which_starts_full() -> None:
    told = replace(TOLD, start_soc=0.995)
    _, seen = flown(told=told)
    high = FAULTS["voltage_gain"](seen, 8e-3)
    start = read(told, high.time_s, high.current_A, high.voltage_V)
    assert start is not None
    assert 1.0 < start.start_soc <= OVERFULL
    full = start.pack().numbers()["initial_soc"]
    assert full == pytest.approx(1.0, abs=3e-4)  # 5 K below the reference it rests 0.2 mV off


@pytest.mark.parametrize("idle_A", [0.0, 0.4])
def test_the_judge_reads_the_start_of_a_control_as_it_is(
    idle_A: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the files that it gets; half a minute of a flight by PyBaMM."""
    pytest.importorskip("pybamm", reason="PyBaMM makes the truths")
    from proof.simulated import make as making

    monkeypatch.setattr(making, "true_flight", partial(_beginning, seconds=30.0))
    drawn = _control(replace(REST, idle_A=idle_A))
    question, truth = making.make(drawn, tmp_path / "solves")
    assert truth.details is not None
    assert truth.details["told by rest"] == 20.0
    assert truth.strength < 0.5
    question.write(tmp_path)
    assert "soc" not in (tmp_path / PACK).read_text(encoding="utf-8")
    for r in (*question.fitted, *question.held_out):
        ask = Ask(
            source=tmp_path / f"{r.name}.csv", pack=tmp_path / PACK, out=tmp_path,
            between="linear", sensor=None, battery=None,
        )  # fmt: skip
        given = read_drawn(ask, checked_pack(tmp_path / PACK))
        assert given.pack.soc_by_rest
        assert given.pack.initial_soc == pytest.approx(0.97, abs=2.5 * given.use.soc_std)
        assert given.use.soc_std < 0.01
        if r is question.fitted[0]:
            assert question.pack.initial_soc == given.pack.initial_soc


def _control(rest: Rest) -> Drawn:
    """Of a pack of TOLD."""
    control = next(d for d in draw(4, 300) if d.kind == "control" and len(d.flights) == 2)
    return replace(control, told=TOLD, rest=rest, begun=0.0, plan="hover")


def _beginning(
    plan: str, seed: int, *, full_C: float, drawn: tuple[float, float], seconds: float
) -> TrueFlight:
    """Of a true flight, so much."""
    whole = true_flight(plan, seed, full_C=full_C, drawn=drawn)
    n = round(seconds / 0.1)
    return replace(
        whole, time_s=whole.time_s[:n], current_A=whole.current_A[:n], motion=whole.motion[:n]
    )
