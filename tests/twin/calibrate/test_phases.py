"""Stretches of constant current, cut where a programme has its steps and nowhere else."""

import numpy as np
import numpy.typing as npt
import pytest

from twin.calibrate.phases import current_noise_A, phases

FloatArray = npt.NDArray[np.float64]

FELT_V = 1e-3
OHM = 0.03


def programme() -> tuple[FloatArray, list[int]]:
    """1 Hz: rest, an hour at 0.1C of 3 Ah with pulses of 10 s both ways, a rest; its steps."""
    steps = {0: 0.0, 60: 0.3, 1000: 3.0, 1010: 0.3, 2000: -1.5, 2010: 0.3, 3600: 0.0}
    starts = [*steps, 4000]
    current = np.repeat(list(steps.values()), np.diff(starts))
    return current, list(steps)


def cuts(current: FloatArray, noise_V: float = 3e-4) -> list[int]:
    """With the voltage that an ohmic cell answers with."""
    random = np.random.default_rng(9)
    voltage = 4.0 - OHM * current + noise_V * random.standard_normal(current.size)
    return phases(current, voltage, felt_V=FELT_V).tolist()


def test_phases_begin_where_the_current_changes() -> None:
    current = np.array([0, 0, 2, 2.001, 1.999, 2, -1, -1, 0, 0, 0.0])
    assert cuts(current) == [0, 2, 6, 8]


@pytest.mark.parametrize("noise_A", [0.0, 1e-4, 3e-3, 6e-3, 0.02])
@pytest.mark.parametrize("seed", range(3))
def test_steps_of_a_programme_are_found_exactly_in_noise(noise_A: float, seed: int) -> None:
    current, steps = programme()
    noise = noise_A * np.random.default_rng(seed).standard_normal(current.size)
    assert cuts(current + noise) == steps


def test_noise_of_the_current_is_measured_in_spite_of_pulses() -> None:
    current, _ = programme()
    random = np.random.default_rng(1)
    noisy = current + 6e-3 * random.standard_normal(current.size)
    got = current_noise_A(noisy, 4.0 - OHM * current, felt_V=FELT_V)
    assert got == pytest.approx(6e-3, rel=0.05)  # 4000 samples: 2 %


def test_a_step_smaller_than_the_noise_is_found_where_it_lasts() -> None:
    random = np.random.default_rng(2)
    current = np.repeat([0.30, 0.32, 0.30], [2000, 300, 2000])
    got = cuts(current + 8e-3 * random.standard_normal(current.size))
    assert len(got) == 3
    assert got[1:] == pytest.approx([2000, 2300], abs=4)  # a few samples of 2.5 deviations


def test_a_drift_is_followed_within_the_tolerance() -> None:
    """From 3 A to 2 A in an hour: no stretch departs from its mean by much more than 1 %."""
    random = np.random.default_rng(3)
    drift = np.linspace(3.0, 2.0, 3600)
    got = cuts(drift + 5e-3 * random.standard_normal(drift.size))
    assert 10 < len(got) < 60
    for a, b in zip(got, [*got[1:], drift.size], strict=True):
        assert np.abs(drift[a:b] - drift[a:b].mean()).max() < 0.05


def test_what_moves_the_voltage_is_no_noise() -> None:
    """A drive cycle at 1 Hz: a median change of 2 % of the largest current, each of them real."""
    random = np.random.default_rng(4)
    current = 3.0 + 0.4 * random.standard_normal(500)
    current[100] = 30.0
    assert current_noise_A(current, 4.0 - OHM * current, felt_V=FELT_V) == 0.0
    assert len(cuts(current)) > 250


def test_a_current_that_does_not_change_is_one_phase() -> None:
    assert cuts(np.full(50, 2.0)) == [0]
