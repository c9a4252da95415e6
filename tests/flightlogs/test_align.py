"""Clock alignment on synthetic flights with a known answer, and everything it must refuse."""

from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flightlogs.align import AlignmentRefused, align
from flightlogs.log import FlightLog
from flightlogs.read import read_log
from flightlogs.reference import candidates
from flightlogs.sensor import SensorCounts, SensorLog, read_sensor
from sample_logs.airframe import S500
from sample_logs.instruments import AutopilotFlaws, SensorFlaws, sensor, to_flight_log
from sample_logs.plan import random_plan, steady_hover
from sample_logs.synthetic import SyntheticFlight, fly

SAMPLES = Path(__file__).parents[2] / "sample_logs"
FLAWS = SensorFlaws(offset_s=-12.345, drift_ppm=120.0, gain=1.02, bias_A=0.2)


@cache
def flight(seed: int = 1, *, duration_s: float = 240.0, kind: str = "plan") -> SyntheticFlight:
    plan = random_plan(np.random.default_rng(77), S500, duration_s - 30)
    if kind == "hover":
        plan = steady_hover(duration_s - 30)
    return fly(S500, seed=seed, plan=plan)


@cache
def log_of(seed: int = 1, kind: str = "plan", *, period_s: float = 0.2) -> FlightLog:
    flaws = AutopilotFlaws(battery_period_s=period_s)
    return to_flight_log(flight(seed, kind=kind), seed=11, flaws=flaws)


def sensor_of(seed: int = 1, *, kind: str = "plan", flaws: SensorFlaws = FLAWS) -> SensorLog:
    seen = sensor(flight(seed, kind=kind), flaws, seed=12)
    return SensorLog(
        name="s.csv",
        time_s=seen.time_s,
        current_A=seen.current_A,
        voltage_V=None,
        counts=SensorCounts(),
    )


def refusal(sensor_log: SensorLog, log: FlightLog) -> str:
    with pytest.raises(AlignmentRefused) as caught:
        align(sensor_log, log)
    assert sensor_log.name in str(caught.value)
    return caught.value.code


def without_current(log: FlightLog) -> FlightLog:
    return replace(log, batteries=(replace(log.batteries[0], current_A=None),))


def test_the_true_clock_is_found_with_gain_and_bias() -> None:
    found = align(sensor_of(), log_of())
    fit = found.fit
    assert fit.method == "battery_current"
    assert abs(fit.offset_s - FLAWS.offset_s) < 0.01
    assert abs(fit.drift_ppm - FLAWS.drift_ppm) < 4 * fit.drift_uncertainty_ppm
    assert fit.uncertainty_s < 0.005
    assert fit.gain == pytest.approx(1.02, abs=0.005)
    assert fit.bias_A == pytest.approx(0.2, abs=0.1)
    expected = sensor_of().time_s * (1 + 1e-6 * fit.drift_ppm) + fit.offset_s
    assert found.time_s == pytest.approx(expected, abs=1e-9)


def test_the_voltage_of_the_sensor_comes_along_by_current_and_by_thrust() -> None:
    s = sensor_of()
    s = replace(s, voltage_V=16.0 - 0.01 * s.time_s)
    for of_log in (log_of(), without_current(log_of())):
        np.testing.assert_array_equal(align(s, of_log).voltage_V, s.voltage_V)


def test_moving_a_clock_moves_the_offset_and_nothing_else() -> None:
    here, s = align(sensor_of(), log_of()), sensor_of()
    there = align(replace(s, time_s=s.time_s + 250.0), log_of())
    assert there.time_s == pytest.approx(here.time_s, abs=2e-4)
    assert there.fit.drift_ppm == pytest.approx(here.fit.drift_ppm, abs=1.0)


def test_scale_and_zero_of_the_autopilot_do_not_matter() -> None:
    log = log_of()
    b = log.batteries[0]
    assert b.current_A is not None
    wrong = replace(log, batteries=(replace(b, current_A=0.1 * b.current_A + 3),))
    here, there = align(sensor_of(), log), align(sensor_of(), wrong)
    assert there.time_s == pytest.approx(here.time_s, abs=2e-4)


