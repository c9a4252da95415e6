"""FlightLog -> Recording: channels on one clock, and numbers that cannot be true are doubted."""

import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs import quality
from flightlogs.align import AlignedSensor
from flightlogs.assemble import assemble
from flightlogs.errors import Refusal
from flightlogs.log import Channel, FlightLog
from flightlogs.read import read_log
from flightlogs.recording import ClockFit, Recording
from flightlogs.resample import resample
from sample_logs import write_ulog as w
from tests.flightlogs import px4_flight as px4

FIT = ClockFit(
    method="battery_current",
    offset_s=0.0,
    drift_ppm=0.0,
    correlation=1.0,
    uncertainty_s=0.01,
    drift_uncertainty_ppm=1.0,
    gain=None,
    bias_A=None,
)


def log(content: bytes | None = None, **changes: object) -> FlightLog:
    whole = read_log(io.BytesIO(content or px4.ulog()), name="test.ulg")
    return replace(whole, **changes)  # type: ignore[arg-type]


def codes(recording: Recording) -> list[str]:
    return [warning.code for warning in recording.warnings]


def test_a_good_log_gives_its_truth_and_no_warning() -> None:
    got = assemble(log())
    t = px4.times(5.0)
    np.testing.assert_allclose(got.time_s, t, atol=1e-6)
    np.testing.assert_allclose(got.current_A, px4.trace(t).current_A, rtol=1e-6)
    np.testing.assert_allclose(got.voltage_V, px4.trace(t).voltage_V, rtol=1e-6)
    np.testing.assert_array_equal(got.in_air, px4.flying(np.round(got.time_s, 6)))
    assert got.coulomb_check == pytest.approx(1.0, abs=1e-4)
    assert got.resistance_ohm == pytest.approx(px4.RESISTANCE_OHM, rel=0.02)
    assert (got.series, got.series_inferred) == (px4.CELLS, False)
    assert got.current_source == "autopilot"
    assert got.setpoint_source.startswith("trajectory_setpoint")
    assert got.velocity_m_s is not None
    assert got.velocity_m_s.shape == (t.size, 3)
    assert got.warnings == ()


@pytest.mark.parametrize("source", ["autopilot", "sensor"])
def test_a_current_that_carries_no_multirotor_was_not_measured(source: str) -> None:
    """Noise of a pin that is not wired: milliamperes, with peaks now and then."""
    t = px4.times(5.0)
    noise_A = 0.01 + 0.005 * np.sin(7 * t) + 3.0 * (np.arange(t.size) % 100 == 0)
    unwired = log(px4.ulog({"battery": px4.pack(current_A=noise_A)}))
    sensor = AlignedSensor(time_s=t, current_A=noise_A, fit=FIT) if source == "sensor" else None
    with pytest.raises(Refusal, match=r"0\.015 A, which carries no multirotor") as caught:
        assemble(unwired, sensor=sensor)
    assert caught.value.code == "no_current"
    assert f"({source})" in str(caught.value) or sensor is None


