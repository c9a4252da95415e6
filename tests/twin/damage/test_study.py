"""The flight as it was flown, and the life of a pack, against what they must agree with."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import PchipInterpolator

from twin.ageing import Aged, Regime, age
from twin.builtin import load_cell
from twin.damage import (
    MEASURES,
    TEMPERATURE,
    Manoeuvre,
    Mix,
    Part,
    Piece,
    Protocol,
    Span,
    Study,
    Waveform,
    ageing,
    assess,
    attribute,
    constant,
    cycle,
    life,
    project,
    study,
)
from twin.damage.attribution import between, started
from twin.damage.cost import total
from twin.damage.lives import _by_pack
from twin.damage.loss import Ledger
from twin.damage.orders import orders
from twin.damage.study import widened
from twin.effects import (
    AGEING,
    ActiveMaterialLoss,
    AnyEffect,
    ClockShift,
    ColdPack,
    InitialSoc,
    Sei,
    SelfHeating,
    SensorLag,
    WeakCell,
)
from twin.load import Load
from twin.pack import Pack
from twin.simulate import flowed, simulate
from twin.solution import Status

SAMPLE_S = 0.25
LEGS = (("hover", 25.0, 15.0, 0.3), ("vertical", 20.0, 17.0, 6.0), ("horizontal", 30.0, 16.0, 1.5))


def leg(number: int, name: str) -> npt.NDArray[np.float64]:
    """Samples of one segment: no two are alike, strokes are 8 to 10 s long."""
    _, seconds, mean_A, swing_A = next(leg for leg in LEGS if leg[0] == name)
    t = np.arange(0.0, seconds, SAMPLE_S)
    noise = np.random.default_rng(number).standard_normal(t.size)
    stroke = np.sign(np.sin(2 * np.pi * t / (8 + number % 3)))
    return mean_A + 0.05 * (number - 4) + swing_A * stroke + 0.4 * noise


NAMES = [name for _ in range(3) for name, *_ in LEGS]
PARTS = [leg(k, name) for k, name in enumerate(NAMES)]


def flight(order: list[int]) -> tuple[Load, list[Span]]:
    """The segments one after the other."""
    current = np.concatenate([PARTS[k] for k in order])
    ends = SAMPLE_S * np.cumsum([0, *(PARTS[k].size for k in order)])
    load = Load(time_s=np.arange(current.size + 1.0) * SAMPLE_S, current_A=np.append(current, 1.0))
    spans = [
        Span(name=NAMES[k], start_s=float(a), stop_s=float(b))
        for k, a, b in zip(order, ends[:-1], ends[1:], strict=True)
    ]
    return load, spans


def manoeuvre(name: str) -> Manoeuvre:
    own = [part for part, n in zip(PARTS, NAMES, strict=True) if n == name]
    pieces = tuple(Piece(current_A=p, sample_s=SAMPLE_S) for p in own)
    wave = Waveform(current_A=np.concatenate(own), sample_s=SAMPLE_S)
    return Manoeuvre(name=name, waveform=wave, pieces=pieces)


@pytest.fixture(scope="module")
def pack() -> Pack:
    return Pack(cell=load_cell("lipo_2200"), series=4, initial_soc=0.95, initial_K=300.0)


@pytest.fixture(scope="module")
def whole(pack: Pack) -> Study:
    load, spans = flight(list(range(9)))
    return study(pack, load, [manoeuvre(name) for name, *_ in LEGS], spans)


def test_the_spans_add_up_to_the_flight(whole: Study, pack: Pack) -> None:
    flown = whole.attribution
    load, _ = flight(list(range(9)))
    parts = total(flown.costs)
    assert flown.status is Status.DONE
    assert parts.drawn_C == pytest.approx(load.charge_C(), rel=1e-12)
    for of in MEASURES.values():
        assert of(parts.loss) == pytest.approx(of(flown.whole.loss), rel=1e-9)
    ledger, full = Ledger(ageing(pack)), whole.assessment.baselines.reference.end_state
    state = started(ageing(pack), full, load.ambient_K)
    once = simulate(ageing(pack), load, state=state).require()
    lost = ledger.loss(once.end_state) - ledger.loss(state)
    assert flown.whole.loss.inventory_C == pytest.approx(lost.inventory_C, rel=1e-6)
    assert lost.inventory_C + lost.plated_C == pytest.approx(lost.lithium_C, abs=1e-7)


def test_a_flight_starts_with_its_own_charge_and_temperature(whole: Study, pack: Pack) -> None:
    full = whole.assessment.baselines.reference.end_state
    state = started(ageing(pack), full, 298.15)
    first = simulate(ageing(pack), Load(time_s=np.zeros(1), current_A=np.zeros(1)), state=state)
    assert float(first.soc[0]) == pytest.approx(0.95, abs=1e-3)  # some plated lithium returns
    assert float(first.temperature_K[0]) == 300.0


def test_a_flight_starts_with_the_charge_and_temperature_that_were_found(
    whole: Study, pack: Pack
) -> None:
    full = whole.assessment.baselines.reference.end_state
    found = InitialSoc(offset=-0.25), ColdPack(start_offset_K=-15.0)
    own = replace(ageing(pack), effects=(*ageing(pack).effects, *found))
    state = started(own, full, 298.15)
    first = simulate(own, Load(time_s=np.zeros(1), current_A=np.zeros(1)), state=state)
    assert first.soc[0] == pytest.approx(0.70, abs=1e-3)  # some plated lithium returns
    assert first.temperature_K[0] == pytest.approx(285.0)


def test_a_motion_flown_from_full_to_empty_costs_the_same_in_both_views(
    whole: Study, pack: Pack
) -> None:
    """Where charge and temperature are the same, so is the damage: they are what differs."""
    full = whole.assessment.baselines.reference.end_state
    m = manoeuvre("vertical")
    load = m.waveform.load(7000.0, 298.15)
    span = Span(name="vertical", start_s=0.0, stop_s=float(load.time_s[-1]))
    again = attribute(
        replace(ageing(pack), initial_soc=1.0, initial_K=298.15),
        load,
        [span],
        formed=full,
        waveforms={"vertical": m.waveform},
    )
    for name, of in MEASURES.items():
        flown, repeated = again.by_name()["vertical"], again.repeated["vertical"]
        share = of(flown.loss) / flown.drawn_C * repeated.drawn_C / of(repeated.loss)
        if name != "positive":  # under pressure all the way: nothing is lost
            assert share == pytest.approx(1.0, abs=0.1), name  # the last tenth was left out


@pytest.mark.parametrize("order", [[2, 0, 1, 5, 3, 4, 8, 6, 7], [0, 7, 5, 6, 4, 2, 3, 1, 8]])
def test_the_order_of_segments_changes_less_than_the_stated_interval(
    whole: Study, pack: Pack, order: list[int]
) -> None:
    load, spans = flight(order)
    full = whole.assessment.baselines.reference.end_state
    other = attribute(ageing(pack), load, spans, formed=full, waveforms={})
    for name, cost in whole.attribution.by_name().items():
        for measure in ("lithium", "sei", "sei_on_cracks", "negative"):
            of, moved = MEASURES[measure], other.by_name()[name]
            change = (of(moved.loss) / moved.drawn_C) / (of(cost.loss) / cost.drawn_C) - 1
            half = whole.attribution.order_error(name, measure).half_95
            assert abs(change) < half < 1.0, (name, measure, change, half)


def test_other_orders_are_of_the_same_segments_and_a_take_off_stays_first(pack: Pack) -> None:
    load, spans = flight(list(range(9)))
    fixed = [replace(spans[0], movable=False), *spans[1:]]
    full = cycle(ageing(pack), constant(16.0, 1.0), Protocol(cycles=1)).end_state
    flown = attribute(ageing(pack), load, fixed, formed=full, waveforms={})
    assert len(flown.orders) == 8
    for costs in flown.orders:
        assert costs[0] == flown.costs[0]
        drawn = [c.drawn_C for c in costs], [c.drawn_C for c in flown.costs]
        np.testing.assert_allclose(*drawn, rtol=1e-9)
        assert costs[1:] != flown.costs[1:]
    assert np.isnan(replace(flown, orders=()).order_error("hover", "lithium").half_95)


@pytest.mark.parametrize(("count", "expected"), [(0, 0), (1, 0), (2, 1), (3, 5), (4, 8)])
def test_orders_are_different_and_none_is_the_one_there_is(count: int, expected: int) -> None:
    found = orders(count)
    assert len(set(found)) == len(found) == expected
    assert tuple(range(count)) not in found


def test_a_flight_the_pack_cannot_finish_is_told_as_far_as_it_came(
    whole: Study, pack: Pack
) -> None:
    load, spans = flight(list(range(9)))
    empty = replace(ageing(pack), initial_soc=0.3)
    full = whole.assessment.baselines.reference.end_state
    flown = attribute(empty, load, spans, formed=full, waveforms={})
    assert flown.status is Status.LOWER_CUT_OFF
    assert 0 < len(flown.costs) < len(spans)
    assert flown.whole.drawn_C < load.charge_C()


@pytest.mark.parametrize("sensor", [ClockShift(shift_s=-1.0), SensorLag(lag_s=1.0)])
def test_a_late_clock_is_late_across_the_ends_of_a_span_too(
    whole: Study, pack: Pack, sensor: AnyEffect
) -> None:
    """20 A after 12: shifted piece by piece, 5 % of the charge is told of the wrong motion."""
    times = np.arange(0.0, 20.0, 0.25)
    load = Load(time_s=times, current_A=np.where(times < 10.0, 12.0, 20.0))
    spans = [Span(name=n, start_s=a, stop_s=a + 10.0) for n, a in (("hover", 0.0), ("climb", 10.0))]
    own = ageing(replace(pack, effects=(sensor,)))
    full = whole.assessment.baselines.reference.end_state
    flown = attribute(own, load, spans, formed=full, waveforms={})
    parts = [between(flowed(own, load), *ends) for ends in ((0.0, 10.0), (10.0, times[-1]))]
    assert [c.drawn_C for c in flown.costs] == pytest.approx([p.charge_C() for p in parts])
    assert flown.whole.drawn_C == pytest.approx(flowed(own, load).charge_C())


def test_unlike_cells_start_with_the_charge_of_their_mean(pack: Pack) -> None:
    weak = WeakCell(cell=2, soc_offset=-0.2)
    own = ageing(replace(pack, initial_soc=0.8, effects=(weak,)))
    full = cycle(own, constant(16.0, 1.0), Protocol(cycles=1)).end_state
    state = started(own, full, 298.15)
    first = simulate(own, Load(time_s=np.zeros(1), current_A=np.zeros(1)), state=state)
    assert first.soc[0] == pytest.approx(0.75, abs=2e-3)  # some plated lithium returns


def test_a_part_of_a_load_has_its_current() -> None:
    load = Load(time_s=np.array([0.0, 1.0, 3.0]), current_A=np.array([0.0, 2.0, 4.0]))
    part = between(load, 0.5, 2.0)
    np.testing.assert_allclose(part.time_s, [0.5, 1.0, 2.0])
    np.testing.assert_allclose(part.current_A, [1.0, 2.0, 3.0])


def test_quick_is_without_counterfactuals_and_lives(whole: Study) -> None:
    assert whole.lives is None
    assert not any(own.counterfactuals for own in whole.assessment.motions.values())


def test_what_drives_the_damage_is_seen_by_leaving_it(pack: Pack) -> None:
    found = assess(pack, [manoeuvre("vertical")], Protocol(cycles=1), counterfactuals=True)
    own = found.motions["vertical"]
    assert set(own.counterfactuals) == {"peaks", "ripple", "ramps", "duty", TEMPERATURE}
    assert own.without(TEMPERATURE, "sei") > 0.1  # warmth makes films grow
    assert own.without("peaks", "sei") > 2e-3  # and peaks make warmth, the charge apart
    assert own.counterfactuals[TEMPERATURE].flight.max_K == pytest.approx(298.15)


def test_a_pack_lasts_fewer_flights_if_it_stands_for_days(pack: Pack) -> None:
    load, _ = flight([0, 1, 2, 3, 4, 5])
    aged = ageing(pack)
    fast = replace(aged, effects=tuple(quicker(e) for e in aged.effects))
    found = project(aged, Mix(load=load, motions={}, drawn_C={}), others=[aged, fast], share=0.985)
    assert 0 < found.daily.reached < 0.5 * found.soon.reached
    steps = found.soon.projection.error / found.soon.reached
    by_pack = np.sqrt((found.soon.error.std**2 - steps**2) * 2)  # one of two packs is the same
    shorter = life(fast, Regime(load=load, rest_s=1800.0), share=0.985).reached / found.soon.reached
    assert by_pack == pytest.approx(-np.log(shorter), rel=0.05)
    assert found.soon.interval_95[0] < found.soon.reached * shorter
    assert load.charge_C() / load.time_s[-1] < found.most_A < load.current_A.max()
    assert found.gentle.reached == pytest.approx(found.soon.reached, rel=0.1)


def quicker(effect: AnyEffect) -> AnyEffect:
    """The SEI grows four times as fast."""
    if not isinstance(effect, Sei):
        return effect
    return replace(effect, solvent_diffusivity_m2_s=4 * 2.5e-22)


def test_ratios_are_as_uncertain_as_other_packs_make_them(pack: Pack) -> None:
    """Those that lose something: one of them loses nothing, of which there is no ratio."""
    motion = manoeuvre("vertical")
    found = assess(pack, [motion], Protocol(cycles=1))
    fast = replace(found.pack, effects=tuple(quicker(e) for e in found.pack.effects))
    other = assess(fast, [replace(motion, pieces=())], Protocol(cycles=1)).motions["vertical"]
    effects = (replace(e, strength=0.0) if isinstance(e, AGEING) else e for e in fast.effects)
    still = replace(fast, effects=tuple(effects))
    wide = widened(found, [found.pack, fast, still]).motions["vertical"]
    for measure in ("lithium", "sei", "negative"):
        own, there, told = (
            m.excess[Part.WHOLE][measure] for m in (found.motions["vertical"], other, wide)
        )
        away = abs(there.value - own.value) / 2**0.5  # the other of the two is the pack itself
        assert told.value == own.value
        assert told.error.std == pytest.approx(np.hypot(own.error.std, away), rel=1e-6)


def test_a_projected_life_is_the_life_that_is_simulated(pack: Pack) -> None:
    quick = (Sei(solvent_diffusivity_m2_s=30 * 2.5e-22), ActiveMaterialLoss(rate_1_s=3e-5))
    worn = ageing(replace(pack, initial_soc=1.0, effects=quick))
    regime = Regime(load=constant(16.0, 1.0).load(5000.0, 298.15), rest_s=600.0)
    told = life(worn, regime, share=0.9)
    lived = islice(age(worn, regime), int(told.reached) + 3)
    capacity = np.array([a.cycle.health.capacity_C for a in lived])
    reached = np.interp(-0.9 * capacity[0], -capacity, np.arange(capacity.size))
    assert told.reached == pytest.approx(reached, rel=0.02)
    assert abs(told.reached - reached) < told.error


def test_a_life_in_the_cold_is_projected_to_its_steep_end(
    pack: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gradients take many cycles to settle, and of 740 flights the last 50 take a tenth."""
    cold = ageing(replace(pack, initial_K=283.0))
    regime = Regime(load=constant(8.2, 1.0).load(1450.0, 283.0))
    told = life(cold, regime)
    monkeypatch.setattr("twin.damage.projection.STEP_SHARE", 0.03)
    fine = life(cold, regime)
    assert told.reached == pytest.approx(fine.reached, rel=0.03)
    assert abs(told.reached - fine.reached) < told.error


