"""The likeliest current behind a noisy record: as near as it says, and no regression is biased."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tests.twin.mismatch.recordings import flown
from twin.load import Load
from twin.mismatch.quiet import likeliest, quieted

N, STEP_S, NOISE_A = 4000, 0.1, 0.4


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(7)


def walk(random: np.random.Generator) -> np.ndarray:
    return np.asarray(12.0 + np.cumsum(random.normal(0.0, 0.1, N)))


def calm(random: np.random.Generator) -> np.ndarray:
    return np.asarray(12.0 + gaussian_filter1d(random.normal(0.0, 12.0, N), 30.0))


def recorded(current_A: np.ndarray, random: np.random.Generator) -> Load:
    noise_A = random.normal(0.0, NOISE_A, current_A.size)
    return Load(time_s=STEP_S * np.arange(current_A.size), current_A=current_A + noise_A)


@pytest.mark.parametrize("flow", [walk, calm])
def test_it_is_as_near_as_it_says_and_slow_noise_stays(
    random: np.random.Generator, flow: object
) -> None:
    assert callable(flow)
    true_A = flow(random)
    load = recorded(true_A, random)
    found = likeliest(load, NOISE_A)
    off_A = found.current_A - true_A
    assert np.std(off_A) == pytest.approx(found.left_A, rel=0.2)
    assert found.left_A < 0.6 * NOISE_A
    slow_A2 = 2.0 * found.left_A**2 * found.left_s  # of noise, per Hz
    assert slow_A2 == pytest.approx(NOISE_A**2 * STEP_S, rel=0.01)


def test_no_slope_is_drawn_to_less(random: np.random.Generator) -> None:
    """Of a voltage on a current: 0.87 of it by the record, since noise moves that and not this."""
    true_A = 12.0 + gaussian_filter1d(random.normal(0.0, 3.0, N), 3.0)
    load = recorded(true_A, random)
    found = likeliest(load, NOISE_A)
    assert np.polyfit(load.current_A, true_A, 1)[0] < 0.9
    assert np.polyfit(found.current_A, true_A, 1)[0] == pytest.approx(1.0, abs=0.02)


def test_a_switch_stays_where_it_is(random: np.random.Generator) -> None:
    true_A = np.where(np.arange(N) % 1000 < 500, 2.0, 20.0)
    found = likeliest(recorded(true_A, random), NOISE_A)
    assert np.abs(found.current_A - true_A).max() < 2.0 * NOISE_A
    assert np.std(found.current_A - true_A) < 0.15 * NOISE_A


def test_of_another_clock_and_with_pauses_it_is_the_same_current(
    random: np.random.Generator,
) -> None:
    load = recorded(calm(random), random)
    kept = np.sort(random.choice(N, N // 2, replace=False))
    fewer = replace(load, time_s=load.time_s[kept], current_A=load.current_A[kept])
    both_A = likeliest(load, NOISE_A).current_A[kept], likeliest(fewer, NOISE_A).current_A
    assert np.std(both_A[0] - both_A[1]) < 0.4 * NOISE_A


def test_what_was_added_between_samples_moves_with_them(random: np.random.Generator) -> None:
    load = recorded(calm(random)[:600], random)
    time_s = np.sort(np.append(load.time_s, load.time_s[:-1] + STEP_S / 2))
    whole = Load(time_s=time_s, current_A=np.interp(time_s, load.time_s, load.current_A))
    flight = replace(
        flown(seed=1), load=whole, recorded=np.isin(time_s, load.time_s),
        voltage_V=np.full(time_s.size, 15.0), judged=np.ones(time_s.size, dtype=bool),
        motion=np.full(time_s.size, "hover"),
    )  # fmt: skip
    seen, found = quieted(flight, NOISE_A)
    at_s, every_A = seen.load.time_s, np.interp(time_s, load.time_s, found.current_A)
    assert np.array_equal(at_s, time_s)
    assert seen.load.current_A == pytest.approx(every_A)
