"""Trials drawn from a seed."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from proof.simulated.draw import BEFORE, FROM_REST, NOISY_A, draw
from proof.simulated.effects import ALL, FOREIGN, LIBRARY
from proof.simulated.faults import Traces
from proof.simulated.flights import TrueFlight, true_flight
from proof.simulated.instruments import USUAL, Instruments
from twin.load import Load
from twin.simulate import simulate


def test_the_same_seed_draws_the_same_trials_and_another_others() -> None:
    assert draw(7, 30) == draw(7, 30)
    assert draw(7, 30) != draw(8, 30)


def test_sixty_trials_have_ten_controls_and_every_effect() -> None:
    drawn = draw(0, 60)
    assert Counter(d.kind for d in drawn) == {
        "control": 10, "foreign": 6, "pair": 6, "single": 38,
    }  # fmt: skip
    singles = Counter(e for d in drawn if d.kind == "single" for e in d.effects)
    assert set(singles) == set(LIBRARY)
    assert max(singles.values()) == 2  # none twice before all came once
    assert {e for d in drawn if d.kind == "foreign" for e in d.effects} <= set(FOREIGN)


@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_so_many_as_were_asked_for(count: int) -> None:
    assert len(draw(3, count)) == count


def test_strong_effects_are_strong_and_another_way_is_never_stronger() -> None:
    drawn = draw(1, 300)
    assert all(1.0 <= d.multiple <= 12.0 for d in drawn)
    assert all(d.multiple >= 3.5 for d in drawn if d.kind in ("pair", "foreign"))
    barely = [d for d in drawn if d.kind == "single" and d.multiple < 3.5]
    assert 0.05 < len(barely) / sum(d.kind == "single" for d in drawn) < 0.25
    for d in drawn:
        for attempt in (1, 2):
            other = d.otherwise(attempt)
            assert other.multiple <= d.multiple
            assert other.multiple >= min(d.multiple, 3.5)
            assert other.effects == d.effects


def test_another_way_has_other_flights_as_many_and_another_plan_in_time() -> None:
    drawn = draw(1, 100)
    for d in drawn:
        others = [d.otherwise(attempt) for attempt in (1, 2, 3)]
        assert all(len(other.flights) == len(d.flights) for other in others)
        assert len({d.flights, *(other.flights for other in others)}) == 4
    same = [all(d.otherwise(k).plan == d.plan for k in (1, 2, 3)) for d in drawn]
    assert np.mean(same) < 0.2


def test_no_flight_draws_more_than_there_is() -> None:
    for d in draw(2, 200):
        low, high = d.drawn
        assert 0 < low < high < d.told.start_soc
        assert not ("self_heating" in d.effects and d.told.heat_transfer_W_m2_K)
        assert all(e in ALL for e in d.effects)


def test_a_flight_draws_the_share_that_was_drawn_for_it() -> None:
    for d in draw(2, 8):
        flight = true_flight(d.plan, d.flights[0], full_C=d.told.full_C, drawn=d.drawn)
        share = np.trapezoid(flight.current_A, flight.time_s) / d.told.full_C
        calm = 0.02 if d.plan == "calm" else 1e-9  # smoothed after it was scaled
        assert d.drawn[0] * (1 - calm) <= share <= d.drawn[1] * (1 + calm)


def test_a_third_of_the_sensors_are_noisy_and_half_of_the_logs_slower() -> None:
    drawn = [d.instruments for d in draw(4, 300)]
    noisy = [d.noise_A for d in drawn if d.noise_A != USUAL.noise_A]
    assert 0.25 < len(noisy) / 300 < 0.42
    assert NOISY_A[0] <= min(noisy) < 0.25 < 0.65 < max(noisy) <= NOISY_A[1]
    assert {d.every for d in drawn} == {1, 2, 5}
    assert 0.4 < np.mean([d.every == 1 for d in drawn]) < 0.6


def test_a_fifth_of_the_logs_begin_in_flight_where_a_pack_file_can_say_how() -> None:
    drawn = draw(4, 300)
    begun = [d for d in drawn if d.before]
    assert 0.12 < len(begun) / 300 < 0.28
    assert all(FROM_REST.isdisjoint(d.effects) for d in begun)
    assert all(d.told.heat_transfer_W_m2_K is None for d in begun)
    assert all(BEFORE[0] * d.drawn[0] <= d.before <= BEFORE[1] * d.drawn[0] for d in begun)
    assert {d.otherwise(1).begun for d in drawn} == {d.begun for d in drawn}


def test_a_log_that_begins_in_flight_is_the_end_of_the_whole_one() -> None:
    pytest.importorskip("pybamm", reason="PyBaMM makes the truths")
    from proof.simulated.flown import Flown
    from proof.simulated.record import record

    n, by = 60, Instruments(noise_V=0.0, noise_A=0.0, every=5)
    t = 0.1 * np.arange(n)
    seen = Traces(
        time_s=t, current_A=np.linspace(1.0, 9.0, n), voltage_V=12.0 - t,
        drawn=np.linspace(0.0, 0.3, n), seed=1,
    )  # fmt: skip
    flight = TrueFlight(
        name="hover-1", seed=1, time_s=t, current_A=seen.current_A, motion=np.full(n, "hover")
    )
    flown = Flown(recorded=seen, cells_V=seen.voltage_V[None], temperature_K=300 + t, flight=flight)
    whole, _ = record(flown, np.random.default_rng(1), by)
    late, hidden = record(flown, np.random.default_rng(1), by, 0.1)
    assert whole.time_s == pytest.approx(0.5 * np.arange(12))
    first = np.flatnonzero(seen.drawn >= 0.1)[0]
    assert late.time_s == pytest.approx(0.5 * np.arange(late.time_s.size))
    assert late.voltage_V == pytest.approx(seen.voltage_V[first::5])
    assert late.current_A == pytest.approx(seen.current_A[first::5])
    assert hidden.temperature_K == pytest.approx(flown.temperature_K[first::5])


@pytest.mark.parametrize("cell", ["lipo_2200", "lg_m50"])
def test_a_log_that_begins_in_flight_is_told_how_full_the_pack_is_then(cell: str) -> None:
    """A state of charge is one of a window, which is 2 to 3 % wider than what is rated."""
    told = replace(draw(1, 1)[0].told, cell=cell, start_soc=0.9, heat_transfer_W_m2_K=None)
    flight = true_flight("hover", 1, full_C=told.full_C, drawn=(0.2, 0.2))
    load = Load(time_s=flight.time_s, current_A=flight.current_A, ambient_K=told.ambient_K)
    soc = simulate(told.pack(), load).require().soc
    share = load.drawn_C() / told.full_C
    then = int(np.searchsorted(share, 0.1))
    assert told.begun(float(share[then])).start_soc == pytest.approx(soc[then], abs=1e-4)


def test_an_effect_is_as_strong_as_in_what_was_recorded_of_it() -> None:
    """A gain has made no charge of its own before a log begins that says how full the pack is."""
    pytest.importorskip("pybamm", reason="PyBaMM makes the truths")
    from proof.simulated.flown import Flown
    from proof.simulated.strength import missed_V

    told = replace(draw(1, 1)[0].told, start_soc=0.9, heat_transfer_W_m2_K=None)
    flight = true_flight("hover", 1, full_C=told.full_C, drawn=(0.5, 0.5))
    t, true_A = flight.time_s, flight.current_A
    drawn = Load(time_s=t, current_A=true_A).drawn_C() / told.full_C
    seen = Traces(
        time_s=t, current_A=true_A, voltage_V=told.voltage_V(t, true_A), drawn=drawn, seed=1
    )
    plain = Flown(
        recorded=seen, cells_V=seen.voltage_V[None], temperature_K=0 * t + 300, flight=flight
    )
    gain = replace(plain, recorded=replace(seen, current_A=1.1 * true_A))
    assert [missed_V(told, plain, share) for share in (0.0, 0.3)] == pytest.approx([0.0, 0.0])
    late = int(np.searchsorted(drawn, 0.3))
    own_A = np.where(np.arange(t.size) < late, true_A, 1.1 * true_A)
    left_V = (seen.voltage_V - told.voltage_V(t, own_A))[late:]
    assert missed_V(told, gain, 0.3) == pytest.approx(float(np.sqrt(np.mean(left_V**2))))
    assert missed_V(told, gain, 0.3) < 0.9 * missed_V(told, gain)


def test_a_flight_in_calm_air_has_no_gusts() -> None:
    gusty, calm = (
        true_flight(plan, 1, full_C=7920.0, drawn=(0.6, 0.7)).current_A
        for plan in ("hover", "calm")
    )
    changes_A = [np.median(np.abs(np.diff(x))) for x in (gusty, calm)]
    assert changes_A[1] < 0.2 * changes_A[0]


def test_the_floor_has_what_the_noise_of_the_current_makes_of_the_twin() -> None:
    """Some 20 mOhm of three cells, times its amperes."""
    pytest.importorskip("pybamm", reason="PyBaMM makes the truths")
    from proof.simulated.strength import answer_V

    told = draw(1, 1)[0].told
    flight = true_flight("calm", 1, full_C=told.full_C, drawn=(0.2, 0.3))
    one, two = (answer_V(told, flight, Instruments(noise_A=a)) for a in (0.2, 0.4))
    assert two == pytest.approx(2 * one, rel=0.05)
    assert 5e-3 < one / 0.2 < 0.1
    assert answer_V(told, flight, Instruments(noise_A=0.0)) == 0.0