@settings(max_examples=30, deadline=None)
@given(
    scale=st.floats(0.2, 5.0), ohm=st.floats(0.01, 0.4), noise_V=st.floats(0.0, 0.02),
    seed=st.integers(0, 1000),
)  # fmt: skip
def test_resistance_is_found_under_drift_noise_and_outliers(
    scale: float, ohm: float, noise_V: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(0, 120, 0.2)
    amps = scale * (15 + rng.normal(0, 3, t.size))
    volts = 16.5 - 0.01 * t - ohm * amps + rng.normal(0, noise_V, t.size)
    volts[::50] += 0.3  # one sample in fifty is wrong
    got = quality.resistance(t, amps, volts)
    if got is not None:
        spread = noise_V / (scale * 3 * np.sqrt(t.size))
        assert got.ohm == pytest.approx(ohm, rel=0.1, abs=6 * spread + 5e-4 / scale)


def test_a_voltage_that_ignores_the_current_has_no_resistance() -> None:
    t = np.arange(0, 60, 0.2)
    rng = np.random.default_rng(0)
    assert quality.resistance(t, rng.normal(15, 3, t.size), np.full(t.size, 12.6)) is None
    noise = 12.6 + rng.normal(0, 0.01, t.size)
    assert quality.resistance(t, rng.normal(15, 3, t.size), noise) is None


@pytest.mark.parametrize(
    ("factor", "doubted"), [(1.0, False), (0.6, False), (0.2, True), (0.1, True), (100.0, True)]
)
def test_a_misscaled_current_is_doubted_with_numbers(factor: float, doubted: bool) -> None:  # noqa: FBT001
    written = px4.trace(px4.times(5.0))
    scaled = px4.pack(
        current_A=factor * np.asarray(written.current_A),
        charge_C=factor * np.asarray(written.charge_C),
    )
    got = assemble(log(px4.ulog({"battery": scaled})))
    assert ("current_scale_doubtful" in codes(got)) == doubted
    if factor < 1:  # the counter comes from the same sensor and sees nothing
        assert got.coulomb_check == pytest.approx(1.0, abs=1e-3)
    if factor == 0.2:
        said = next(w.message for w in got.warnings if w.code == "current_scale_doubtful")
        assert "149." in said  # 30 mOhm / 0.2
        assert "too small" in said


def test_a_counter_that_disagrees_is_said_and_a_reset_of_it_is_not_counted() -> None:
    written = px4.trace(px4.times(5.0))
    charge = np.asarray(written.charge_C)
    wrong = assemble(log(px4.ulog({"battery": px4.pack(charge_C=1.2 * charge)})))
    assert wrong.coulomb_check == pytest.approx(1 / 1.2, rel=1e-3)
    assert "coulomb_mismatch" in codes(wrong)
    reset = np.where(px4.times(5.0) > 30, charge - 1300, charge)
    right = assemble(log(px4.ulog({"battery": px4.pack(charge_C=reset)})))
    assert right.coulomb_check == pytest.approx(1.0, abs=5e-3)


def test_a_reversed_current_is_turned_and_said() -> None:
    written_A = np.asarray(px4.trace(px4.times(5.0)).current_A)
    got = assemble(log(px4.ulog({"battery": px4.pack(current_A=-written_A)})))
    np.testing.assert_allclose(got.current_A, written_A, rtol=1e-6)
    assert codes(got) == ["current_sign_turned"]


def test_a_negative_current_that_the_voltage_ignores_is_used_as_it_is_and_said() -> None:
    reversed_A = -np.asarray(px4.trace(px4.times(5.0)).current_A)
    reversed_A[0] = 0.3  # noise of the sensor on the ground
    flat = px4.pack(current_A=reversed_A, voltage_V=np.full(reversed_A.size, 16.0))
    got = assemble(log(px4.ulog({"battery": flat})))
    np.testing.assert_allclose(got.current_A, reversed_A, rtol=1e-6)
    said = next(w.message for w in got.warnings if w.code == "current_sign_doubtful")
    assert "gave -0.16" in said  # 15 A for 40 s, and the manoeuvres


def test_a_current_at_the_end_of_the_sensor_s_range_is_used_as_it_is_and_said() -> None:
    lively_A = np.asarray(px4.trace(px4.times(5.0)).current_A)
    lively_A = lively_A + np.random.default_rng(1).normal(0.0, 1.0, lively_A.size)
    top_A = 15.5
    clipped_A = np.minimum(lively_A, top_A)
    got = assemble(log(px4.ulog({"battery": px4.pack(current_A=clipped_A)})))
    np.testing.assert_allclose(got.current_A, clipped_A, rtol=1e-6)
    said = next(w.message for w in got.warnings if w.code == "current_saturated")
    assert "samples stand at 15.5 A" in said
    whole = assemble(log(px4.ulog({"battery": px4.pack(current_A=lively_A)})))
    assert "current_saturated" not in codes(whole)


def test_a_current_that_is_held_is_straight_between_what_was_measured() -> None:
    lively_A = np.asarray(px4.trace(px4.times(5.0)).current_A)
    lively_A = lively_A + np.random.default_rng(1).normal(0.0, 1.0, lively_A.size)
    held_A = np.repeat(lively_A[::5], 5)[: lively_A.size]
    got = assemble(log(px4.ulog({"battery": px4.pack(current_A=held_A)})))
    expected_A = np.interp(np.arange(held_A.size), np.arange(0, held_A.size, 5), lively_A[::5])
    np.testing.assert_allclose(got.current_A, expected_A, rtol=1e-5)
    said = next(w.message for w in got.warnings if w.code == "current_held")
    repeats = held_A.size - lively_A[::5].size
    assert f"{repeats} of {held_A.size} samples repeat it" in said
    whole = assemble(log(px4.ulog({"battery": px4.pack(current_A=lively_A)})))
    assert "current_held" not in codes(whole)


def test_gaps_in_the_current_stay_gaps_and_are_said() -> None:
    t = px4.times(5.0)
    kept = (t < 20) | (t >= 24)
    written = px4.trace(t)
    columns = {
        name: np.asarray(getattr(written, name))[kept]
        for name in ("time_s", "current_A", "voltage_V", "charge_C")
    }
    got = assemble(log(px4.ulog({"battery": px4.pack(**columns)})))
    assert gap_message(got) == (
        "1 gaps in the current, 4.2 of the 40.0 s in flight, the longest 4.2 s from 19.8 s of the "
        "log on (usual step 0.20 s): the charge in them is not measured"
    )
    assert np.diff(got.time_s).max() == pytest.approx(4.2, abs=1e-3)


def gap_message(recording: Recording) -> str:
    return next(w.message for w in recording.warnings if w.code == "gaps_in_current")


@pytest.mark.parametrize(
    ("kept_s", "said"),
    [
        ((0.0, 25.0), "20.2 of the 40.0 s in flight, the longest 20.2 s up to landing"),
        ((25.0, 50.0), "20.0 of the 40.0 s in flight, the longest 20.0 s from take-off on"),
    ],
)
def test_a_current_that_covers_part_of_the_flight_is_said(
    kept_s: tuple[float, float], said: str
) -> None:
    t = px4.times(5.0)
    known = (t >= kept_s[0]) & (t < kept_s[1])
    amps = np.where(known, px4.current(t), -1.0)  # PX4 writes -1 for unknown
    of_log = assemble(log(px4.ulog({"battery": px4.pack(current_A=amps)})))
    assert said in gap_message(of_log)
    sensor = AlignedSensor(time_s=t[known], current_A=px4.current(t[known]), fit=FIT)
    assert said in gap_message(assemble(log(), sensor=sensor))


def test_a_voltage_of_part_of_the_flight_is_said_with_its_share() -> None:
    t = px4.times(5.0)
    volts = np.asarray(px4.trace(t).voltage_V)
    got = assemble(log(px4.ulog({"battery": px4.pack(voltage_V=np.where(t < 25, volts, 0.0))})))
    (said,) = got.warnings
    assert said.code == "gaps_in_voltage"
    assert "not known in 50% of the flight" in said.message
    single = np.where(np.arange(t.size) % 50 == 20, 0.0, volts)
    assert assemble(log(px4.ulog({"battery": px4.pack(voltage_V=single)}))).warnings == ()


@pytest.mark.parametrize(
    ("stated_mAh", "code"),
    [(5000.0, None), (155.0, None), (130.0, "capacity_doubtful"), (2.2, "capacity_doubtful")],
)
def test_a_capacity_that_is_less_than_what_was_drawn_is_not_believed(
    stated_mAh: float, code: str | None
) -> None:
    got = assemble(log(px4.ulog(parameters=px4.PARAMETERS | {"BAT1_CAPACITY": stated_mAh})))
    drawn_mAh = float(np.trapezoid(got.current_A, got.time_s)) / 3.6
    assert drawn_mAh == pytest.approx(170, abs=4)
    assert codes(got) == ([code] if code else [])
    assert (got.capacity_C is None) == (code is not None)
    if code:
        stated, drawn = f"{stated_mAh / 1e3:.3g} Ah", f"{drawn_mAh / 1e3:.3g} Ah"
        assert f"states a capacity of {stated}, and {drawn} were drawn" in got.warnings[0].message


@pytest.mark.parametrize(
    ("name", "stated_mAh", "code"),
    [
        ("BATT_CAPACITY", 3300.0, "capacity_doubtful"),
        ("BATT2_CAPACITY", 3300.0, "capacity_doubtful"),
        ("BATT_CAPACITY", 3301.0, None),
        ("BAT1_CAPACITY", 3300.0, None),  # of PX4, which has no such default
    ],
)
def test_the_capacity_that_ardupilot_begins_with_is_doubted_and_kept(
    name: str, stated_mAh: float, code: str | None
) -> None:
    whole = log()
    pack = replace(whole.batteries[0], capacity_C=3.6 * stated_mAh)
    got = assemble(replace(whole, batteries=(pack,), parameters=((name, stated_mAh),)))
    assert codes(got) == ([code] if code else [])
    assert got.capacity_C == 3.6 * stated_mAh


def test_samples_of_other_channels_are_not_bridged_across_a_hole() -> None:
    whole = log()
    assert whole.velocity_m_s is not None
    t = whole.velocity_m_s.time_s
    kept = (t < 20) | (t > 24)
    holed = Channel(
        time_s=t[kept], values=whole.velocity_m_s.values[kept], source="vehicle_local_position.v"
    )
    got = assemble(log(velocity_m_s=holed))
    assert got.velocity_m_s is not None
    unknown = np.isnan(got.velocity_m_s[:, 0])
    hole = (got.time_s > 20) & (got.time_s < 24)
    assert unknown[hole].all()
    assert not unknown[(got.time_s < 19.9) | ((got.time_s > 24.1) & (got.time_s < 49.5))].any()


@settings(max_examples=40, deadline=None)
@given(
    steps=st.lists(st.floats(0.05, 5.0), min_size=1, max_size=30),
    at=st.lists(st.floats(-10, 100), min_size=1, max_size=20),
)
def test_resampling_gives_the_line_or_nothing(steps: list[float], at: list[float]) -> None:
    t = np.cumsum(steps)
    where = np.array(at)
    got = resample(t, 2 * t + 1, where)
    known = np.isfinite(got)
    np.testing.assert_allclose(got[known], 2 * where[known] + 1, atol=1e-9)
    assert not known[(where < t[0]) | (where > t[-1])].any()
    np.testing.assert_array_equal(resample(t, 2 * t + 1, t), 2 * t + 1)


def with_velocity(values: np.ndarray) -> FlightLog:
    whole = log()
    assert whole.velocity_m_s is not None
    return log(
        velocity_m_s=Channel(
            time_s=whole.velocity_m_s.time_s, values=values, source="vehicle_local_position.v"
        )
    )


def test_a_velocity_beyond_any_multirotor_is_not_used() -> None:
    whole = log()
    assert whole.velocity_m_s is not None
    values = np.array(whole.velocity_m_s.values)
    values[200:210, 0] = 480.0
    got = assemble(with_velocity(values))
    assert got.velocity_m_s is None
    said = next(w.message for w in got.warnings if w.code == "velocity_impossible")
    assert "480 m/s" in said


def test_a_climb_rate_that_contradicts_the_altitude_is_not_used() -> None:
    whole = log()
    assert whole.velocity_m_s is not None
    values = np.array(whole.velocity_m_s.values)
    values[200:400, 2] += 3.0  # a diverged estimator: sinks at 3 m/s, the altitude stays
    got = assemble(with_velocity(values))
    assert got.velocity_m_s is None
    assert codes(got) == ["velocity_impossible"]


def test_a_short_reset_of_the_estimator_is_no_divergence() -> None:
    whole = log()
    assert whole.velocity_m_s is not None
    values = np.array(whole.velocity_m_s.values)
    values[200:205, 2] += 3.0
    assert assemble(with_velocity(values)).velocity_m_s is not None


def test_a_simulated_log_is_analysed_and_said_to_be_one() -> None:
    got = assemble(log(px4.ulog(info={"ver_hw": "PX4_SITL"})))
    assert codes(got) == ["simulated_log"]


def test_of_several_batteries_the_others_are_named() -> None:
    got = assemble(log(px4.ulog(more=[px4.other_pack(2.0, 49.6)])))
    assert got.battery == "battery_status[0], id 1"
    assert got.other_batteries == ("battery_status[1], id 2",)
    assert "several_batteries" in codes(got)
    other = assemble(log(px4.ulog(more=[px4.other_pack(2.0, 49.6)])), battery=1)
    assert (other.battery, other.series) == ("battery_status[1], id 2", 12)


def test_what_the_reader_found_is_passed_on() -> None:
    extras = w.Extras(dropouts=[(px4.BOOT_S + 10, 0.25)])
    got = assemble(log(px4.ulog(extras=extras, parameters={"MAV_TYPE": 2})))
    assert codes(got) == ["log_dropouts", "capacity_unknown"]
