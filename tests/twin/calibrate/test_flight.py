"""A fit to one flight: it finds what was hidden, says what it did not find, and can refuse."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.reference.stored import Reference, twin_load, twin_pack
from twin.builtin import load_cell
from twin.calibrate.answer import Verdict
from twin.calibrate.flight import FlightFit, NotFitted, fit_flight
from twin.calibrate.flight_problem import FlightProblem, Flown, Known, quantities
from twin.effects import (
    ElectrolyteTransport,
    ReactionKinetics,
    SelfHeating,
    SeriesResistance,
    SolidDiffusionNegative,
    SolidDiffusionPositive,
)
from twin.load import Load
from twin.pack import Pack
from twin.sensitivity import sensitivity
from twin.simulate import simulate

CELL = load_cell("lipo_2200")
GUESS = Pack(cell=CELL, series=4, capacity_C=2.2 * 3600, initial_soc=0.93, effects=(SelfHeating(),))
KNOWN = Known(soc=True, capacity=True, temperature=False, scale=True, charge=True)
NOISE_V, NOISE_A = 0.008, 0.08


def flown(truth: Pack, *, length_s: float, seed: int) -> Flown:
    """Rest, then flight with gusts, as a logger at 5 Hz has it."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, length_s, 0.2)
    gusts = np.convolve(rng.standard_normal(t.size), np.exp(-np.arange(50) / 10) / 2, mode="same")
    in_air = t >= 10.0
    current = np.where(in_air, 14.0 + 2.0 * gusts + 4.0 * np.sin(t / 20), 0.4)
    voltage = simulate(truth, Load(time_s=t, current_A=current, ambient_K=truth.initial_K))
    return Flown(
        load=Load(time_s=t, current_A=current + NOISE_A * rng.standard_normal(t.size)),
        voltage_V=voltage.require().voltage_V + NOISE_V * rng.standard_normal(t.size),
        in_air=in_air,
    )


def hidden(seed: int) -> Pack:
    """A pack out of the priors."""
    rng = np.random.default_rng([seed, 1])
    kinetics, electrolyte, diffusion, wind, capacity = np.exp(
        [0.4, 0.25, 0.4, 0.3, 0.12] * rng.standard_normal(5)
    )
    return replace(
        GUESS,
        capacity_C=GUESS.capacity_C * capacity,
        initial_soc=rng.uniform(0.88, 0.98),
        initial_K=298.15 + 7 * rng.standard_normal(),
        effects=(
            SelfHeating(heat_transfer_W_m2_K=12.0 * wind),
            SeriesResistance(resistance_ohm=rng.uniform(0.005, 0.04)),
            ReactionKinetics(negative_factor=kinetics, positive_factor=kinetics),
            ElectrolyteTransport(diffusivity_factor=electrolyte, conductivity_factor=electrolyte),
            SolidDiffusionNegative(diffusivity_factor=diffusion),
            SolidDiffusionPositive(diffusivity_factor=diffusion),
        ),
    )


def truths(pack: Pack) -> dict[str, float]:
    heating, leads, kinetics, electrolyte, diffusion, _ = pack.effects
    return {
        "initial_soc": pack.initial_soc,
        "capacity_C": pack.capacity_C,
        "series_resistance_ohm": leads.resistance_ohm,
        "initial_K": pack.initial_K,
        "heat_transfer_W_m2_K": heating.heat_transfer_W_m2_K,
        "reaction_kinetics": kinetics.negative_factor,
        "electrolyte_transport": electrolyte.diffusivity_factor,
        "solid_diffusion": diffusion.diffusivity_factor,
    }


@cache
def fit(seed: int) -> tuple[FlightFit, Pack, Flown]:
    truth = hidden(seed)
    flight = flown(truth, length_s=300.0, seed=seed)
    found = fit_flight(GUESS, flight, KNOWN)
    assert isinstance(found, FlightFit)
    return found, truth, flight