def test_a_life_that_cannot_go_on_says_why(pack: Pack) -> None:
    quick = (ActiveMaterialLoss(rate_1_s=3e-5),)
    worn = ageing(replace(pack, initial_soc=1.0, effects=quick))
    most_C = cycle(worn, constant(16.0, 1.0), Protocol(cycles=1)).drawn_C
    told = life(worn, Regime(load=constant(16.0, 1.0).load(0.99 * most_C, 298.15), rest_s=0.0))
    assert np.isnan(told.reached)
    assert "in the flight" in told.ended


@pytest.mark.parametrize(("last", "flights"), [(0, [0]), (1, [0]), (3, [0]), (4, [0, 3])])
def test_a_life_that_ends_in_its_first_cycles_says_why(
    pack: Pack, monkeypatch: pytest.MonkeyPatch, last: int, flights: list[int]
) -> None:
    """One drawn pack that was too weak cost the report of its flight."""

    def short(own: Pack, regime: Regime, *, after: Aged | None = None) -> Iterator[Aged]:
        for a in age(own, regime, after=after):
            if a.cycle.number == last:
                cut = {"status": Status.LOWER_CUT_OFF, "stopped_in": "flight"}
                yield replace(a, cycle=replace(a.cycle, **cut))
                return
            yield a

    monkeypatch.setattr("twin.damage.projection.age", short)
    regime = Regime(load=constant(16.0, 1.0).load(800.0, 298.15))
    told = life(ageing(pack), regime)
    assert np.isnan(told.reached)
    assert told.ended.startswith("in the flight ")
    assert told.flights.tolist() == flights
    assert np.isfinite(_by_pack(replace(told, reached=100.0), [told]).std)


def test_films_are_carried_over_hundreds_of_flights_as_roots(
    pack: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lithium lost to SEI alone, in three steps of up to 2000 flights, and in many small ones."""
    films = (Sei(solvent_diffusivity_m2_s=30 * 2.5e-22), SelfHeating())
    worn = replace(pack, initial_soc=1.0, effects=films)
    regime = Regime(load=constant(16.0, 1.0).load(5000.0, 298.15), rest_s=3600.0)
    monkeypatch.setattr("twin.damage.projection.STEP_SHARE", 0.02)
    many = life(worn, regime, share=0.86)
    monkeypatch.setattr("twin.damage.projection.STEP_SHARE", 0.5)
    few = life(worn, regime, share=0.9)
    inside = (few.flights > 0) & (few.flights < many.flights[-1])
    assert np.diff(few.flights[inside]).max() > 1000
    fine_C = PchipInterpolator(many.flights, many.capacity_C)(few.flights[inside])
    lost = [1 - c / many.capacity_C[0] for c in (few.capacity_C[inside], fine_C)]
    assert lost[0] == pytest.approx(lost[1], rel=0.01)  # straight on they are 11 % off
