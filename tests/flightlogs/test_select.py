"""Which flight and battery are taken, and what is refused with which code."""

import io
import itertools
from dataclasses import replace

import numpy as np
import pytest

from flightlogs.errors import Refusal
from flightlogs.flight import choose_flight, refuse_other_vehicles
from flightlogs.log import BatteryLog, FlightLog, Interval, Vehicle
from flightlogs.read import read_log
from flightlogs.select import Elsewhere, choose_battery, choose_series
from tests.flightlogs import px4_flight as px4

ONES = np.ones(100)
WITH_SENSOR = Elsewhere(current=True)


def log(**changes: object) -> FlightLog:
    """The synthetic flight with some of its parts replaced."""
    whole = read_log(io.BytesIO(px4.ulog()), name="test.ulg")
    return replace(whole, **changes)  # type: ignore[arg-type]


def battery(log: FlightLog, **changes: object) -> BatteryLog:
    return replace(log.batteries[0], **changes)  # type: ignore[arg-type]


def codes(warnings: tuple[object, ...]) -> list[str]:
    return [w.code for w in warnings]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("vehicle", "code"),
    [
        (Vehicle.FIXED_WING, "fixed_wing"),
        (Vehicle.VTOL, "vtol"),
        (Vehicle.HELICOPTER, "helicopter"),
        (Vehicle.OTHER, "not_multirotor"),
    ],
)
def test_other_vehicles_are_refused_by_name(vehicle: Vehicle, code: str) -> None:
    with pytest.raises(Refusal, match="SYS_AUTOSTART 4001") as caught:
        refuse_other_vehicles(log(vehicle=vehicle))
    assert caught.value.code == code


def test_a_bench_run_is_refused() -> None:
    with pytest.raises(Refusal, match=r"never in the air: armed for 50\.0 s") as caught:
        choose_flight(log(in_air=()))
    assert caught.value.code == "no_flight"


def test_a_hop_is_too_short() -> None:
    with pytest.raises(Refusal, match=r"2\.0 s in the air") as caught:
        choose_flight(log(in_air=(Interval(5.0, 7.0),)))
    assert caught.value.code == "too_short"


def test_one_flight_is_taken_without_a_word() -> None:
    got = choose_flight(log())
    assert got.flight == Interval(px4.TAKE_OFF_S, px4.LANDING_S)
    assert (got.others, got.warnings) == ((), ())


def test_touching_down_within_one_arming_is_one_flight() -> None:
    got = choose_flight(log(in_air=(Interval(5, 20), Interval(22, 45))))
    assert got.flight == Interval(5, 45)
    assert got.warnings == ()


def test_of_several_armings_the_one_with_most_time_in_the_air_is_taken() -> None:
    armed = (Interval(1, 10), Interval(12, 48), Interval(48.5, 49.5))
    in_air = (Interval(2, 9), Interval(13, 47))
    got = choose_flight(log(armed=armed, in_air=in_air))
    assert got.flight == Interval(13, 47)
    assert got.window == Interval(10, 48.5)
    assert got.others == (armed[0], armed[2])
    assert codes(got.warnings) == ["several_flights"]
    assert "1-10 s (7 s in the air)" in got.warnings[0].message
    drawn_Ah = (0.5 * 5 + 15 * 7) / 3600
    assert f"{drawn_Ah:.2f} Ah were drawn before it" in got.warnings[0].message


def test_nothing_is_drawn_while_nothing_is_logged() -> None:
    whole = log()
    later = np.where(whole.batteries[0].time_s < 11.9, 0.0, 3600.0)
    pack = battery(whole, time_s=whole.batteries[0].time_s + later)
    several = log(
        armed=(Interval(1, 3610), Interval(3615, 3648)),
        in_air=(Interval(2, 9), Interval(3615, 3645)),
        batteries=(pack,),
        duration_s=3650.0,
    )
    drawn_Ah = (0.5 * 5 + 15 * 10) / 3600  # 15 s of the log, and an hour of silence among them
    assert f"{drawn_Ah:.2f} Ah were drawn before it" in choose_flight(several).warnings[0].message


@pytest.mark.parametrize(
    ("recorded", "taken", "why"),
    [
        (Interval(0, 11), Interval(2, 9), "the one that the sensor recorded is analysed"),
        (Interval(0, 50), Interval(13, 47), "the longest is analysed"),
        (Interval(5, 50), Interval(13, 47), "the longest is analysed"),
        (Interval(47.5, 50), Interval(13, 47), "the longest is analysed"),
    ],
)
def test_of_several_flights_the_one_that_a_sensor_recorded_is_taken(
    recorded: Interval, taken: Interval, why: str
) -> None:
    armed = (Interval(1, 10), Interval(12, 48))
    several = log(armed=armed, in_air=(Interval(2, 9), Interval(13, 47)))
    got = choose_flight(several, recorded)
    assert got.flight == taken
    assert why in got.warnings[0].message


