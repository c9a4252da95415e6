"""Channels kept from the twin: read from a CSV, compared with what it says of them."""

import io
from dataclasses import replace
from math import nan

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown, pack
from twin.columns import TableError
from twin.effects import SelfHeating, SeriesResistance, WeakCell
from twin.load_csv import read_load_csv
from twin.mismatch import Hidden, HiddenTable, MismatchError, read_hidden_csv, reveal, reveal_json
from twin.mismatch.left import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate


def read(text: str) -> HiddenTable:
    return read_hidden_csv(io.StringIO(text), name="x.csv")


def test_columns_are_told_by_quantity_and_unit() -> None:
    table = read(
        "Test Time / s,Ambient Temperature / degC,Temperature / degC,Cell 1 / V,cell_2_mv,note\n"
        "0,99,25,4.1,4000,a\n2,99,26.5,4.0,,b\n"
    )
    assert table.time_s.tolist() == [0.0, 2.0]
    assert table.temperature_K is not None
    assert table.temperature_K.tolist() == [298.15, 299.65]
    assert table.cell_voltage_V[0].tolist() == [4.1, 4.0]
    assert table.cell_voltage_V[1, 0] == 4.0
    assert np.isnan(table.cell_voltage_V[1, 1])


def test_units_at_the_end_of_long_headers_and_times_that_stand_twice() -> None:
    """As laboratories and simulators write them."""
    table = read(
        "test_time_second,cell_temp_C,temperature_t2_celsius\n0,20,1\n0,30,1\n1,21,1\n,,\n"
    )
    assert table.time_s.tolist() == [0.0, 1.0]
    assert table.temperature_K is not None
    assert table.temperature_K.tolist() == [303.15, 294.15]


@pytest.mark.parametrize("title", ["Step Time / s,Test Time / s", "Elapsed time / h,time_s"])
def test_a_file_is_read_alike_as_a_load_and_as_what_is_revealed(title: str) -> None:
    """The time of the test, of lines with one time the last, no cell without a voltage."""
    text = (
        f"{title},Current / A,Temperature / degC,Cell 2 / V,Cell 1 / mV,Cell 3 / V\n"
        "0,0,1,20,4.0,4100,\n1,1,1,21,3.9,4000,\n0,1,1,22,3.8,3900,0\n1,3,1,-999,0,3800,\n"
        "2,4,1,3e38,3.7,nan,\n"
    )
    hidden, load = read(text), read_load_csv(io.StringIO(text), name="x.csv")
    assert hidden.time_s.tolist() == load.time_s.tolist() == [0.0, 1.0, 3.0, 4.0]
    assert load.temperature_K is not None
    assert load.cell_voltage_V is not None
    assert load.temperature_K.tolist() == pytest.approx([293.15, 295.15, nan, nan], nan_ok=True)
    np.testing.assert_array_equal(hidden.temperature_K, load.temperature_K)
    np.testing.assert_array_equal(hidden.cell_voltage_V, load.cell_voltage_V.T)
    np.testing.assert_allclose(hidden.cell_voltage_V[:, 0], [4.1, 4.0])


def test_what_stands_for_no_answer_is_none() -> None:
    table = read("time_s,temperature_c,cell_1_v\n0,20,4.0\n,21,4.0\n2,-999,0\n3,22,3.9\n")
    assert table.time_s.tolist() == [0.0, 2.0, 3.0]
    assert table.temperature_K is not None
    assert np.isnan(table.temperature_K).tolist() == [False, True, False]
    assert np.isnan(table.cell_voltage_V[0]).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected a column for time"),
        ("time_s,temperature_c\n0,298\n1,299\n", "is it in the unit that its header says"),
        ("time_s,voltage_V\n0,1\n1,1\n", "one for temperature"),
        ("temperature_c\n1\n", "expected a column for time"),
        ("time_s,temperature_c\n0,1\n1,x\n", "line 3: temperature_K is 'x', no number"),
        ("time_s,temperature_c\n1,1\n0,1\n", "clock goes back"),
        ("time_s,temperature_c\n,1\n", "no line has a time"),
        ("time_s,cell_1_v,Cell 1 / V\n0,4,4\n", "two columns have the voltage of cell 1"),
    ],
)
def test_a_bad_file_is_refused_with_the_place(text: str, said: str) -> None:
    with pytest.raises(TableError, match=said):
        read(text)


