"""What a current known at its samples leaves open of the charge, and of the voltage at the end."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.reference.loads import flight
from tests.twin.mismatch.recordings import pack
from twin.builtin import load_cell
from twin.effects import (
    CurrentGain,
    InitialSoc,
    SensorLag,
    VoltageGain,
    WeakCell,
)
from twin.load import Between, Load
from twin.mismatch import Flight
from twin.mismatch.noise import Noise, whitener
from twin.mismatch.split import as_seen, own_whitener
from twin.mismatch.unseen import forgotten, per_coulomb, unseen, walk_C
from twin.pack import Pack
from twin.simulate import simulate

FINE_S = 0.01


@pytest.mark.parametrize("memory_s", [0.05, 0.3, 2.0])
@pytest.mark.parametrize("every", [10, 50, 100])
def test_the_walk_is_that_of_a_finer_current(memory_s: float, every: int) -> None:
    """Gusts that forget in `memory_s`, sampled at 10 to 1 Hz: within a third of what is true."""
    keep = np.exp(-FINE_S / memory_s)
    white = np.random.default_rng(1).standard_normal(400_001)
    gusts_A = 3.0 * np.sqrt(1 - keep**2) * lfilter([1.0], [1.0, -keep], white)
    fine = Load(time_s=FINE_S * np.arange(gusts_A.size), current_A=20.0 + gusts_A)
    seen = replace(fine, time_s=fine.time_s[::every], current_A=fine.current_A[::every])
    off_C = np.diff(seen.drawn_C() - fine.drawn_C()[::every])
    true_C = np.sqrt(np.sum(off_C**2) / fine.time_s[-1])
    assert walk_C(seen) == pytest.approx(true_C, rel=1 / 3)


def test_steps_that_were_programmed_and_a_steady_current_leave_nothing_open() -> None:
    time_s = np.arange(100.0)
    lively_A = np.random.default_rng(1).normal(10.0, 3.0, 100)
    assert walk_C(Load(time_s=time_s, current_A=lively_A, between=Between.HOLD)) == 0.0
    assert walk_C(Load(time_s=time_s, current_A=np.full(100, 10.0))) == 0.0
    assert walk_C(Load(time_s=time_s[:1], current_A=lively_A[:1])) == 0.0
    assert unseen(pack(), Load(time_s=time_s, current_A=np.full(100, 10.0))) is None


def test_samples_that_a_cycler_put_where_its_current_changed_leave_nothing_open() -> None:
    """Pulses of 30 s, sampled every 10 s and at both sides of each edge."""
    edges_s = np.arange(30.0, 1200.0, 30.0)
    time_s = np.unique([*np.arange(0.0, 1200.0, 10.0), *edges_s - 1e-3, *edges_s])
    current_A = np.where(time_s // 30 % 2 > 0, 10.0, 0.0)
    assert walk_C(Load(time_s=time_s, current_A=current_A)) == 0.0
    late_s = np.arange(0.0, 1200.0, 2.0) + np.random.default_rng(1).uniform(0.0, 1.5, 600)
    gusts_A = np.random.default_rng(2).normal(10.0, 3.0, 600)
    even = walk_C(Load(time_s=np.arange(0.0, 1200.0, 2.0), current_A=gusts_A))
    assert walk_C(Load(time_s=late_s, current_A=gusts_A)) == pytest.approx(even, rel=0.3)


def test_samples_that_were_added_for_the_twin_tell_nothing_of_the_current() -> None:
    """Every 5 s, simulated in steps of 1 s."""
    time_s = np.arange(0.0, 600.0, 5.0)
    load = Load(time_s=time_s, current_A=np.random.default_rng(1).normal(8.0, 2.0, time_s.size))
    whole = Flight(
        name="as recorded", pack=pack(), load=load, voltage_V=np.full(time_s.size, 16.0),
        judged=np.ones(time_s.size, dtype=bool), motion=np.full(time_s.size, ""),
    )  # fmt: skip
    fine = load.refined(1.0)
    at = np.isin(fine.time_s, time_s)
    assert at.sum() == time_s.size < fine.time_s.size
    added = replace(
        whole, load=fine, voltage_V=np.where(at, 16.0, np.nan), judged=at, recorded=at,
        motion=np.full(fine.time_s.size, ""),
    )  # fmt: skip
    one, other = (own_whitener(*as_seen(flight, 0.01)) for flight in (whole, added))
    assert other.unexpected.deviation == pytest.approx(one.unexpected.deviation, rel=1e-9)
    forgotten = own_whitener(*as_seen(replace(added, recorded=None), 0.01)).unexpected.deviation
    assert forgotten[-1] < 0.9 * one.unexpected.deviation[-1]


def test_thinned_currents_miss_the_end_of_a_discharge_by_what_is_said() -> None:
    """Flights at 2 Hz until the pack is empty, the truth at 10 Hz, 2 mV of noise: the last 25 s
    have nearly a variance of 1; a slope that changes by the charge itself is not in it."""
    ends, before, small_V = [], [], []
    for seed in range(12):
        whole = flight(2.2, mean=8.0, peak=16.0, duration_s=600.0, seed=seed)
        true = simulate(pack(), Load(time_s=whole.time_s, current_A=whole.current_A))
        n = int(0.995 * true.time_s.size)
        seen = Load(time_s=whole.time_s[:n:5], current_A=whole.current_A[:n:5])
        off_V = true.voltage_V[:n:5] - simulate(pack(), seen).voltage_V
        between = unseen(pack(), seen)
        assert between is not None
        small_V.append(between.walk_V[seen.time_s.size // 2] * np.sqrt(seen.time_s[-1] / 2))
        freed = whitener(
            seen.time_s, np.ones(seen.time_s.size, dtype=bool),
            Noise(white_V=2e-3, slow_V=0.0, slow_s=1.0), between=between,
        )(off_V[:, None])[:, 0]  # fmt: skip
        ends.append(np.mean(freed[-50:] ** 2))
        before.append(np.mean((off_V[-50:] / 2e-3) ** 2))
    assert max(small_V) < 5e-3
    assert np.mean(before) > 100.0
    assert 0.3 < np.mean(ends) < 3.0


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"effects": (InitialSoc(offset=0.02),)},
        {"effects": (WeakCell(capacity_factor=0.72),)},
        {"effects": (WeakCell(capacity_factor=0.72, soc_offset=-0.05),), "soc_by_rest": True},
        {"effects": (VoltageGain(gain=0.97),), "soc_by_rest": True},
    ],
)
def test_a_charge_drawn_before_lowers_every_cell_by_a_share_of_its_own(
    more: dict[str, Any],
) -> None:
    """4 C within 20 s, then a rest: a weak cell near its end was answered for by 0.72 of it."""
    own = replace(pack(), initial_soc=0.9, **more)
    time_s = np.arange(1400.0)
    load = Load(time_s=time_s, current_A=np.where(time_s < 200.0, 0.0, 4.0))
    brief_A = 0.2 * ((time_s > 5.0) & (time_s < 25.0))
    drawn = replace(load, current_A=load.current_A + brief_A)
    drawn_C = float((drawn.drawn_C() - load.drawn_C())[-1])
    as_is_V, lower_V = simulate(own, load).voltage_V, simulate(own, drawn).voltage_V
    n = lower_V.size
    true = (as_is_V[:n] - lower_V) / drawn_C
    assert per_coulomb(own, load, as_is_V)[n // 3 : n] == pytest.approx(true[n // 3 :], rel=0.02)


def test_what_is_forgotten_at_two_rates_is_told_as_that() -> None:
    """Nine tenths within 2 samples, a tenth of the size of the rest within 32."""
    random, n = np.random.default_rng(3), 4000
    truth = {2.0: 0.4, 32.0: 0.6}
    answers = np.zeros((8, n))
    for samples, share in truth.items():
        kept = np.exp(-1.0 / samples)
        driven = random.normal(0.0, np.sqrt(share * (1.0 - kept**2)), (8, n + 500))
        answers += lfilter([1.0], [1.0, -kept], driven)[:, 500:]
    found = {w.forgets_s / 0.5: w.size_V**2 for w in forgotten(answers, 0.5)}
    assert sum(found.values()) == pytest.approx(1.0, abs=0.03)
    for samples, share in truth.items():
        assert found[samples] == pytest.approx(share, abs=0.1)


def test_the_slow_answer_of_diffusion_to_gusts_seen_every_second_is_expected() -> None:
    """Of an LG M50, squares of means over 40 s; forgotten at one rate, 5.3 of what is expected."""
    lg_m50, squares = Pack(cell=load_cell("lg_m50")), []
    for seed in range(6):
        whole = flight(5.0, mean=1.0, peak=2.0, duration_s=900.0, seed=seed)
        true = simulate(lg_m50, Load(time_s=whole.time_s, current_A=whole.current_A)).require()
        seen = Load(time_s=whole.time_s[::10], current_A=whole.current_A[::10])
        off_V = true.voltage_V[::10] - simulate(lg_m50, seen).voltage_V
        freed = whitener(
            seen.time_s, np.ones(off_V.size, dtype=bool),
            Noise(white_V=2e-4, slow_V=0.0, slow_s=1.0), between=unseen(lg_m50, seen),
        )(off_V[:, None])[:, 0]  # fmt: skip
        blocks = freed[: freed.size // 40 * 40].reshape(-1, 40)
        squares.append(40.0 * np.mean(blocks.mean(axis=1) ** 2))
    assert np.mean(squares) < 4.0


def test_what_follows_a_pause_of_the_logger_is_off_by_what_is_said() -> None:
    """Flights at 10 Hz with two pauses: the first 10 s after each, 2 mV of noise. It leaps, falls
    within seconds and stays, as gusts before and after a pause do."""
    after, before = [], []
    for seed in range(8):
        whole = flight(2.2, mean=8.0, peak=16.0, duration_s=120.0, seed=seed)
        true = simulate(pack(), Load(time_s=whole.time_s, current_A=whole.current_A))
        t = true.time_s
        kept = ~(((t > 30.0) & (t < 37.0)) | ((t > 70.0) & (t < 82.0)))
        seen = Load(time_s=t[kept], current_A=whole.current_A[: t.size][kept])
        off_V = true.voltage_V[kept] - simulate(pack(), seen).voltage_V
        between = unseen(pack(), seen)
        assert between is not None
        freed = whitener(
            seen.time_s, np.ones(seen.time_s.size, dtype=bool),
            Noise(white_V=2e-3, slow_V=0.0, slow_s=1.0), between=between,
        )(off_V[:, None])[:, 0]  # fmt: skip
        for end_s in (37.0, 82.0):
            at = (seen.time_s >= end_s) & (seen.time_s < end_s + 10.0)
            after.append(np.mean(freed[at] ** 2))
            before.append(np.mean((off_V[at] / 2e-3) ** 2))
    assert np.mean(before) > 20.0
    assert np.mean(after) < 1.0


def test_what_flowed_between_samples_was_never_in_a_sensor_that_lags() -> None:
    """Gusts at 10 Hz, as they were and through a sensor that lags by 2.8 s: what flowed unseen
    passed no sensor. With the lag of it undone too it did nine times as much as in truth."""
    whole = flight(2.2, mean=8.0, peak=16.0, duration_s=120.0, seed=1)
    true = Load(time_s=whole.time_s, current_A=whole.current_A)
    kept = np.exp(-np.diff(true.time_s)[0] / 2.8)
    late = replace(true, current_A=lfilter([1.0 - kept], [1.0, -kept], true.current_A))
    lagging = replace(pack(), effects=(SensorLag(lag_s=2.8),))
    told, own = unseen(lagging, late), unseen(pack(), true)
    assert told is not None
    assert own is not None
    assert 0.0 < np.linalg.norm(told.quick_V) < np.linalg.norm(own.quick_V)


def test_noise_of_a_current_draws_as_much_as_its_gain_makes_of_it() -> None:
    load = Load(time_s=np.arange(0.0, 60.0, 0.1), current_A=np.full(600, 4.0))
    plain, twice = (
        unseen(replace(pack(), effects=own), replace(load, current_A=load.current_A / gain), 0.5)
        for gain, own in ((1.0, ()), (2.0, (CurrentGain(gain=2.0),)))
    )
    assert plain is not None
    assert twice is not None
    assert twice.walk_V[300] == pytest.approx(2.0 * plain.walk_V[300], rel=0.02)


def test_a_pack_that_is_empty_on_the_way_moves_as_at_its_end_from_there() -> None:
    time_s = np.arange(0.0, 60.0, 0.2)
    load = Load(time_s=time_s, current_A=np.random.default_rng(1).normal(20.0, 5.0, time_s.size))
    empty = replace(pack(), initial_soc=0.02)
    done = simulate(empty, load).voltage_V.size
    assert done < time_s.size
    between = unseen(empty, load)
    assert between is not None
    for values in (between.walk_V, between.quick_V):
        assert values.shape == time_s.shape
        assert np.all(np.isfinite(values))
        assert values[-1] == values[-2] != 0.0
    assert unseen(replace(pack(), initial_soc=1e-6), load) is None


def test_a_pause_after_the_twin_is_empty_is_no_obstacle() -> None:
    time_s = np.append(np.arange(0.0, 60.0, 0.2), np.arange(80.0, 120.0, 0.2))
    load = Load(time_s=time_s, current_A=np.random.default_rng(1).normal(20.0, 5.0, time_s.size))
    between = unseen(replace(pack(), initial_soc=0.02), load)
    assert between is not None
    assert not between.paused_V.any()
    assert np.all(np.isfinite([between.walk_V, between.walk_s, between.paused_s]))


def test_a_pack_that_starts_empty_has_no_error_that_is_no_number() -> None:
    time_s = np.arange(0.0, 60.0, 0.2)
    charged_A = np.random.default_rng(1).normal(-2.0, 0.5, time_s.size)
    between = unseen(replace(pack(), initial_soc=0.0), Load(time_s=time_s, current_A=charged_A))
    assert between is not None
    assert np.all(np.isfinite([between.walk_V, between.quick_V]))
    assert between.walk_V[-1] > 0.0