@pytest.mark.parametrize(
    ("span", "code"), [(Interval(0.0, 40.0), "starts_in_air"), (Interval(9, 49.9), "ends_in_air")]
)
def test_a_flight_cut_by_the_log_is_said(span: Interval, code: str) -> None:
    assert codes(choose_flight(log(in_air=(span,))).warnings) == [code]


@pytest.mark.parametrize(
    ("disarmed_s", "expected"), [(49.98, []), (49.3, []), (49.2, ["ends_in_air"])]
)
def test_a_log_that_stops_soon_after_the_landing_does_not_end_in_the_air(
    disarmed_s: float, expected: list[str]
) -> None:
    got = choose_flight(log(in_air=(Interval(9, 49.2),), armed=(Interval(1, disarmed_s),)))
    assert codes(got.warnings) == expected


@pytest.mark.parametrize("thrust", ["thrust", None])
def test_without_a_land_detector_the_flight_is_inferred(thrust: str | None) -> None:
    missing = {} if thrust else {"thrust": None}
    got = choose_flight(log(in_air=None, **missing))
    assert got.flight.start_s == pytest.approx(px4.TAKE_OFF_S, abs=0.3)
    assert got.flight.stop_s == pytest.approx(px4.LANDING_S, abs=0.3)
    assert codes(got.warnings) == ["in_air_inferred"]
    assert (thrust or "current") in got.warnings[0].message


def test_descents_do_not_split_a_flight_inferred_from_the_current() -> None:
    whole = log()
    t, amps = whole.batteries[0].time_s, np.asarray(whole.batteries[0].current_A)
    descent = ((t > 20) & (t < 22)) | ((t > 30) & (t < 32.5))
    spun_up = (t > 1) & (t < 2)
    amps = np.where(descent, 3.0, np.where(spun_up, 10.0, amps))
    got = choose_flight(log(in_air=None, thrust=None, batteries=(battery(whole, current_A=amps),)))
    (air,) = got.in_air
    assert (air.start_s, air.stop_s) == pytest.approx((px4.TAKE_OFF_S, px4.LANDING_S), abs=0.3)


def test_electronics_on_the_bench_are_no_flight() -> None:
    whole = log()
    idle = battery(whole, current_A=0.5 + 0.01 * np.sin(whole.batteries[0].time_s))
    with pytest.raises(Refusal, match="no sign of a take-off") as caught:
        choose_flight(log(in_air=None, thrust=None, batteries=(idle,)))
    assert caught.value.code == "no_flight"


def test_the_battery_of_the_motors_is_taken_in_any_order() -> None:
    whole = log()
    motors = battery(whole, label="motors")
    steady = np.full(motors.time_s.size, 20.0) + 0.1 * np.sin(7 * motors.time_s)
    payload = battery(whole, label="payload", current_A=steady)
    small = battery(whole, label="electronics", current_A=steady / 40)
    for order in itertools.permutations([motors, payload, small]):
        packs = tuple(replace(b, instance=i) for i, b in enumerate(order))
        several = log(batteries=packs)
        got, warnings = choose_battery(several, choose_flight(several), None)
        assert got.label == "motors"
        assert codes(warnings) == ["several_batteries"]
        assert "payload" in warnings[0].message
        assert "electronics" in warnings[0].message


@pytest.mark.parametrize("place", [0, 1])
def test_of_batteries_without_a_current_one_with_a_voltage_is_taken(place: int) -> None:
    whole = log()
    dead = battery(whole, label="dead", current_A=None, voltage_V=None)
    packs = [dead, dead]
    packs[place] = battery(whole, label="alive", current_A=None)
    several = log(batteries=tuple(replace(b, instance=i) for i, b in enumerate(packs)))
    got, _ = choose_battery(several, choose_flight(several), None, WITH_SENSOR)
    assert got.label == "alive"


def test_a_reversed_current_is_better_than_none() -> None:
    whole = log()
    amps = whole.batteries[0].current_A
    assert amps is not None
    packs = (
        battery(whole, label="silent", current_A=None),
        battery(whole, label="reversed", current_A=-amps, instance=1),
    )
    several = log(batteries=packs)
    got, _ = choose_battery(several, choose_flight(several), None)
    assert got.label == "reversed"


