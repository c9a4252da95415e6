"""FlightLog and current sensor -> Recording: whose current and voltage are used, and where."""

from dataclasses import replace

import numpy as np
import pytest

from flightlogs.align import AlignedSensor
from flightlogs.assemble import assemble
from flightlogs.errors import Refusal
from flightlogs.log import FlightLog, Interval
from tests.flightlogs import px4_flight as px4
from tests.flightlogs.test_assemble import FIT, codes, log


def test_the_sensor_gives_the_current_and_the_times() -> None:
    t = px4.times(10.0)
    amps = px4.current(t)
    amps[200:210] = np.nan
    sensor = AlignedSensor(time_s=t, current_A=amps, fit=FIT)
    got = assemble(log(), sensor=sensor)
    kept = np.isfinite(amps)
    np.testing.assert_array_equal(got.time_s, t[kept])
    np.testing.assert_array_equal(got.current_A, amps[kept])
    assert (got.current_source, got.alignment) == ("sensor", FIT)
    assert got.resistance_ohm == pytest.approx(px4.RESISTANCE_OHM, rel=0.05)


def test_a_sensor_replaces_a_current_the_autopilot_lacks() -> None:
    silent = px4.pack(current_A=np.full(px4.times(5.0).size, np.nan))
    whole = log(px4.ulog({"battery": silent}))
    with pytest.raises(Refusal) as caught:
        assemble(whole)
    assert caught.value.code == "no_current"
    t = px4.times(10.0)
    got = assemble(whole, sensor=AlignedSensor(time_s=t, current_A=px4.current(t), fit=FIT))
    assert got.current_source == "sensor"


def test_the_battery_that_the_sensor_follows_is_taken_unless_another_is_asked_for() -> None:
    whole = log(px4.ulog(more=[px4.other_pack(2.0, 49.6)]))
    t = px4.times(10.0)
    sensor = AlignedSensor(time_s=t, current_A=px4.current(t), fit=FIT, battery=1)
    got = assemble(whole, sensor=sensor)
    assert (got.battery, got.series) == ("battery_status[1], id 2", 12)
    said = next(w.message for w in got.warnings if w.code == "several_batteries")
    assert "the sensor follows" in said
    assert assemble(whole, battery=0, sensor=sensor).battery == "battery_status[0], id 1"
    by_thrust = replace(sensor, battery=None)
    assert assemble(whole, sensor=by_thrust).battery == "battery_status[0], id 1"


def test_what_a_sensor_recorded_before_the_log_is_not_drawn_in_this_flight() -> None:
    """Of a flight before, perhaps with another pack; the start is told by the log's first rest."""
    t = px4.times(10.0, -900.0)
    earlier = np.where((t > -800) & (t < -100), 14.0, px4.current(t))
    got = assemble(log(), sensor=AlignedSensor(time_s=t, current_A=earlier, fit=FIT))
    assert got.time_s[0] >= -1.0
    own = assemble(log(), sensor=AlignedSensor(time_s=t[t > 0], current_A=earlier[t > 0], fit=FIT))
    assert float(got.current_A.max()) == float(own.current_A.max())


def test_a_sensor_that_missed_the_flight_is_refused() -> None:
    t = px4.times(10.0, 46.0, 49.0)
    sensor = AlignedSensor(time_s=t, current_A=px4.current(t), fit=FIT)
    with pytest.raises(Refusal, match="0 samples of the current") as caught:
        assemble(log(), sensor=sensor)
    assert caught.value.code == "too_short"


def test_of_several_flights_the_one_that_the_sensor_recorded_is_taken() -> None:
    armed = (Interval(4, 17), Interval(18, 46))
    several = log(armed=armed, in_air=(Interval(5, 16), Interval(19, 45)))
    t = px4.times(10.0, 0.0, 17.0)
    sensor = AlignedSensor(time_s=t, current_A=px4.current(t), fit=FIT)
    got = assemble(several, sensor=sensor)
    assert got.flight == Interval(5, 16)
    assert codes(got) == ["several_flights"]


