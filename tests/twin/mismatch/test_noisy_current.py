"""A smooth current in a noisy record: to that noise the twin answers, and the pack does not."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tests.twin.mismatch.recordings import flown, pack
from twin.effects import AnyEffect, ColdPack, ReactionKinetics
from twin.load import Load
from twin.mismatch import Flight, Verdict, explain
from twin.mismatch.fit import fit
from twin.mismatch.hypothesis import HYPOTHESES
from twin.mismatch.split import split
from twin.simulate import simulate

OURS = [h for h in HYPOTHESES if h.id in {"cold_pack", "reaction_kinetics", "series_resistance"}]
NOISE_A, NOISE_V = 0.3, 3e-3  # 0.3 A are 6 mV across the twin's 20 mOhm


def recorded(
    true: Load, random: np.random.Generator, *, seed: int,
    noise_A: float, noise_V: float = NOISE_V, truth: tuple[AnyEffect, ...] = (),
) -> Flight:  # fmt: skip
    """A true current as sensors record it, and a pack's answer to it, all of it judged."""
    n, answer = true.time_s.size, simulate(replace(pack(), effects=truth), true).require()
    return replace(
        flown(seed=seed),
        load=replace(true, current_A=true.current_A + random.normal(0.0, noise_A, n)),
        voltage_V=answer.voltage_V + random.normal(0.0, noise_V, n),
        judged=np.ones(n, dtype=bool),
        motion=np.full(n, "hover"),
    )


def smooth(truth: tuple[AnyEffect, ...], seed: int, noise_A: float = NOISE_A) -> Flight:
    """Hover that sinks slowly and a slow stroke of the throttle every half minute."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 240.0, 0.1)
    true = Load(time_s=t, current_A=9.0 + 3.0 * np.sin(2 * np.pi * t / 30 + seed) + 0.005 * t)
    return recorded(true, random, seed=seed, noise_A=noise_A, truth=truth)


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
    (told,) = (r for r in finding.remarks if "recorded current has noise" in r)
    assert all(f" A in flight {k}, " in told for k in (1, 2))


def test_a_twin_that_answers_less_to_noise_is_no_better() -> None:
    """Of a pack of which nothing was left out: 1.10 +- 0.02 by the current as it was recorded."""
    data = split([smooth((), 1, noise_A=0.8)], [smooth((), 2, noise_A=0.8)])
    found = fit(data, [h for h in HYPOTHESES if h.id == "electrolyte_transport"])
    factors = found.problem.values(found.q)["electrolyte_transport"]
    errors = found.problem.stds(found.q, found.covariance(1.0))
    std = errors["electrolyte_transport"]["conductivity_factor"]
    assert abs(factors["conductivity_factor"] - 1.0) < std < 0.06


def gusty(seed: int) -> Flight:
    """Gusts of a second at 5 Hz."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 480.0, 0.2)
    knot_s = np.arange(0.0, 481.0)
    gusts = gaussian_filter1d(random.normal(0.0, 2.5, knot_s.size), 1.0)
    true = Load(time_s=t, current_A=10.0 + np.interp(t, knot_s, gusts))
    return recorded(true, random, seed=seed, noise_A=0.4)


def test_a_clock_that_is_right_is_no_more_probable_than_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """About no shift, a straight line says that what is held out would gain by less.

    As where noise of the current is not sure. With a lag beside it that does the opposite a clock
    is a filter, and takes noise of so many amperes if nobody else takes it for noise.
    """
    monkeypatch.setattr(import_module("twin.mismatch.split"), "current_noise", lambda *_: None)
    data = split([gusty(1)], [gusty(2)])
    null = fit(data, [])
    own = fit(data, [h for h in HYPOTHESES if h.id == "clock_shift"])
    straight = replace(own, kept=1.0)
    assert own.log_evidence(1.0) < null.log_evidence(1.0) < straight.log_evidence(1.0)


def calm(truth: tuple[AnyEffect, ...], seed: int) -> Flight:
    """Hover in air without gusts."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 360.0, 0.1)
    slow_A = gaussian_filter1d(random.normal(0.0, 6.0, t.size), 20.0)
    true = Load(time_s=t, current_A=9.0 + slow_A + 2.0 * np.sin(2 * np.pi * t / 60 + seed))
    return recorded(true, random, seed=seed, noise_A=0.15, noise_V=6e-3, truth=truth)


@pytest.mark.long
def test_a_lag_and_a_clock_that_cancel_are_no_filter_for_noise() -> None:
    """They were named beside slow reactions, together: in calm air they took the noise away."""
    truth = (ReactionKinetics(negative_factor=0.6, positive_factor=1.0),)
    ours = [h for h in HYPOTHESES if h.id in {"reaction_kinetics", "clock_shift", "sensor_lag"}]
    finding = explain([calm(truth, 1)], [calm(truth, 2)], hypotheses=ours)
    assert [e.id for e in finding.effects] == ["reaction_kinetics"]
    told = {p.name: p for p in finding.effects[0].parameters}["negative_factor"]
    assert abs(told.value - 0.6) < 2.0 * told.std


def white_gusts(seed: int, *, seconds: float) -> Flight:
    """Strokes of six seconds and gusts as white as the noise, at 2 Hz."""
    random, t = np.random.default_rng(seed), np.arange(0.0, seconds, 0.5)
    gusts_A = random.normal(0.0, 1.5, t.size)
    true = Load(time_s=t, current_A=10.0 + 3.0 * np.sin(t / 2) + gusts_A)
    return recorded(true, random, seed=seed, noise_A=0.5, noise_V=6e-3)


def test_noise_of_one_recording_makes_that_of_another_of_the_same_pack_likely() -> None:
    long, short = white_gusts(8, seconds=480.0), white_gusts(1, seconds=250.0)
    alone, beside = split([short], [short]), split([long], [short])
    assert not alone.held_out[0][1].noise.current_A
    assert beside.fitted[0][1].noise.current_A == pytest.approx(0.5, rel=0.1)
    assert beside.held_out[0][1].noise.current_A == pytest.approx(0.5, rel=0.15)