def test_missing_samples_and_spikes_do_little_harm() -> None:
    s = sensor_of()
    current = s.current_A.copy()
    rng = np.random.default_rng(3)
    current[rng.random(len(current)) < 0.02] = np.nan
    current[rng.integers(0, len(current), 5)] = 90.0
    current[800:830] = np.nan
    fit = align(replace(s, current_A=current), log_of()).fit
    assert abs(fit.offset_s - FLAWS.offset_s) < 0.02


def test_without_current_thrust_serves_and_the_result_says_so() -> None:
    found = align(sensor_of(), without_current(log_of()))
    assert found.fit.method == "thrust"
    assert found.fit.gain is None
    assert found.battery is None
    assert abs(found.fit.offset_s - FLAWS.offset_s) < 0.15
    assert found.fit.uncertainty_s >= 0.05
    assert "aligned_by_thrust" in {w.code for w in found.warnings}


def test_a_clamped_current_is_no_reference() -> None:
    log = log_of()
    b = log.batteries[0]
    clamped = replace(log, batteries=(replace(b, current_A=np.full_like(b.time_s, 15.0)),))
    assert [r.method for r in candidates(clamped, None)] == ["thrust"]
    assert refusal(sensor_of(), replace(clamped, thrust=None)) == "no_reference"


def test_noise_of_a_pin_that_is_not_wired_leaves_it_to_thrust() -> None:
    log = log_of()
    b = log.batteries[0]
    noise_A = np.abs(np.random.default_rng(4).normal(0.2, 0.1, b.time_s.size))
    unwired = replace(log, batteries=(replace(b, current_A=noise_A),))
    assert [r.method for r in candidates(unwired, None)] == ["thrust"]
    assert abs(align(sensor_of(), unwired).fit.offset_s - FLAWS.offset_s) < 0.15


@pytest.mark.parametrize("rows", [2, 4])
def test_a_current_that_is_logged_faster_than_measured_is_compared_where_it_was(rows: int) -> None:
    log = log_of()
    b = log.batteries[0]
    assert b.current_A is not None
    held_A = np.repeat(b.current_A[::rows], rows)[: b.time_s.size]
    fit = align(sensor_of(), replace(log, batteries=(replace(b, current_A=held_A),))).fit
    assert abs(fit.offset_s - FLAWS.offset_s) < 0.02
    assert fit.method == "battery_current"


def test_the_right_one_of_two_batteries_is_found() -> None:
    log = log_of()
    other = to_flight_log(flight(9), seed=13).batteries[0]
    two = replace(
        log, batteries=(replace(other, instance=0), replace(log.batteries[0], instance=1))
    )
    found = align(sensor_of(), two)
    assert abs(found.fit.offset_s - FLAWS.offset_s) < 0.01
    assert found.battery == 1
    with pytest.raises(AlignmentRefused):
        align(sensor_of(), two, battery=0)


@pytest.mark.parametrize(("seed", "period_s"), [(1, 0.1), (2, 0.1), (1, 0.2), (2, 0.5)])
def test_the_own_flight_is_known_at_any_rate_of_the_autopilot(seed: int, period_s: float) -> None:
    fit = align(sensor_of(seed), log_of(seed, period_s=period_s)).fit
    middle_s = 120.0
    error_s = fit.offset_s - FLAWS.offset_s + 1e-6 * (fit.drift_ppm - FLAWS.drift_ppm) * middle_s
    assert abs(error_s) < 0.01


@pytest.mark.parametrize("name", ["s500.ulg", "s500_ardupilot.bin", "s500_telemetry.tlog"])
def test_the_sensor_of_the_sample_is_known_in_each_of_its_logs(name: str) -> None:
    with (SAMPLES / "s500.sensor.csv").open("rb") as stream:
        own = read_sensor(stream, name="s500.sensor.csv")
    with (SAMPLES / name).open("rb") as stream:
        fit = align(own, read_log(stream, name=name)).fit
    assert fit.offset_s == pytest.approx(-37.4, abs=0.01)  # its truth.json
    assert fit.drift_ppm == pytest.approx(85.0, abs=4 * fit.drift_uncertainty_ppm)


