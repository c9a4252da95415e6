"""A voltage that a logger repeats until it is measured anew; what rounding repeats was measured."""

from pathlib import Path

import numpy as np
import pytest

from analyze.pipeline import Source, read_flight
from analyze.replaying import judged_of
from flightlogs.held import measured_anew, voltage_held_warning

N = 2000
FLIGHTS = Path(__file__).parents[2] / ".." / "shared" / "flights"


@pytest.fixture
def current_A() -> np.ndarray:
    return np.random.default_rng(4).normal(10.0, 2.0, N)


def sagging_V(current_A: np.ndarray) -> np.ndarray:
    return np.asarray(16.0 - 0.02 * current_A - 2e-4 * np.arange(current_A.size))


def test_a_voltage_slower_than_its_log(current_A: np.ndarray) -> None:
    """Every 0.8 s beside a current at 10 Hz, now and then a sample late, in steps of 10 mV."""
    begins = np.cumsum(np.random.default_rng(5).choice([7, 8, 8, 8, 9], N // 8))
    begins = np.append(0, begins[begins < N])
    held = begins[np.searchsorted(begins, np.arange(N), side="right") - 1]
    voltage_V = np.round(sagging_V(current_A)[held], 2)
    new = measured_anew(voltage_V, current_A)
    assert np.array_equal(np.flatnonzero(new), begins[np.diff(voltage_V[begins], prepend=0) != 0])
    said = voltage_held_warning(voltage_V, current_A, "BAT")
    assert said is not None
    assert (said.code, said.where) == ("voltage_held", "BAT")
    assert f"{np.count_nonzero(~new)} of {N} samples repeat it" in said.message


def test_what_is_not_known_repeats_nothing(current_A: np.ndarray) -> None:
    voltage_V = np.repeat(np.round(sagging_V(current_A)[::8], 2), 8)
    voltage_V[500:] = np.nan
    new = measured_anew(voltage_V, current_A)
    assert np.count_nonzero(new[:500]) < 70
    assert new[500:].all()


@pytest.mark.parametrize("step_V", [1e-3, 0.01, 0.025, 0.1, 0.5])
def test_rounding_repeats_no_measurement(current_A: np.ndarray, step_V: float) -> None:
    voltage_V = np.round(sagging_V(current_A) / step_V) * step_V
    assert measured_anew(voltage_V, current_A).all()
    assert voltage_held_warning(voltage_V, current_A, "") is None


def test_a_steady_discharge_falls_by_a_step_at_a_time() -> None:
    voltage_V = np.round(np.linspace(4.1, 3.4, N), 2)
    assert measured_anew(voltage_V, np.full(N, 3.0)).all()


def test_few_changes_and_no_voltage_tell_nothing(current_A: np.ndarray) -> None:
    held = np.repeat(sagging_V(current_A)[:15], 8)
    assert measured_anew(held, current_A[: held.size]).all()
    assert measured_anew(np.full(N, np.nan), current_A).all()
    assert measured_anew(np.zeros(0), np.zeros(0)).all()


@pytest.mark.skipif(not FLIGHTS.is_dir(), reason="the real logs are not here")
@pytest.mark.parametrize(
    ("path", "one_of", "said"),
    [
        ("dronekit__dronekit-la-testdata/log171.bin", 8, {"voltage_held"}),
        ("erlerobot__logs/MS5611_SPI.BIN", 6, {"voltage_held", "current_held"}),
        ("diaven__ardupilot-LogAnalyzer/sample02.bin", 1, set()),
        ("dronecrew__px4tools/01_07_59.px4log", 1, set()),
    ],
)
def test_of_a_real_log_what_was_measured_is_judged(path: str, one_of: int, said: set[str]) -> None:
    source = Source(log=FLIGHTS / path, sensor=None, pack=None, battery=None)
    recording = read_flight(source).recording
    span, t = recording.flight, recording.time_s
    flying = np.count_nonzero((t >= span.start_s) & (t <= span.stop_s))
    assert flying / np.count_nonzero(judged_of(recording)) == pytest.approx(one_of, rel=0.15)
    assert {w.code for w in recording.warnings if w.code.endswith("_held")} == said
