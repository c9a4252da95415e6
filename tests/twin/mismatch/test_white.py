"""White noise of a recording: of its voltage, of its steps, and of its current."""

import numpy as np
import pytest

from twin.mismatch.white import agreed_V, current_noise, step_V, white_V, with_steps_V

N = 20_000
OHM = 0.08


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(3)


def test_white_noise_is_found_under_what_is_smooth_and_what_follows_the_current(
    random: np.random.Generator,
) -> None:
    current = 30.0 + random.normal(0.0, 5.0, N)
    smooth = 0.2 * np.sin(np.arange(N) / 300)
    residual = 8e-3 * random.standard_normal(N) + smooth - 0.02 * current
    assert white_V(residual, current, 0.1) == pytest.approx(8e-3, rel=0.05)


def test_noise_that_was_interpolated_counts_as_dense_as_it_is(random: np.random.Generator) -> None:
    """Four samples from one: their mean is worth one, not four, so white noise is twice as much."""
    seen = np.repeat(8e-3 * random.standard_normal(N // 4), 4)
    assert white_V(seen, np.zeros(N), 0.1) == pytest.approx(16e-3, rel=0.1)


def test_steps_of_a_rounded_voltage_are_seen(random: np.random.Generator) -> None:
    voltage = 15.0 + random.normal(0.0, 0.3, N)
    assert step_V(np.round(voltage / 0.025) * 0.025) == pytest.approx(0.025)
    assert step_V(voltage) == 0.0
    apart = np.full(10 * voltage.size, np.nan)  # as where samples were added between
    apart[::10] = voltage
    assert step_V(apart) == 0.0


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("climb", [0.02, 0.4])
def test_noise_in_steps_is_as_large_as_it_is(
    random: np.random.Generator, noise: float, climb: float
) -> None:
    """A voltage that wanders slowly or fast, in steps of 1: within an eighth."""
    smooth = np.convolve(random.standard_normal(4009), np.ones(10) / np.sqrt(10), "valid")
    true = climb * np.cumsum(smooth)
    residual = np.round(true + noise * random.standard_normal(4000)) - true
    white = white_V(residual, random.normal(10.0, 1.0, 4000), 0.25)
    assert white is not None
    assert with_steps_V(white, 1.0) == pytest.approx(np.std(residual), rel=0.125)


def size_A(residual_V: np.ndarray, simulated_V: np.ndarray, current_A: np.ndarray) -> float:
    told = current_noise(residual_V, simulated_V, current_A)
    return told.size_A if told else 0.0


def told_A(
    random: np.random.Generator, flown_A: np.ndarray, *, noise_A: float, ohm: float = OHM
) -> float:
    """As told of a pack with `ohm` where the twin has OHM."""
    seen_A = flown_A + noise_A * random.standard_normal(flown_A.size)
    recorded_V = -ohm * flown_A + 5e-3 * random.standard_normal(flown_A.size)
    return size_A(recorded_V + OHM * seen_A, -OHM * seen_A, seen_A)


def hover_A(random: np.random.Generator, *, gusts_A: float) -> np.ndarray:
    slow = 20.0 + 3.0 * np.sin(np.arange(N) / 200) + 8.0 * (np.arange(N) % 4000 > 2000)
    return np.asarray(slow + gusts_A * random.standard_normal(N))


@pytest.mark.parametrize("gusts_A", [0.0, 0.02])
def test_what_noise_of_the_current_does_is_noise_though_it_follows_the_current(
    random: np.random.Generator, gusts_A: float
) -> None:
    told = told_A(random, hover_A(random, gusts_A=gusts_A), noise_A=0.1)
    assert told == pytest.approx(0.1, rel=0.1)


@pytest.mark.parametrize(("gusts_A", "ohm"), [(0.5, 0.06), (0.5, 0.1), (2.0, 0.075), (0.0, 0.06)])
def test_what_follows_the_current_for_another_reason_is_no_noise(
    random: np.random.Generator, gusts_A: float, ohm: float
) -> None:
    assert told_A(random, hover_A(random, gusts_A=gusts_A), noise_A=0.0, ohm=ohm) == 0.0


@pytest.mark.parametrize(("noise_A", "ohm"), [(0.5, OHM), (0.0, 0.9 * OHM), (0.5, 0.9 * OHM)])
def test_in_gusts_as_white_as_noise_slow_strokes_tell_it_from_another_resistance(
    random: np.random.Generator, noise_A: float, ohm: float
) -> None:
    strokes = 20.0 + 8.0 * np.sin(np.arange(N) / 5)
    flown = (strokes + 1.5 * random.standard_normal(N))[:1500]
    told = told_A(random, flown, noise_A=noise_A, ohm=ohm)
    assert told == pytest.approx(0.5 if ohm == OHM else 0.0, rel=0.15)


@pytest.mark.parametrize("late", [0.3, 0.5, 1.0, 2.0])
def test_a_clock_that_is_off_is_no_noise(random: np.random.Generator, late: float) -> None:
    flown = hover_A(random, gusts_A=1.0)
    seen = np.interp(np.arange(N) - late, np.arange(N), flown)
    voltage = -OHM * flown + 5e-3 * random.standard_normal(N)
    assert size_A(voltage + OHM * seen, -OHM * seen, seen) == 0.0


def test_of_few_samples_no_noise_of_a_current_is_told(random: np.random.Generator) -> None:
    few = hover_A(random, gusts_A=0.0)[:150]
    assert told_A(random, few, noise_A=0.1) == 0.0
    assert size_A(np.zeros(3), np.zeros(3), np.zeros(3)) == 0.0


def test_recordings_by_one_sensor_have_its_noise() -> None:
    """Each of 500 samples tells it to 7 %, all together to 2 %."""
    told, single = [], []
    for seed in range(10):
        random = np.random.default_rng(seed)
        own = [white_V(random.normal(0.0, 8e-3, 500), np.zeros(500), 0.5) for _ in range(6)]
        whites = [w for w in own if w is not None]
        agreed = agreed_V(whites, [500] * 6)
        assert len(set(agreed)) == 1
        told.append(agreed[0])
        single += whites
    assert np.std(told) < 0.5 * np.std(single)


def test_a_recording_that_is_twice_as_noisy_keeps_its_own() -> None:
    assert agreed_V([8e-3, 8.2e-3, 16e-3], [500] * 3) == [8e-3, 8.2e-3, 16e-3]
    one, other = agreed_V([8e-3, 8.2e-3], [500] * 2)
    assert one == other == pytest.approx(8.1e-3, rel=1e-3)
    assert agreed_V([8e-3], [500]) == [8e-3]