@pytest.mark.parametrize("period_s", [0.1, 0.2, 0.5])
@pytest.mark.parametrize(("rode", "seed"), [(2, 1), (1, 2), (6, 1)])
def test_another_flight_of_the_same_plan_is_refused(rode: int, seed: int, period_s: float) -> None:
    assert refusal(sensor_of(rode), log_of(seed, period_s=period_s)) == "wrong_flight"


def test_a_flight_of_another_plan_is_refused() -> None:
    other = fly(S500, seed=5, duration_s=240)
    assert refusal(sensor_of(), to_flight_log(other, seed=4)) in {"wrong_flight", "ambiguous"}


def test_a_steady_hover_is_refused_right_or_wrong() -> None:
    assert refusal(sensor_of(3, kind="hover"), log_of(3, "hover")) in {"steady", "ambiguous"}
    assert refusal(sensor_of(4, kind="hover"), log_of(3, "hover")) in {
        "steady",
        "ambiguous",
        "wrong_flight",
    }


def test_a_current_without_end_of_repetition_is_ambiguous() -> None:
    log, s = log_of(), sensor_of()
    b = log.batteries[0]

    def periodic(t: np.ndarray) -> np.ndarray:
        return 15 + 3 * np.sin(2 * np.pi * t / 7) + np.sin(2 * np.pi * t / 3.5)

    again = replace(log, batteries=(replace(b, current_A=periodic(b.time_s)),))
    assert refusal(replace(s, current_A=periodic(s.time_s)), again) == "ambiguous"


def test_too_little_is_refused() -> None:
    s = sensor_of()
    short = replace(s, time_s=s.time_s[:200], current_A=s.current_A[:200])
    assert refusal(short, log_of()) == "too_short"


def test_a_second_battery_that_was_hardly_logged_is_no_hindrance() -> None:
    log = log_of()
    (own,) = log.batteries
    some = own.time_s < own.time_s[0] + 20.0
    channels = {f.name: getattr(own, f.name) for f in fields(own)}
    short = {name: c[some] for name, c in channels.items() if isinstance(c, np.ndarray)}
    beside = replace(own, instance=1, **short)
    found = align(sensor_of(), replace(log, batteries=(own, beside)))
    assert found.fit == align(sensor_of(), log).fit


def test_a_sensor_that_measured_nothing_is_refused() -> None:
    s = sensor_of()
    assert refusal(replace(s, current_A=np.full_like(s.time_s, np.nan)), log_of()) == "too_short"


def real_current(relative: str) -> tuple[np.ndarray, np.ndarray]:
    path = Path(__file__).parents[2] / ".." / "shared" / "flights" / relative
    if not path.is_file():
        pytest.skip("real flight logs are not here")
    with path.open("rb") as stream:
        battery = read_log(stream, name=path.name).batteries[0]
    assert battery.current_A is not None
    return battery.time_s, battery.current_A


@pytest.mark.parametrize("seed", [0, 1])
def test_a_real_current_at_80_hz_aligns_with_itself(seed) -> None:
    t, i = real_current("dronecrew__px4tools/01_07_59.px4log")
    rng = np.random.default_rng(seed)
    offset_s, drift = float(rng.uniform(-1, 0)), float(rng.uniform(-2e-4, 2e-4))
    at = t[0] + 1 + np.cumsum(0.2 + 0.004 * rng.normal(size=330))
    at = at[at < t[-1] - 1]
    s = 0.1 * np.arange(int((t[-1] - t[0] - 2) / 0.1))
    there = s * (1 + drift) + offset_s + 1 + t[0]
    log = log_of()
    measured = np.interp(at, t, i) + 0.1 * rng.normal(size=len(at))
    b = replace(log.batteries[0], time_s=at, current_A=measured, voltage_V=None, charge_C=None)
    seen = np.interp(there, t, i) + 0.08 * rng.normal(size=len(s))
    sensor_log = replace(sensor_of(), time_s=s, current_A=seen)
    fit = align(sensor_log, replace(log, batteries=(b,), thrust=None)).fit
    middle = 0.5 * s[-1]
    error_s = fit.offset_s + 1e-6 * fit.drift_ppm * middle - (offset_s + 1 + t[0] + drift * middle)
    assert abs(error_s) < 0.01
