"""Measured tests of real cells: read as they were recorded, judged as they say."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.real_cells.__main__ import CELLS, SHARED
from proof.recorded import leaf_cell, lg_m50, panasonic
from proof.recorded.measured import (
    NotHere,
    RealCell,
    RealTest,
    discharge_of,
    held_V,
    matlab,
    on_one_clock,
    recorded_parts,
    recording,
)
from proof.recorded.replay import answer, errors
from twin.builtin import load_cell
from twin.pack import Pack


def recorded(time_s: list[float], current_A: list[float]) -> RealTest:
    t, i = np.array(time_s), np.array(current_A)
    return RealTest(name="test", time_s=t, current_A=i, voltage_V=4.0 - 0.1 * i)


def test_a_step_with_one_stamp_keeps_both_samples() -> None:
    test = on_one_clock(recorded([5.0, 6.0, 6.0, 7.0], [0.0, 0.0, 2.0, 2.0]))
    assert test.time_s == pytest.approx([0.0, 1.0, 1.001, 2.0])
    assert test.current_A.tolist() == [0.0, 0.0, 2.0, 2.0]


def test_a_stamp_that_goes_back_is_dropped() -> None:
    test = on_one_clock(recorded([0.0, 1.0, 0.5, 2.0], [0.0, 1.0, 9.0, 2.0]))
    assert test.time_s.tolist() == [0.0, 1.0, 2.0]
    assert test.current_A.tolist() == [0.0, 1.0, 2.0]


def test_the_first_discharge_ends_where_the_current_does() -> None:
    test = discharge_of(recorded([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 2.0, 2.0, 0.0, -1.0]))
    assert test.current_A.tolist() == [0.0, 2.0, 2.0]


def test_errors_are_per_cell_and_only_where_it_was_measured() -> None:
    test = recorded([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 0.0])
    test.voltage_V[1] = np.nan
    found = errors(test.voltage_V[:3] + 0.03, replace(test, voltage_V=test.voltage_V), series=3)
    assert found.rms == pytest.approx(10.0)
    assert found.mean == pytest.approx(10.0)
    assert found.covered == 0.75
    assert found.of_all == pytest.approx((0.75 * 10.0**2 + 0.25 * 500.0**2) ** 0.5)


def test_parts_with_a_voltage_begin_after_a_rest() -> None:
    """A gap that ends in a rest, and one that hides a discharge up to its end."""
    time_s = [0.0, 1.0, 2.0, 3.0, 2000.0, 2001.0, 2002.0, 2100.0, 2101.0]
    test = recorded(time_s, [0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    assert [p.name for p in recorded_parts(test)] == ["test"]
    test.voltage_V[[3, 6]] = np.nan
    parts = recorded_parts(test)
    assert [p.name for p in parts] == ["test, 1", "test, 2"]
    assert [p.time_s.tolist() for p in parts] == [[0.0, 1.0, 2.0], [0.0, 1.0]]


def test_held_charge_is_what_takes_a_pack_from_full_to_empty() -> None:
    pack = Pack(cell=load_cell("lipo_2200"), parallel=2, capacity_C=3600.0)
    test = recorded([0.0, 100.0], [0.0, 0.0])
    later = replace(test, drawn_before_C=0.25 * pack.window_C)
    expected = answer(replace(pack, initial_soc=0.75), test)
    assert answer(pack, later) == pytest.approx(expected, abs=1e-9)
    flown = replace(test, current_A=np.array([1.0, 1.0]))
    after = replace(test, drawn_before_C=100.0)  # as much as `flown` drew
    rested_V = answer(pack, after)[0]
    long = RealTest(
        name="then rest",
        time_s=np.array([0.0, 100.0, 100.001, 20000.0]),
        current_A=np.array([1.0, 1.0, 0.0, 0.0]),
        voltage_V=np.zeros(4),
    )
    assert flown.drawn_C[-1] == pytest.approx(100.0)
    assert answer(pack, long)[-1] == pytest.approx(rested_V, abs=1e-5)


def load(make: object) -> RealCell:
    assert callable(make)
    try:
        cell = make(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    assert isinstance(cell, RealCell)
    return cell


@pytest.mark.parametrize("make", CELLS, ids=lambda make: f"{make.__module__}.{make.__name__}")
def test_tests_of_a_cell_are_physical(make: object) -> None:
    cell = load(make)
    assert len({t.name for t in (*cell.fit, *cell.held_out)}) == len((*cell.fit, *cell.held_out))
    for test in (*cell.fit, *cell.held_out):
        n = test.time_s.shape
        assert n == test.current_A.shape == test.voltage_V.shape
        assert test.time_s[0] == 0.0
        assert np.all(np.diff(test.time_s) > 0)
        volts = test.voltage_V / cell.baseline.series
        assert np.isfinite(volts).mean() > 0.96  # rows that are put back between pulses have none
        assert np.nanmin(volts) > 1.9
        assert np.nanmax(volts) < 4.6
        assert 0 < test.drawn_C[-1] < 1.15 * cell.baseline.window_C
        seen = np.isfinite(volts)
        slope = np.polyfit(test.current_A[seen], volts[seen], 1)[0]
        assert slope < 0 or np.ptp(test.current_A) < 0.2 * test.current_A.max()  # sign of current
        if test.temperature_K is not None:
            assert test.temperature_K.shape == n
            assert test.temperature_K.min() > 250
            assert test.temperature_K.max() < 340


def test_the_charge_between_panasonics_pulses_is_back() -> None:
    try:
        test = panasonic.pulses(SHARED)
    except NotHere as e:
        pytest.skip(str(e))
    # 2.7728 Ah by the cycler's counter; pulses that rise within 0.1 s lose half of that: 9 mAh
    assert test.drawn_C[-1] / 3600 == pytest.approx(2.7728, abs=0.01)
    assert np.diff(test.time_s).min() > 0.0
    assert np.diff(test.time_s).max() < 10.2  # s: a longer step is a pause of the logger


def test_panasonics_slow_charge_puts_back_what_was_drawn() -> None:
    """But for 24 mV between the rests before and after, at the 0.7 V/Ah that the pulses show."""
    try:
        test = panasonic.flowed(panasonic.read(SHARED, panasonic.SLOW, "C/20")[0])
    except NotHere as e:
        pytest.skip(str(e))
    first_V, last_V = test.voltage_V[[0, -1]]
    assert first_V - last_V == pytest.approx(0.024, abs=1e-3)
    assert test.drawn_C[-1] / 3600 == pytest.approx(0.035, abs=0.01)  # 0.38 as it is written down


@pytest.mark.parametrize(("degrees", "counted_Ah"), [(25, 30.51), (10, 30.28), (40, 30.75)])
def test_the_charge_of_a_leafs_pulses_is_what_the_cycler_counted(
    degrees: int, counted_Ah: float
) -> None:
    """By the counters of its steps; 31.2 Ah where the first minute of each rest still flows."""
    try:
        pulses = leaf_cell.pulses(SHARED, degrees)
    except NotHere as e:
        pytest.skip(str(e))
    assert pulses.drawn_C[-1] / 3600 == pytest.approx(counted_Ah, abs=0.01)
    told = held_V(pulses).reference(ambient_K=298.15)
    assert told.drawn_C()[-1] / 3600 == pytest.approx(counted_Ah, abs=0.01)
    assert (told.mixed() == np.isnan(pulses.voltage_V)).all()  # so no calibration compares them


@pytest.mark.parametrize(("times", "lasted_s"), [(1, 3568.8), (2, 1762.3), (3, 1122.4)])
def test_a_leafs_discharge_begins_when_its_current_does(times: int, lasted_s: float) -> None:
    """By the clock of its step; its first voltage is a second later, and no calibration has one."""
    try:
        whole = leaf_cell.discharge(SHARED, times)
    except NotHere as e:
        pytest.skip(str(e))
    assert whole.time_s[-1] == pytest.approx(lasted_s, abs=2e-3)
    heard = np.isfinite(whole.voltage_V)
    assert heard.argmax() == 1
    assert heard[1:].all()
    (part,) = recorded_parts(whole)
    told = part.reference(ambient_K=298.15)
    assert told.time_s[1] == pytest.approx(1.0, abs=2e-3)
    assert told.current_A[:2] == pytest.approx(30.6 * times)
    assert np.flatnonzero(told.mixed()).tolist() == [0]


def test_a_row_without_a_voltage_gets_the_one_before() -> None:
    volts = np.array([4.0, np.nan, 3.9, np.nan, np.nan])
    test = RealTest(name="t", time_s=np.arange(5.0), current_A=np.ones(5), voltage_V=volts)
    assert held_V(test).voltage_V.tolist() == [4.0, 4.0, 3.9, 3.9, 3.9]


def test_a_first_voltage_under_load_is_not_one_of_rest() -> None:
    """One discharge of the LG M50 has it in a row without a current; all others begin at rest."""
    try:
        raw = matlab(recording(SHARED, lg_m50.RATES))
    except NotHere as e:
        pytest.skip(str(e))
    slow, fast = (lg_m50.rate(raw, 45, name) for name in ("1C", "1.5C"))
    assert slow.current_A[0] == 0.0
    assert fast.current_A[0] == fast.current_A[1] > 4.0
    assert slow.voltage_V[0] - fast.voltage_V[0] > 0.1  # both cells had been charged alike


def test_the_lg_m50_of_2c_was_in_a_mount_that_cools_less() -> None:
    """What no twin of slower tests can know: docs/proof_history.md."""
    try:
        raw = matlab(recording(SHARED, lg_m50.RATES))
    except NotHere as e:
        pytest.skip(str(e))
    for degrees in (0, 10, 25):
        half_s, one_s, two_s = (lg_m50.cools_s(raw, degrees, n) for n in ("0.5C", "1C", "2C"))
        assert two_s > 1.25 * one_s
        assert half_s == pytest.approx(one_s, rel=0.2)


def test_no_activation_energy_makes_the_leafs_first_drop_what_it_is_in_the_cold() -> None:
    """From 25 to 40 degC it falls by little, to 10 degC it rises by far more.

    The contact was another, or a temperature not what its file says.

    Beside any resistance that temperature does not change, what goes with 100 kJ/mol (the built-in
    cells have 12 to 81) rises 8.7 times as much from 25 to 10 degC as it falls to 40 degC.
    """
    try:
        drops_ohm = {
            degrees: _first_drop_ohm(leaf_cell.pulses(SHARED, degrees)) for degrees in (10, 25, 40)
        }
    except NotHere as e:
        pytest.skip(str(e))
    rates = {c: np.exp(-100e3 / 8.314 * (1 / (c + 273.15) - 1 / 298.15)) for c in drops_ohm}
    most = (1 / rates[10] - 1) / (1 - 1 / rates[40])
    assert most == pytest.approx(8.7, abs=0.1)
    rises, falls = drops_ohm[10] - drops_ohm[25], drops_ohm[25] - drops_ohm[40]
    assert rises > 2 * most * falls
    assert rises == pytest.approx(1.0e-3, abs=0.1e-3)


def _first_drop_ohm(pulses: RealTest) -> float:
    """Mean over the pulses at 30 A but the first and the last, 0.2 s after their current began."""
    flows = pulses.current_A > 25.0
    begins = np.flatnonzero(~flows[:-1] & flows[1:])[1:-1]
    drops = []
    for at in begins.tolist():
        before = np.flatnonzero(np.isfinite(pulses.voltage_V[: at + 1]))[-1]
        own = slice(at + 1, at + 40)
        since_s, volts = pulses.time_s[own] - pulses.time_s[at + 1], pulses.voltage_V[own]
        seen = np.isfinite(volts)
        after_V = np.interp(0.2, since_s[seen], volts[seen])
        drops.append((pulses.voltage_V[before] - after_V) / pulses.current_A[at + 1])
    return float(np.mean(drops))