SEEDS = (0, 1, 2)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_hidden_pack_is_found_and_answers_as_it_did(seed: int) -> None:
    found, truth, flight = fit(seed)
    load = replace(flight.load, ambient_K=found.ambient_K)
    left = flight.voltage_V - simulate(found.pack, load).require().voltage_V
    # the noise of the current, through some 40 mOhm, is 3 mV
    assert np.sqrt(np.mean(left**2)) < 1.1 * np.hypot(NOISE_V, 0.04 * NOISE_A)
    assert found.held_out_after_V < 0.05 * found.held_out_before_V
    assert found.pack.initial_soc == pytest.approx(truth.initial_soc, abs=0.01)
    assert found.pack.capacity_C == pytest.approx(truth.capacity_C, rel=0.04)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Over 24 quantities; those of a seed are not independent, so that 90 % may well be 75.

    Far more packs are in benchmarks/flight_fit.py.
    """
    inside, off = [], []
    for seed in SEEDS:
        found, truth, _ = fit(seed)
        true = truths(truth)
        inside += [e.lower <= true[e.name] <= e.upper for e in found.estimates]
        off += [(e.value - true[e.name]) / e.std for e in found.estimates]
    assert np.mean(inside) >= 0.75
    assert np.max(np.abs(off)) < 3.0
    assert np.sqrt(np.mean(np.square(off))) > 0.3  # nor wider than they need be


@pytest.mark.parametrize("seed", SEEDS)
def test_the_resistance_under_load_is_told_better_than_its_parts(seed: int) -> None:
    found, *_ = fit(seed)
    parts = [e for e in found.estimates if e.name in ("series_resistance_ohm", "reaction_kinetics")]
    assert found.pulse.verdict is Verdict.IDENTIFIED
    assert found.pulse.left_of_prior < min(e.left_of_prior for e in parts)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_stays_as_it_was_is_what_is_said_to_and_nothing_else(seed: int) -> None:
    """Whatever else of it the flight tells when the rest is fitted again."""
    found = fit_flight(GUESS, flown(hidden(seed), length_s=120.0, seed=seed), KNOWN)
    assert isinstance(found, FlightFit)
    for e in found.estimates:
        as_it_was = e.value == pytest.approx(e.prior, rel=1e-12)
        assert (e.verdict is Verdict.PRIOR) == as_it_was, e.name


def test_what_a_short_flight_does_not_tell_stays_as_it_was_and_is_listed() -> None:
    found = fit_flight(GUESS, flown(hidden(0), length_s=60.0, seed=0), KNOWN)
    assert isinstance(found, FlightFit)
    untold = {e.name: e for e in found.estimates if e.verdict is Verdict.PRIOR}
    assert "heat_transfer_W_m2_K" in untold
    assert all(e.value == pytest.approx(e.prior) for e in untold.values())
    assert not {e.id for e in found.pack.effects} & untold.keys()
    (heating,) = (e for e in found.pack.effects if isinstance(e, SelfHeating))
    assert heating == GUESS.effects[0]


def test_without_the_charge_the_capacity_is_left_alone() -> None:
    flight = flown(hidden(0), length_s=120.0, seed=0)
    found = fit_flight(GUESS, flight, replace(KNOWN, charge=False))
    assert isinstance(found, FlightFit)
    assert "capacity_C" not in {e.name for e in found.estimates}
    assert found.pack.capacity_C == GUESS.capacity_C


def test_what_is_fitted_and_validated_is_the_pack_that_is_returned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A capacity that nobody knows and a flight does not tell is that of its prior."""
    monkeypatch.setattr("twin.calibrate.flight.TOLD", 0.1)  # this flight tells it to 0.15
    small = replace(GUESS, capacity_C=0.8 * 3600)
    flight = flown(hidden(1), length_s=60.0, seed=1)
    found = fit_flight(small, flight, replace(KNOWN, capacity=False))
    assert isinstance(found, FlightFit)
    (capacity,) = (e for e in found.estimates if e.name == "capacity_C")
    assert capacity.verdict is Verdict.PRIOR
    assert found.pack.capacity_C == pytest.approx(600.0 * flight.median_A)
    load = replace(flight.load, ambient_K=found.ambient_K)
    left = (flight.voltage_V - simulate(found.pack, load).require().voltage_V)[flight.in_air]
    assert np.sqrt(np.mean(left**2)) < 1.1 * np.hypot(found.held_out_after_V, NOISE_V)


def test_a_measured_temperature_is_believed() -> None:
    flight = flown(replace(hidden(0), initial_K=GUESS.initial_K), length_s=120.0, seed=0)
    found = fit_flight(GUESS, flight, replace(KNOWN, temperature=True))
    assert isinstance(found, FlightFit)
    assert (found.pack.initial_K, found.ambient_K) == (GUESS.initial_K, flight.load.ambient_K)


def test_a_pack_far_from_the_label_is_found_where_the_simulation_would_run_empty() -> None:
    """A doubtful current: the pack holds a third of its label in the amperes of the log."""
    large = replace(GUESS, capacity_C=3 * 2.2 * 3600)
    truth = replace(
        GUESS, initial_soc=0.95, effects=(SelfHeating(), SeriesResistance(resistance_ohm=0.08))
    )
    flight = flown(truth, length_s=400.0, seed=3)
    found = fit_flight(large, flight, replace(KNOWN, scale=False))
    assert isinstance(found, FlightFit)
    assert found.pack.capacity_C == pytest.approx(truth.capacity_C, rel=0.05)
    small = replace(GUESS, capacity_C=0.7 * 3600, initial_soc=0.6)
    found = fit_flight(small, flight, replace(KNOWN, scale=False, soc=False))
    assert isinstance(found, FlightFit)
    assert found.pack.capacity_C == pytest.approx(truth.capacity_C, rel=0.05)