def hidden(*, series: int = 4) -> tuple[HiddenTable, SelfHeating, WeakCell]:
    """What a pack with a weak cell that warms itself would have shown, as its twin has it."""
    effects = SelfHeating(heat_transfer_W_m2_K=15.0), WeakCell(cell=3, resistance_ohm=5e-3)
    answer = simulate(replace(pack(), effects=effects), flown().load)
    cells = answer.cell_voltage_V[[2, 0, 1, 3][:series]]  # another order
    at = slice(None, None, 10)
    table = HiddenTable(
        name="x.csv", time_s=answer.time_s[at], temperature_K=answer.temperature_K[at],
        cell_voltage_V=cells[:, at],
    )  # fmt: skip
    return table, *effects


def test_the_twin_that_is_the_truth_predicts_what_was_hidden() -> None:
    """The place of the weak cell is not known to the twin, and not needed."""
    table, warm, weak = hidden()
    adopted = replace(pack(), effects=(warm, replace(weak, cell=0)))
    found = reveal(table, flight="f", load=flown().load, configured=pack(), adopted=adopted)
    assert [r.channel for r in found] == list(Hidden)
    for r in found:
        assert r.after is not None
        assert r.factor * r.rms(r.after) < 1e-6
    assert np.array_equal(found[1].measured, table.cell_voltage_V[0])  # the one with 5 mΩ more
    written = {c["channel"]: c for c in reveal_json(found)["channels"]}
    assert table.temperature_K is not None
    rise_K = table.temperature_K - pack().initial_K  # which an isothermal twin does not have
    assert written["temperature"]["rmse_before"] == pytest.approx(np.sqrt(np.mean(rise_K**2)))
    assert written["weakest_cell_voltage"]["rmse_before"] > 5.0  # mV: the drop over 5 mΩ
    assert written["weakest_cell_voltage"]["unit"] == "mV"


def test_a_start_that_is_off_by_a_constant_does_not_spoil_the_change() -> None:
    table, *effects = hidden()
    assert table.temperature_K is not None
    off = replace(table, temperature_K=table.temperature_K + 3.0, cell_voltage_V=np.zeros((0, 121)))
    twin = replace(pack(), effects=tuple(effects))
    (found,) = reveal(off, flight="f", load=flown().load, configured=twin, adopted=None)
    assert found.rms(found.before) == pytest.approx(3.0)
    assert found.change_rms(found.before) < 1e-9
    assert found.after is None
    assert reveal_json([found])["channels"][0]["rmse_after"] is None


@pytest.mark.parametrize("ended", ["configured", "adopted"])
def test_a_twin_that_is_empty_at_once_predicts_nothing(ended: str) -> None:
    table, *effects = hidden()
    twins: dict[str, Pack | None] = dict.fromkeys(
        ("configured", "adopted"), replace(pack(), effects=tuple(effects))
    )
    empty = replace(pack(), effects=(SeriesResistance(resistance_ohm=100.0),))
    assert not simulate(beyond_cut_offs(empty), flown().load).time_s.size
    found = reveal(table, flight="f", load=flown().load, **(twins | {ended: empty}))
    assert [r.channel for r in found] == list(Hidden)
    for r in found:
        assert r.after is not None
        assert np.isnan(r.rms(r.before)) == (ended == "configured")
        assert np.isnan(r.rms(r.after)) == (ended == "adopted")


def test_a_cell_that_was_not_measured_is_not_the_weakest() -> None:
    table, _, _ = hidden()
    cells_V = table.cell_voltage_V.copy()
    cells_V[3] = np.nan
    found = reveal(
        replace(table, cell_voltage_V=cells_V), flight="f", load=flown().load, configured=pack(),
        adopted=None,
    )  # fmt: skip
    assert [r.channel for r in found] == [Hidden.TEMPERATURE, Hidden.WEAKEST_CELL]
    assert np.array_equal(found[1].measured, cells_V[0])


def test_of_some_cells_only_the_weakest_is_compared() -> None:
    table, _, _ = hidden(series=2)
    found = reveal(table, flight="f", load=flown().load, configured=pack(), adopted=None)
    assert [r.channel for r in found] == [Hidden.TEMPERATURE, Hidden.WEAKEST_CELL]


def test_what_cannot_be_of_this_recording_is_refused() -> None:
    table, _, _ = hidden()
    late = replace(table, time_s=table.time_s + 1e4)
    with pytest.raises(MismatchError, match="clock of the recording"):
        reveal(late, flight="f", load=flown().load, configured=pack(), adopted=None)
    with pytest.raises(MismatchError, match="4 columns of cells, the pack has 3"):
        reveal(
            table, flight="f", load=flown().load, configured=replace(pack(), series=3), adopted=None
        )
