"""A pack whose sensor is stated to be slow, or whose clock is off: what is noise then."""

from dataclasses import replace

import numpy as np
import pytest

from tests.reference.loads import flight as reference_flight
from tests.twin.mismatch.recordings import pack
from twin.effects import AnyEffect, ClockShift, SensorLag, SeriesResistance
from twin.load import Load
from twin.mismatch import HYPOTHESES, Flight, Verdict, explain
from twin.mismatch.fit import fit
from twin.mismatch.idle import idle_ways, steadied
from twin.mismatch.split import sharpened, split
from twin.simulate import simulate

LAG_S, NOISE_A, NOISE_V = 2.79, 0.3, 3e-3
THEIRS = {"series_resistance", "cold_pack", "reaction_kinetics", "electrolyte_transport"}
OURS = [h for h in HYPOTHESES if h.id in THEIRS]


def late(time_s: np.ndarray, current_A: np.ndarray, lag_s: float) -> np.ndarray:
    """A current that is straight between its samples, as a sensor of first order has it."""
    dt, out = float(time_s[1] - time_s[0]), current_A.copy()
    kept = np.exp(-dt / lag_s)
    for k in range(1, out.size):
        behind_A = lag_s * (current_A[k] - current_A[k - 1]) / dt
        at_end_A = current_A[k] - behind_A
        out[k] = at_end_A + kept * (out[k - 1] - current_A[k - 1] + behind_A)
    return out


def flown(
    seed: int, stated: AnyEffect, recorded_A: np.ndarray, truth: tuple[AnyEffect, ...] = ()
) -> Flight:
    """A pack that states what is wrong with its sensor."""
    true, random = calm_A(seed), np.random.default_rng([seed, 1])
    answer = simulate(replace(pack(), effects=truth), true).require()
    n = true.time_s.size
    return Flight(
        name=f"flight {seed}",
        pack=replace(pack(), effects=(stated,)),
        load=replace(true, current_A=recorded_A + random.normal(0.0, NOISE_A, n)),
        voltage_V=answer.voltage_V + random.normal(0.0, NOISE_V, n),
        judged=true.time_s > 8.0,
        motion=np.full(n, "hover"),
    )


def calm_A(seed: int) -> Load:
    """At 10 Hz, as it flowed."""
    own = reference_flight(2.2, mean=4.0, peak=9.0, duration_s=150.0, seed=seed)
    return Load(time_s=own.time_s, current_A=own.current_A)


def lagging(seed: int, truth: tuple[AnyEffect, ...] = ()) -> Flight:
    """Its lag is stated, and its noise."""
    true = calm_A(seed)
    recorded_A = late(true.time_s, true.current_A, LAG_S)
    return flown(seed, SensorLag(lag_s=LAG_S, noise_A=NOISE_A), recorded_A, truth)


@pytest.mark.parametrize("seeds", [(0, 1), (2, 3)])
@pytest.mark.parametrize("ohm", [0.0, 4e-3])
def test_noise_behind_a_lag_that_is_stated_is_no_physics(
    seeds: tuple[int, int], ohm: float
) -> None:
    """Undone with the lag it is many times as much, which kinetics that answer less took away."""
    truth = (SeriesResistance(resistance_ohm=ohm),) if ohm else ()
    one, other = (lagging(seed, truth) for seed in seeds)
    finding = explain([one], [other], hypotheses=OURS)
    assert finding.verdict is (Verdict.NAMED if ohm else Verdict.NONE)
    assert [e.id for e in finding.effects] == ["series_resistance"] * bool(ohm)


def test_the_mean_of_an_idle_current_is_off_by_as_much_whatever_the_lag() -> None:
    """It passed no sensor: a step of it at the end of a stretch, undone, was ten times as much."""
    true = calm_A(0)
    true = replace(true, current_A=np.where(true.time_s < 20.0, 0.2, true.current_A))
    slow, quick = SensorLag(lag_s=LAG_S), SensorLag(lag_s=0.0)
    ways = [
        idle_ways(f.pack, f)
        for f in (steadied(flown_idle(true, effect)) for effect in (slow, quick))
    ]
    assert ways[0].shape == ways[1].shape
    assert np.abs(ways[0]).max() == pytest.approx(np.abs(ways[1]).max(), rel=0.1)


def flown_idle(true: Load, stated: AnyEffect) -> Flight:
    """On the ground before it takes off."""
    noise_A = np.random.default_rng(5).normal(0.0, 0.2, true.time_s.size)
    return Flight(
        name="idle",
        pack=replace(pack(), effects=(stated,)),
        load=replace(true, current_A=true.current_A + noise_A),
        voltage_V=simulate(pack(), true).require().voltage_V,
        judged=np.ones(true.time_s.size, dtype=bool),
        motion=np.full(true.time_s.size, ""),
    )


@pytest.mark.parametrize("shift_s", [2.5, -1.0])
def test_samples_whose_current_was_never_recorded_do_not_count(shift_s: float) -> None:
    """Under load at the end; the last of a current that is 2.5 s late was taken to go on."""
    true = calm_A(1)
    recorded_A = np.interp(true.time_s - shift_s, true.time_s, true.current_A)
    flights = [replace(flown(1, ClockShift(shift_s=shift_s), recorded_A), name=n) for n in "ab"]
    flights = [replace(f, judged=np.ones_like(f.judged)) for f in flights]
    data = split(flights[:1], flights[1:])
    finer = sharpened(data, fit(data, []), stated=False)
    assert finer is not None
    assert finer.unheard == 2 * round(10 * abs(shift_s))
    (own, _), t = finer.fitted[0], true.time_s
    unheard = t > t[-1] - shift_s if shift_s > 0 else t < -shift_s - 1e-9
    assert not own.judged[unheard].any()


@pytest.mark.parametrize(
    ("every", "alike"), [(5, {"sensor_lag"}), pytest.param(1, set(), marks=pytest.mark.long)]
)
def test_within_half_a_sample_a_clock_and_a_lag_look_alike(every: int, alike: set[str]) -> None:
    """0.14 s late: at 2 Hz odds of e^7 speak for a lag."""
    both = [h for h in HYPOTHESES if h.id in {"clock_shift", "sensor_lag"}]
    finding = explain([sampled(0, every)], [sampled(1, every)], hypotheses=both)
    (effect,) = finding.effects
    assert {effect.id, *effect.instead} == {"clock_shift", *alike}


def sampled(seed: int, every: int) -> Flight:
    """Of a clock 0.14 s late, one of so many samples at 10 Hz."""
    random = np.random.default_rng(9)
    true = reference_flight(2.2, mean=8.0, peak=24.0, duration_s=240.0, seed=seed)
    answer = simulate(pack(), Load(time_s=true.time_s, current_A=true.current_A)).require()
    time_s, voltage_V = true.time_s[::every], answer.voltage_V[::every]
    recorded_A = np.interp(time_s - 0.14, true.time_s, true.current_A)
    return Flight(
        name=f"flight {seed}",
        pack=pack(),
        load=Load(time_s=time_s, current_A=recorded_A + random.normal(0.0, 0.08, time_s.size)),
        voltage_V=voltage_V + random.normal(0.0, 8e-3, time_s.size),
        judged=np.ones(time_s.size, dtype=bool),
        motion=np.full(time_s.size, ""),
    )
