"""A smooth current in a noisy record: to that noise the twin answers, and the pack does not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tests.twin.mismatch.recordings import flown, pack
from twin.effects import AnyEffect, ClockShift, ColdPack, CurrentGain
from twin.load import Load
from twin.mismatch import Flight, Verdict, explain
from twin.mismatch.answer import answer_ohm
from twin.mismatch.fit import fit
from twin.mismatch.hypothesis import HYPOTHESES
from twin.mismatch.split import split
from twin.simulate import simulate

OURS = [h for h in HYPOTHESES if h.id in {"cold_pack", "reaction_kinetics", "series_resistance"}]
NOISE_A, NOISE_V = 0.3, 3e-3  # 0.3 A are 6 mV across the twin's 20 mOhm


def smooth(truth: tuple[AnyEffect, ...], seed: int, noise_A: float = NOISE_A) -> Flight:
    """Hover that sinks slowly and a slow stroke of the throttle every half minute."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 240.0, 0.1)
    true = Load(time_s=t, current_A=9.0 + 3.0 * np.sin(2 * np.pi * t / 30 + seed) + 0.005 * t)
    answer_V = simulate(replace(pack(), effects=truth), true).require().voltage_V
    return replace(
        flown(seed=seed),
        load=replace(true, current_A=true.current_A + random.normal(0.0, noise_A, t.size)),
        voltage_V=answer_V + random.normal(0.0, NOISE_V, t.size),
        judged=np.ones(t.size, dtype=bool),
        motion=np.full(t.size, "hover"),
    )


@pytest.mark.parametrize(
    ("truth", "said"),
    [((), []), ((ColdPack(start_offset_K=-8.0, ambient_offset_K=-8.0),), ["cold_pack"])],
    ids=["nothing", "cold"],
)
def test_noise_of_a_smooth_current_is_nothing_that_was_left_out(
    truth: tuple[AnyEffect, ...], said: list[str]
) -> None:
    finding = explain([smooth(truth, 1)], [smooth(truth, 2)], hypotheses=OURS)
    assert finding.verdict is (Verdict.NAMED if truth else Verdict.NONE)
    assert [e.id for e in finding.effects] == said
    assert finding.errors.held_out_after < 1.1 * finding.errors.noise


def test_a_twin_that_answers_less_to_noise_is_no_better() -> None:
    """Of a pack of which nothing was left out: 1.10 where squares count alike for every twin."""
    data = split([smooth((), 1, noise_A=0.8)], [smooth((), 2, noise_A=0.8)])
    found = fit(data, [h for h in HYPOTHESES if h.id == "electrolyte_transport"])
    factors = found.problem.values(found.q)["electrolyte_transport"]
    assert factors["conductivity_factor"] == pytest.approx(1.0, abs=0.02)


def gusty(seed: int) -> Flight:
    """Gusts of a second at 5 Hz."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 480.0, 0.2)
    knot_s = np.arange(0.0, 481.0)
    gusts = gaussian_filter1d(random.normal(0.0, 2.5, knot_s.size), 1.0)
    true = Load(time_s=t, current_A=10.0 + np.interp(t, knot_s, gusts))
    answer_V = simulate(pack(), true).require().voltage_V
    return replace(
        flown(seed=seed),
        load=replace(true, current_A=true.current_A + random.normal(0.0, 0.4, t.size)),
        voltage_V=answer_V + random.normal(0.0, NOISE_V, t.size),
        judged=np.ones(t.size, dtype=bool),
        motion=np.full(t.size, "hover"),
    )


def test_instruments_that_are_right_are_no_more_probable_than_none() -> None:
    """About no shift and no lag, a straight line says that what is held out would gain by less."""
    data = split([gusty(1)], [gusty(2)])
    null = fit(data, [])
    both = fit(data, [h for h in HYPOTHESES if h.id in {"clock_shift", "sensor_lag"}])
    assert (
        both.log_evidence(1.0) < null.log_evidence(1.0) < replace(both, kept=1.0).log_evidence(1.0)
    )


def test_a_twin_answers_to_noise_by_its_cells_not_by_how_its_instruments_shift_it() -> None:
    """By the third differences of what it answers to its recorded current, 0.0265 of 0.0216."""
    flight, whiten = split([smooth((), 1)], [smooth((), 2)]).fitted[0]

    def ohm(*effects: AnyEffect) -> float:
        own = replace(pack(), effects=effects)
        return answer_ohm(own, flight.load, simulate(own, flight.load).voltage_V, whiten.means)

    assert ohm(ClockShift(shift_s=0.02)) == pytest.approx(ohm(), rel=0.03)
    assert ohm(CurrentGain(gain=0.9)) == pytest.approx(0.9 * ohm(), rel=0.03)