def without_voltage(**changes: object) -> FlightLog:
    whole = log()
    return replace(whole, batteries=(replace(whole.batteries[0], voltage_V=None, **changes),))


@pytest.mark.parametrize("rate_Hz", [10.0, 25.0])
def test_a_voltage_stands_only_next_to_where_it_was_measured(rate_Hz: float) -> None:
    whole, t = log(), px4.times(rate_Hz) + 0.013
    (pack,) = whole.batteries
    assert pack.voltage_V is not None
    cells_V = np.column_stack([pack.voltage_V / 4 + 0.01 * k for k in range(4)])
    cells_V[100:140, 2] = np.nan
    got = assemble(
        replace(whole, batteries=(replace(pack, cell_voltage_V=cells_V),)), sensor=measuring(t)
    )
    expected = np.zeros(t.size, dtype=bool)
    expected[[int(np.argmin(np.abs(t - at))) for at in pack.time_s]] = True
    known = np.isfinite(got.voltage_V)
    inside = (got.time_s > pack.time_s[1]) & (got.time_s < pack.time_s[-2])
    np.testing.assert_array_equal(known[inside], expected[inside])
    straight_V = np.interp(got.time_s, pack.time_s, pack.voltage_V)
    np.testing.assert_allclose(got.voltage_V[known], straight_V[known], rtol=1e-12)
    assert got.cell_voltage_V is not None
    for k, cell_V in enumerate(got.cell_voltage_V.T):
        lost = (got.time_s > 19.8) & (got.time_s < 28.0) & (k == 2)  # measured at both ends
        np.testing.assert_array_equal(np.isfinite(cell_V), known & ~lost)
    assert codes(got) == []  # the share of the flight without a voltage is that between its gaps


def test_a_gap_in_the_voltage_beside_a_sensor_is_said_with_its_share_of_the_flight() -> None:
    whole = log()
    (pack,) = whole.batteries
    assert pack.voltage_V is not None
    lost = replace(pack, voltage_V=np.where(pack.time_s < 25, pack.voltage_V, np.nan))
    (said,) = assemble(
        replace(whole, batteries=(lost,)), sensor=measuring(px4.times(10.0))
    ).warnings
    assert said.code == "gaps_in_voltage"
    assert "not known in 50% of the flight" in said.message


def measuring(t: np.ndarray, *, volts: np.ndarray | None = None) -> AlignedSensor:
    return AlignedSensor(time_s=t, current_A=px4.current(t), voltage_V=volts, fit=FIT)


@pytest.mark.parametrize("series", [px4.CELLS, None])
def test_the_voltage_of_the_sensor_is_used_where_the_log_has_none(series: int | None) -> None:
    t = px4.times(10.0)
    volts = np.array(px4.trace(t).voltage_V)
    volts[100:103] = np.nan
    got = assemble(without_voltage(series=series), sensor=measuring(t, volts=volts))
    known = np.isfinite(volts)
    np.testing.assert_allclose(got.voltage_V[known], volts[known], rtol=1e-12)
    assert got.series == px4.CELLS
    assert got.resistance_ohm == pytest.approx(px4.RESISTANCE_OHM, rel=0.02)
    inferred = [] if series else ["cell_count_inferred"]
    assert codes(got) == ["voltage_of_sensor", *inferred]


def test_a_voltage_no_such_pack_has_is_not_taken_from_the_sensor() -> None:
    t = px4.times(10.0)
    got = assemble(without_voltage(), sensor=measuring(t, volts=np.full(t.size, 5.0)))
    assert np.isnan(got.voltage_V).all()
    assert "voltage_of_sensor" not in codes(got)


def test_the_voltage_of_the_log_goes_before_that_of_the_sensor() -> None:
    t = px4.times(10.0)
    with_it = assemble(log(), sensor=measuring(t, volts=np.full(t.size, 14.0)))
    without = assemble(log(), sensor=measuring(t))
    np.testing.assert_array_equal(with_it.voltage_V, without.voltage_V)
    assert codes(with_it) == codes(without)