def test_the_battery_asked_for_is_taken_or_refused() -> None:
    whole = log()
    second = battery(whole, instance=1, label="second", current_A=None)
    both = log(batteries=(whole.batteries[0], second))
    flights = choose_flight(both)
    got, _ = choose_battery(both, flights, 0)
    assert got.instance == 0
    for wanted, code in ((1, "no_current"), (2, "no_battery")):
        with pytest.raises(Refusal) as caught:
            choose_battery(both, flights, wanted)
        assert caught.value.code == code


@pytest.mark.parametrize(
    ("missing", "code", "with_sensor"),
    [
        (("current_A",), "no_current", None),
        (("voltage_V",), "no_voltage", None),
        (("current_A", "voltage_V"), "no_battery", None),
        (("current_A", "voltage_V", "series"), "no_battery", "no_voltage"),
    ],
)
def test_what_was_not_measured_is_refused_unless_a_sensor_replaces_it(
    missing: tuple[str, ...], code: str, with_sensor: str | None
) -> None:
    whole = log()
    bare = log(batteries=(battery(whole, **dict.fromkeys(missing)),))
    flights = choose_flight(bare)
    with pytest.raises(Refusal) as caught:
        choose_battery(bare, flights, None)
    assert caught.value.code == code
    if with_sensor is None:
        choose_battery(bare, flights, None, WITH_SENSOR)
        return
    with pytest.raises(Refusal) as caught:
        choose_battery(bare, flights, None, WITH_SENSOR)
    assert caught.value.code == with_sensor


@pytest.mark.parametrize(("volts", "told"), [(15.0, True), (5.0, False), (np.nan, False)])
def test_a_voltage_of_the_sensor_tells_the_cells_if_a_pack_can_have_it(
    volts: float,
    told: bool,  # noqa: FBT001
) -> None:
    bare = battery(log(), voltage_V=None, series=None)
    whole, elsewhere = log(batteries=(bare,)), Elsewhere(current=True, voltage_V=volts * ONES)
    if told:
        assert choose_battery(whole, choose_flight(whole), None, elsewhere) == (bare, ())
        return
    with pytest.raises(Refusal) as caught:
        choose_battery(whole, choose_flight(whole), None, elsewhere)
    assert caught.value.code == "no_voltage"


def test_a_log_without_batteries_is_refused() -> None:
    with pytest.raises(Refusal, match="no battery channel") as caught:
        choose_battery(log(batteries=()), choose_flight(log()), None, WITH_SENSOR)
    assert caught.value.code == "no_battery"


@pytest.mark.parametrize(
    ("top_V", "counts"),
    [
        (17.4, "5 cells in series taken from the voltage (17.40 V at most, 3.48 a cell; the log "
         "does not say). A pack that was not full has more, and 4 full LiHV cells (4.35 V each) "
         "look the same: state series in pack.toml"),
        (26.1, "6 full LiHV cells (4.35 V each)"),
    ],
)  # fmt: skip
def test_a_voltage_that_full_lihv_cells_have_too_names_both_counts(
    top_V: float, counts: str
) -> None:
    whole = log()
    pack = battery(whole, series=None, voltage_V=np.full(whole.batteries[0].time_s.size, top_V))
    (warning,) = choose_series(pack, pack.voltage_V, "test").warnings
    assert counts in warning.message


@pytest.mark.parametrize("top_V", [4.2, 12.6, 16.8, 25.2, 50.4])
def test_a_voltage_that_only_one_count_has_names_no_other(top_V: float) -> None:
    whole = log()
    pack = battery(whole, series=None, voltage_V=np.full(whole.batteries[0].time_s.size, top_V))
    (warning,) = choose_series(pack, pack.voltage_V, "test").warnings
    assert "LiHV" not in warning.message


@pytest.mark.parametrize("cells", [1, 2, 3, 4, 6, 8, 12, 14])
@pytest.mark.parametrize("said", [None, 3])
def test_cells_are_inferred_where_the_log_is_silent_or_cannot_be_right(
    cells: int, said: int | None
) -> None:
    whole = log()
    t = whole.batteries[0].time_s
    pack = battery(whole, series=said, voltage_V=cells * (4.18 - 0.5 * t / t[-1]))
    got = choose_series(pack, pack.voltage_V, "test")
    assert got.series == cells
    assert got.inferred == (said != cells)
    assert codes(got.warnings) == (["cell_count_inferred"] if got.inferred else [])
