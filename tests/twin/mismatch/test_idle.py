"""Where a pack idles, the noise of its recorded current does not decide what was left out."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown
from twin.effects import AnyEffect, CurrentOffset, ReactionKinetics
from twin.load import Between
from twin.mismatch import HYPOTHESES, Flight, Verdict, explain
from twin.mismatch.idle import idle_ways, steadied
from twin.simulate import simulate

IDLE_S, IDLES_A, NOISE_A, COLD_K = 6.0, 0.3, 0.25, 283.15
SLOW = ReactionKinetics(negative_factor=0.4, positive_factor=0.4)
OURS = [h for h in HYPOTHESES if h.id in ("reaction_kinetics", "current_offset", "voltage_gain")]


def waiting(seed: int, *, noise_A: float = NOISE_A, truth: tuple[AnyEffect, ...] = ()) -> Flight:
    """On the ground for IDLE_S, then in flight; a cold pack."""
    flight, random = flown(seed=seed), np.random.default_rng([seed, 2])
    cold = replace(flight.pack, initial_K=COLD_K)
    on_ground = flight.time_s < IDLE_S
    true_A = np.where(on_ground, IDLES_A, flown(seed=seed, noise_V=0.0).load.current_A)
    load = replace(flight.load, current_A=true_A, ambient_K=COLD_K)
    solution = simulate(replace(cold, effects=truth), load).require()
    recorded_A = true_A + np.where(on_ground, random.normal(0.0, noise_A, true_A.size), 0.0)
    return replace(
        flight, pack=cold, load=replace(load, current_A=recorded_A),
        voltage_V=solution.voltage_V + random.normal(0.0, 5e-3, true_A.size),
    )  # fmt: skip


def test_its_mean_stands_for_an_idle_current_and_nothing_else_moves() -> None:
    flight = waiting(1)
    found = steadied(flight)
    (idle,) = found.idle
    assert (idle.start_s, idle.end_s) == (0.0, pytest.approx(IDLE_S - 0.2))  # one before take-off
    assert idle.noise_A == pytest.approx(NOISE_A, rel=0.2)
    at = flight.time_s <= idle.end_s
    assert np.ptp(found.load.current_A[at]) < 1e-12
    assert found.load.current_A[at].sum() == pytest.approx(flight.load.current_A[at].sum())
    assert np.array_equal(found.load.current_A[~at], flight.load.current_A[~at])
    assert abs(found.load.current_A[0] - IDLES_A) < 3.0 * idle.mean_A


def test_what_goes_somewhere_or_was_programmed_stays() -> None:
    flight = waiting(1, noise_A=0.0)
    t, current_A = flight.time_s, flight.load.current_A
    fading = replace(flight, load=replace(flight.load, current_A=np.where(
        t < IDLE_S, 0.6 * np.exp(-t / 2.0), current_A)))  # fmt: skip
    stepped = waiting(1)
    stepped = replace(stepped, load=replace(stepped.load, between=Between.HOLD))
    for own in (flight, fading, stepped):
        assert steadied(own) is own


def test_what_its_mean_is_off_by_is_as_large_as_the_ways_say() -> None:
    flight = steadied(waiting(2))
    (idle,) = flight.idle
    slow = replace(flight.pack, effects=(SLOW,))
    off = np.where(flight.time_s <= idle.end_s, idle.mean_A, 0.0)
    more = replace(flight.load, current_A=flight.load.current_A + off)
    change_V = simulate(slow, more).voltage_V - simulate(slow, flight.load).voltage_V
    (way_V,) = idle_ways(slow, flight).T
    at = flight.time_s <= idle.end_s
    assert way_V[at] == pytest.approx(change_V[at])
    assert not way_V[~at].any()
    assert idle_ways(slow, waiting(2)).shape == (flight.time_s.size, 0)


def test_slow_reactions_are_found_though_a_noisy_sensor_idles() -> None:
    """By the current as recorded: unknown."""
    found = explain([waiting(s, truth=(SLOW,)) for s in (1, 2)], [waiting(3, truth=(SLOW,))],
                    hypotheses=OURS)  # fmt: skip
    assert found.verdict is Verdict.NAMED
    (effect,) = found.effects
    assert effect.id == "reaction_kinetics"
    for v in effect.parameters:
        assert abs(v.value - 0.4) < 3.0 * v.std < 0.2
    assert sum("Where the pack idles, 17 s in all" in r for r in found.remarks) == 1


def test_a_sensor_that_reads_too_little_is_still_found() -> None:
    """Of what idles as well: its mean is kept."""
    off = (CurrentOffset(offset_A=0.8),)
    found = explain(
        [waiting(s, truth=off) for s in (1, 2)], [waiting(3, truth=off)], hypotheses=OURS
    )
    (effect,) = found.effects
    assert effect.id == "current_offset"
    assert effect.parameters[0].value == pytest.approx(0.8, abs=0.05)
