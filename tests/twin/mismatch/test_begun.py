"""A recording that begins in flight: the twin begins at rest, the pack did not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.reference.loads import flight as reference_flight
from tests.twin.mismatch.recordings import NOISE_V, flown, pack
from twin.builtin import load_cell
from twin.effects import (
    ActiveMaterialLossNegative,
    AnyEffect,
    CurrentGain,
    CurrentOffset,
    InitialSoc,
    LithiumInventoryLoss,
    SeriesResistance,
    SolidDiffusionNegative,
    SolidDiffusionPositive,
    WeakCell,
)
from twin.load import Between, Load
from twin.mismatch import Flight, Verdict, explain
from twin.mismatch.begun import begins_under_load, preceded
from twin.mismatch.fit import fit
from twin.mismatch.hypothesis import HYPOTHESES
from twin.mismatch.search import again, flown_before
from twin.mismatch.split import split
from twin.mismatch.unseen import unseen
from twin.simulate import simulate

FLOWN_S = 40.0
OURS = [
    h
    for h in HYPOTHESES
    if h.id in {"series_resistance", "electrolyte_transport", "solid_diffusion_positive"}
]


def late(truth: tuple[AnyEffect, ...], seed: int, *, flown_s: float = FLOWN_S) -> Flight:
    """What is recorded from so long after take-off on; how full the pack is then is known."""
    whole = flown(truth, seed=seed)
    at = whole.time_s >= flown_s
    drawn_C = float(np.interp(flown_s, whole.time_s, whole.load.drawn_C()))
    return replace(
        whole,
        pack=replace(whole.pack, initial_soc=1.0 - drawn_C / whole.pack.window_C),
        load=Load(time_s=whole.time_s[at], current_A=whole.load.current_A[at]),
        voltage_V=whole.voltage_V[at],
        judged=whole.judged[at],
        motion=whole.motion[at],
    )


@pytest.mark.parametrize(
    ("truth", "said", "flown_s"),
    [
        ((), [], FLOWN_S),
        ((SeriesResistance(resistance_ohm=0.006),), ["series_resistance"], FLOWN_S),
        ((SeriesResistance(resistance_ohm=0.006),), ["series_resistance"], 2 * FLOWN_S),
    ],
    ids=["nothing", "resistance", "for twice as long as is recorded"],
)
def test_what_flowed_before_a_recording_is_nothing_that_was_left_out(
    truth: tuple[AnyEffect, ...], said: list[str], flown_s: float
) -> None:
    flights = [late(truth, seed, flown_s=flown_s) for seed in (1, 2)]
    found = explain(flights[:1], flights[1:], hypotheses=OURS)
    assert found.verdict is (Verdict.NAMED if truth else Verdict.NONE)
    assert [e.id for e in found.effects] == said
    (said_so,) = (r for r in found.remarks if "had flown before" in r)
    assert said_so.startswith("flight 1, flight 2: begins under load")
    assert found.errors.held_out_after < 1.2 * found.errors.noise  # not what flowed before
    assert bool(truth) == (found.errors.held_out_before > 2 * found.errors.noise)


def test_what_flowed_before_is_still_in_particles_that_are_slower_than_the_twins() -> None:
    """By the twin as configured they are 0.36 +- 0.014 times as fast, and 21 of 9 mV are left."""
    truth = (SolidDiffusionNegative(diffusivity_factor=0.4),)
    names = {"solid_diffusion_negative", "lithium_inventory_loss", "series_resistance"}
    slow = [h for h in HYPOTHESES if h.id in names]
    found = explain([late(truth, 1)], [late(truth, 2)], hypotheses=slow)
    assert [e.id for e in found.effects] == ["solid_diffusion_negative"]
    (factor,) = found.effects[0].parameters
    assert abs(factor.value - 0.4) < 2 * factor.std < 0.05
    assert found.errors.held_out_after < 1.1 * found.errors.noise


def left_of(ours: Flight, truth_V: np.ndarray) -> tuple[float, float]:
    """Squares of what flowed before, and of what is left where that counts as noise, of NOISE_V."""
    between = unseen(ours.pack, ours.load, flown=True)
    assert between is not None
    seen = (truth_V - simulate(ours.pack, ours.load).voltage_V) / NOISE_V
    ways = between.begun_V / NOISE_V
    sizes = np.linalg.solve(np.eye(ways.shape[1]) + ways.T @ ways, ways.T @ seen)
    left = seen - ways @ sizes
    return float(seen @ seen), float(left @ left + sizes @ sizes)


@pytest.mark.parametrize("flown_s", [20.0, FLOWN_S, 60.0, 80.0])
def test_of_what_flowed_before_less_than_noise_is_left(flown_s: float) -> None:
    """However long it flowed: the recordings are of 120 s less that."""
    ours = late((), 1, flown_s=flown_s)
    whole_V = simulate(pack(), flown((), seed=1).load).voltage_V[-ours.time_s.size :]
    seen, left = left_of(ours, whole_V)
    assert seen > 300.0
    assert left < 8.0  # of three starts another way


@pytest.mark.parametrize("rate", [1.3, 1.6])
def test_nor_where_a_slower_twin_could_not_have_flown_it(rate: float) -> None:
    """Salt of 0.3 runs out in an LG M50 at that rate, by hundreds of millivolts a cell."""
    flight = reference_flight(5.0, mean=rate, peak=2.0 * rate, duration_s=300.0, seed=1)
    whole = Load(time_s=flight.time_s, current_A=flight.current_A)
    begun = replace(pack(), cell=load_cell("lg_m50"), series=6, initial_soc=0.6)
    truth_V, at = simulate(begun, whole).voltage_V, whole.time_s >= FLOWN_S
    drawn_C = float(np.interp(FLOWN_S, whole.time_s, whole.drawn_C()))
    ours = replace(
        flown(seconds=20.0),
        pack=begun.emptier(drawn_C),
        load=Load(time_s=whole.time_s[at], current_A=whole.current_A[at]),
        voltage_V=truth_V[at],
        judged=at[at],
        motion=np.full(np.count_nonzero(at), "hover"),
    )
    seen, left = left_of(ours, truth_V[at])
    assert seen > 10_000.0
    assert left < 12.0  # a deviation above the mean of eight sizes (8 +- 4); 9.2 and 6.8


@pytest.mark.parametrize(
    "effect",
    [
        LithiumInventoryLoss(lost=0.15),
        ActiveMaterialLossNegative(lost=0.2),
        CurrentGain(gain=1.3),
        CurrentOffset(offset_A=-2.0),
    ],
    ids=lambda effect: effect.id,
)
def test_what_flowed_before_is_forgotten_by_a_twin_with_less_charge_or_another_current(
    effect: AnyEffect,
) -> None:
    ours = late((), 1)
    own = replace(ours.pack, initial_soc=0.6, effects=(effect,))
    between = unseen(own, ours.load, flown=True)
    assert between is not None
    sizes_V = np.linalg.norm(between.begun_V, axis=1)
    assert sizes_V[-1] < 0.2 * sizes_V[0]


def test_it_is_so_in_the_short_form_of_a_report() -> None:
    found = explain([late((), 1)], hypotheses=OURS, short=True)
    assert found.verdict is Verdict.NONE
    assert ["had flown before" in r for r in found.remarks] == [True]


def test_a_pack_that_rested_before_a_load_that_begins_at_once_had_not_flown() -> None:
    fresh, flights = replace(pack(), initial_soc=0.9), []
    for seed in (1, 2):
        flight = late((), seed)
        noise_V = np.random.default_rng(seed).normal(0.0, NOISE_V, flight.time_s.size)
        voltage_V = simulate(fresh, flight.load).voltage_V + noise_V
        flights.append(replace(flight, pack=fresh, voltage_V=voltage_V))
        assert begins_under_load(fresh, flight.load)
        assert not begins_under_load(pack(), flight.load)  # full
    found = explain(flights[:1], flights[1:], hypotheses=OURS)
    assert found.verdict is Verdict.NONE
    assert found.remarks == ()


def test_of_a_twin_that_errs_by_as_much_it_is_not_asked() -> None:
    found = explain([late((), 1)], [late((), 2)], hypotheses=OURS, slow_V=0.05)
    assert not any("had flown before" in r for r in found.remarks)


def test_rest_and_programmed_steps_are_no_start_in_flight() -> None:
    load, half = late((), 1).load, replace(pack(), initial_soc=0.5)
    assert begins_under_load(half, load)
    assert not begins_under_load(half, replace(load, between=Between.HOLD))
    idle = replace(load, current_A=np.where(np.arange(load.time_s.size) < 20, 0.3, load.current_A))
    assert not begins_under_load(half, idle)
    sinking_A = 0.2 * float(np.mean(load.current_A))
    sinks = replace(idle, current_A=np.where(idle.current_A == 0.3, sinking_A, idle.current_A))
    assert begins_under_load(half, sinks)


def test_what_may_have_flown_before_leaves_the_pack_as_full_as_it_is_told_to_be() -> None:
    flight, random = late((), 1), np.random.default_rng(1)
    longest_s = 0.0
    for _ in range(50):
        started, whole, more = preceded(flight.pack, flight.load, random)
        drawn = float(whole.drawn_C()[more]) / flight.pack.window_C
        starts = started.numbers()["initial_soc"]
        assert starts <= 1.0
        assert starts - drawn == pytest.approx(flight.pack.initial_soc, abs=1e-3)
        assert np.array_equal(whole.time_s[more:], flight.time_s)
        assert np.array_equal(whole.current_A[more:], flight.load.current_A)
        longest_s = max(longest_s, flight.time_s[0] - whole.time_s[0])
    assert 20.0 < longest_s < FLOWN_S + 10.0  # from a full pack it takes 40 s


@pytest.mark.parametrize(
    "effect",
    [WeakCell(soc_offset=0.05), *(InitialSoc(offset=x) for x in (0.05, 0.1, -0.05))],
    ids=["a cell is fuller than the others", "fuller than told", "more than full", "emptier"],
)
def test_no_cell_was_more_than_full_before(effect: AnyEffect) -> None:
    flight, random = late((), 1), np.random.default_rng(1)
    pack = replace(flight.pack, effects=(effect,))
    for _ in range(20):
        started, whole, more = preceded(pack, flight.load, random)
        drawn = float(whole.drawn_C()[more]) / pack.window_C
        starts = started.numbers()["initial_soc"]
        assert starts - drawn == pytest.approx(pack.numbers()["initial_soc"], abs=1e-3)
        fullest = max(kind.initial_soc for kind in started.cells())
        assert fullest < max(1.0, pack.initial_soc + 0.1) + 1e-9


def test_what_a_flight_before_left_is_asked_of_each_likely_model() -> None:
    """Lost material came first, by what it left; slow particles are far likelier by their own."""
    named = {h.id: [h] for h in HYPOTHESES}
    slow, lost = named["solid_diffusion_positive"], named["active_material_loss_positive"]
    truth = (SolidDiffusionPositive(diffusivity_factor=0.4),)
    rested = split([late(truth, 1)], [late(truth, 2)])
    by_lost = flown_before(rested, [fit(rested, lost)])
    assert by_lost is not None
    found = [fit(by_lost, own) for own in (lost, slow)]
    by_slow = again(by_lost, found)
    assert set(by_lost.near) == {"active_material_loss_positive"}
    assert set(by_slow.near) == {"solid_diffusion_positive"}
    assert again(by_slow, [fit(by_slow, slow)]) is by_slow  # hardly more probable
    assert again(rested, found) is rested