def test_what_was_known_already_is_not_exchanged_for_other_numbers() -> None:
    outcome = fit_flight(GUESS, flown(GUESS, length_s=120.0, seed=0), KNOWN)
    assert isinstance(outcome, NotFitted)
    assert "no better" in outcome.reason


def test_a_hop_and_a_log_without_voltage_are_refused_with_the_reason() -> None:
    hop = flown(GUESS, length_s=30.0, seed=0)
    outcome = fit_flight(GUESS, hop, KNOWN)
    assert isinstance(outcome, NotFitted)
    assert "over 20 s in the air; at least 30 over 30 s" in outcome.reason
    blind = replace(hop, voltage_V=np.full(hop.voltage_V.size, np.nan))
    assert fit_flight(GUESS, blind, KNOWN) == NotFitted("the voltage was not measured")


@pytest.mark.parametrize("factor", [0.0, -1.0])
@pytest.mark.parametrize("labelled", [True, False])
def test_a_current_that_draws_nothing_is_refused_with_the_reason(
    factor: float,
    labelled: bool,  # noqa: FBT001
) -> None:
    flight = flown(GUESS, length_s=60.0, seed=0)
    turned = replace(flight.load, current_A=factor * flight.load.current_A)
    outcome = fit_flight(GUESS, replace(flight, load=turned), replace(KNOWN, capacity=labelled))
    assert isinstance(outcome, NotFitted)
    assert "the median of the current is" in outcome.reason


def test_samples_without_voltage_and_a_gap_do_no_harm() -> None:
    whole = flown(hidden(1), length_s=200.0, seed=1)
    kept = np.ones(whole.voltage_V.size, dtype=bool)
    kept[400:460] = False
    voltage = whole.voltage_V.copy()
    voltage[::3] = np.nan
    load = replace(whole.load, time_s=whole.load.time_s[kept], current_A=whole.load.current_A[kept])
    gappy = Flown(load=load, voltage_V=voltage[kept], in_air=whole.in_air[kept])
    found = fit_flight(GUESS, gappy, KNOWN)
    assert isinstance(found, FlightFit)
    assert found.pack.initial_soc == pytest.approx(hidden(1).initial_soc, abs=0.01)


def test_averages_keep_the_charge_and_the_means() -> None:
    whole = flown(GUESS, length_s=300.0, seed=0)
    short = whole.averaged(300)
    assert short.voltage_V.size == pytest.approx(300, abs=2)
    assert short.load.charge_C() == pytest.approx(whole.load.charge_C(), rel=2e-3)
    first = whole.load.time_s < whole.load.time_s[-1] / 300
    assert short.voltage_V[0] == pytest.approx(whole.voltage_V[first].mean())
    assert whole.averaged(whole.voltage_V.size) is whole


def test_the_slopes_are_the_exact_ones() -> None:
    flight = flown(hidden(0), length_s=60.0, seed=0)
    free = quantities(GUESS, flight, KNOWN)
    problem = FlightProblem(GUESS, flight, free, 1.0)
    _, slopes = problem.linearised(np.zeros(len(free)))
    at = [f.parameter.name for f in free].index("initial_soc")
    exact = sensitivity(GUESS, flight.load, ["initial_soc"]).voltage[:, 0]
    std = free[at].parameter.std
    assert slopes[: exact.size, at] == pytest.approx(-exact * std, rel=2e-3, abs=1e-6)


def test_a_flight_of_another_solver_is_explained() -> None:
    """PyBaMM's answer of the same cell, full and at 25 degC: the twin is told neither."""
    reference = Reference.read("lipo_2200-flight-lumped")
    truth, load = twin_pack(reference), twin_load(reference.load)
    rng = np.random.default_rng(0)
    noisy = reference.voltage_V + 0.002 * rng.standard_normal(reference.voltage_V.size)
    flight = Flown(load=load, voltage_V=noisy, in_air=np.ones(reference.voltage_V.size, dtype=bool))
    capacity_C = CELL.nominal_capacity_C
    start = replace(truth, initial_soc=0.96, capacity_C=1.15 * capacity_C, initial_K=293.15)
    found = fit_flight(start, flight, KNOWN)
    assert isinstance(found, FlightFit)
    true = {"initial_soc": 1.0, "capacity_C": capacity_C, "initial_K": 298.15}
    for e in found.estimates:
        if e.name in true:
            # at the most charge there is; else in the interval, or within the solvers' difference
            assert e.lower - 0.01 * e.value <= true[e.name] <= e.upper + 0.01 * e.value
    assert found.held_out_after_V < 0.2 * found.held_out_before_V
