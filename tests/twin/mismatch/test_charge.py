"""What a current known at its samples leaves open of the charge, and of the voltage at the end."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.reference.loads import flight
from tests.twin.mismatch.recordings import pack
from twin.load import Between, Load
from twin.mismatch.charge import walk_C, walk_V
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
    assert not walk_V(pack(), Load(time_s=time_s, current_A=np.full(100, 10.0))).any()


def test_thinned_currents_miss_the_end_of_a_discharge_by_what_is_said() -> None:
    """Flights at 5 Hz until the pack is empty, the truth at 10 Hz: deviations of 1 at the end."""
    shares, small_V = [], []
    for seed in range(12):
        whole = flight(2.2, mean=8.0, peak=16.0, duration_s=600.0, seed=seed)
        true = simulate(pack(), Load(time_s=whole.time_s, current_A=whole.current_A))
        n = int(0.995 * true.time_s.size)
        seen = Load(time_s=whole.time_s[:n:2], current_A=whole.current_A[:n:2])
        off_V = simulate(pack(), seen).voltage_V - true.voltage_V[:n:2]
        expected_V = walk_V(pack(), seen) * np.sqrt(seen.time_s)
        shares.append(off_V[-1] / expected_V[-1])
        small_V.append(expected_V[seen.time_s.size // 2])
        assert expected_V[-1] > 10e-3
    assert max(small_V) < 2e-3
    assert 0.5 < np.sqrt(np.mean(np.square(shares))) < 1.6


def test_a_pack_that_is_empty_at_once_moves_as_far_as_is_known() -> None:
    time_s = np.arange(0.0, 60.0, 0.2)
    load = Load(time_s=time_s, current_A=np.random.default_rng(1).normal(20.0, 5.0, time_s.size))
    empty = replace(pack(), initial_soc=0.02)
    done = simulate(empty, load).voltage_V.size
    assert done < time_s.size
    moves_V = walk_V(empty, load)
    assert moves_V.shape == time_s.shape
    assert np.all(np.isfinite(moves_V))
    assert moves_V[-1] != 0.0
