"""Reading a test: headers, signs, series, and what cannot be calibrated from."""

import io
from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import cell_pack
from twin.at_rest import open_circuit_V
from twin.calibrate.check_ups import read_check_ups
from twin.calibrate.reference import ReferenceTest, left_unknown, reference_test
from twin.calibrate.table import CalibrationError, MeasuredTable, read_test
from twin.columns import TableError
from twin.mismatch import read_hidden_csv
from twin.pack import Pack


def read(header: str, *lines: str) -> MeasuredTable:
    return read_test(io.StringIO("\n".join([header, *lines])), name="t.csv")


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("Test Time / s,Current / A,Voltage / V", (1, 1, 1)),
        ("time_s,current_A,voltage_V", (1, 1, 1)),
        ("time_ms,current_mA,voltage_mV", (1e-3, 1e-3, 1e-3)),
        ("Time [min],I (A),U [V]", (60, 1, 1)),
        ("Test_Time(s),Current(A),Voltage(V)", (1, 1, 1)),
        ("test_time_second,cell_current_ampere,pack_voltage_volt", (1, 1, 1)),
        ("\ufeffTime (h),Current (mA),Voltage (V)", (3600, 1e-3, 1)),
    ],
)
def test_headers_name_quantity_and_unit(header: str, factor: tuple[float, ...]) -> None:
    table = read(header, "10,-2,4000", "11,3,3900")
    assert table.time_s == pytest.approx([0, factor[0]])
    assert table.current_A == pytest.approx([-2 * factor[1], 3 * factor[1]])
    assert table.voltage_V == pytest.approx([4000 * factor[2], 3900 * factor[2]])
    assert table.temperature_K is None


def test_a_temperature_in_celsius_is_that_of_the_surroundings() -> None:
    table = read("Time / s,Current / A,Voltage / V,Temperature / degC", "0,0,4.1,20", "1,1,4.0,21")
    assert reference_test(table, cell_pack()).ambient_K == pytest.approx(293.15)


def test_a_thermometer_that_is_read_now_and_then_takes_no_current_away() -> None:
    """A pulse of 4 s between two readings of every tenth second."""
    lines = [f"{t},{2 if 3 <= t < 7 else 0},4.0,{20 + t if t % 10 == 0 else ''}" for t in range(31)]
    table = read("Time / s,Current / A,Voltage / V,Temperature / degC", *lines)
    assert table.time_s.size == 31
    assert table.current_A.sum() == pytest.approx(8.0)
    assert table.temperature_K == pytest.approx(293.15 + table.time_s)
    assert table.remarks == ("temperature_K: measured in 4 of 31 lines, straight in between",)
    ends = [f"{t},1,4,{20 if 3 <= t < 7 else ''}" for t in range(10)]
    early = read("Time / s,Current / A,Voltage / V,Temperature / degC", *ends)
    assert early.temperature_K is not None
    assert np.flatnonzero(np.isfinite(early.temperature_K)).tolist() == [3, 4, 5, 6]
    assert early.remarks[0].endswith("straight in between, unknown before and after (6 lines)")
    empty = read("Time / s,Current / A,Voltage / V,Temperature / degC", "0,1,4,", "1,1,4,")
    assert empty.temperature_K is None
    assert empty.remarks == ("temperature_K: the column is empty",)


def test_a_temperature_at_the_start_alone_says_nothing_of_how_a_cell_warms() -> None:
    lines = [f"{t},1,{4 - t / 100},{10 if t == 0 else ''}" for t in range(10)]
    table = read("Time / s,Current / A,Voltage / V,Temperature / degC", *lines)
    test = reference_test(table, cell_pack())
    assert test.ambient_K == pytest.approx(283.15)
    assert test.temperature_K is None


@pytest.mark.parametrize("title", ["Temperature", "Temp / F", "Temperature / °F", "T_cell [F]"])
def test_a_temperature_in_no_unit_that_is_known_is_refused(title: str) -> None:
    """It would be as if there was none, and every test at the pack file's."""
    with pytest.raises(TableError, match="is a temperature in no unit that is known"):
        read(f"Time / s,Current / A,Voltage / V,{title}", "0,0,4.1,68", "1,1,4,68")


@pytest.mark.parametrize("title", ["T / degC", "Tcell / °C", "T_surf (C)", "Cell Temp / C"])
def test_a_temperature_by_its_letter(title: str) -> None:
    table = read(f"t / s,I / A,U / V,{title},Attempt", "0,0,4.1,20,1", "1,1,4,20,1")
    assert table.temperature_K == pytest.approx([293.15, 293.15])


def test_a_time_that_begins_anew_with_each_step_is_not_that_of_the_test() -> None:
    rows = "0,0,1,4", "1,1,1,4", "0,2,1,4", "1,3,1,4"
    table = read("Step Time / s,Test Time / s,Current / A,Voltage / V", *rows)
    assert table.time_s == pytest.approx([0, 1, 2, 3])
    with pytest.raises(CalibrationError, match=r"line 4: 'Step Time / s' .* in 1 it goes back"):
        read("Step Time / s,Cycle,Current / A,Voltage / V", *rows)


def test_lines_that_measured_nothing_are_left_out_and_counted() -> None:
    """A voltage of exactly 0 is that of a channel that dropped out."""
    rows = "0,0,4.1", "1,2,4.0", "2,2,", "2,nan,4", "2,3.4e38,4", "3,2,0.0", "", "4,2,3.9"
    table = read("Time / s,Current / A,Voltage / V", *rows)
    assert table.voltage_V == pytest.approx([4.1, 4.0, 3.9])
    assert [r.split(" were")[0] for r in table.remarks] == [
        "lines without time, current or voltage: 3",
        "lines with a voltage of 0, which is none: 1",
    ]
    assert reference_test(table, cell_pack()).remarks[:2] == table.remarks
    cells = read("Time / s,Current / A,Cell 1 / V,Cell 2 / V", "0,0,4,4", "1,1,4,0", "2,1,4,4")
    assert cells.voltage_V == pytest.approx([8.0, 8.0])


UNCLOSED = '"' + "1,2,3\n" * 30_000  # more than the csv module takes for one cell


@pytest.mark.parametrize("header", ["Time / s,Current / A,Voltage / V\n0,0,4\n", ""])
def test_a_quote_that_is_not_closed_is_told_with_its_line(header: str) -> None:
    with pytest.raises(TableError, match=r"t\.csv, line \d+: not a readable CSV: field"):
        read_test(io.StringIO(header + UNCLOSED), name="t.csv")
    with pytest.raises(TableError, match=r"l\.csv, line \d+: not a readable CSV: field"):
        read_check_ups(io.StringIO("Cycle,Capacity / Ah\n" + UNCLOSED), name="l.csv")
    with pytest.raises(TableError, match=r"h\.csv, line \d+: not a readable CSV: field"):
        read_hidden_csv(io.StringIO("time_s,temperature_c\n" + UNCLOSED), name="h.csv")


@pytest.mark.parametrize(
    ("title", "value", "said"),
    [
        ("Temperature / degC", "298.15", "'Temperature / degC' is 298.15, which is 571.30 K"),
        ("Temperature / degC", "298.15", "expected 200 to 400 K (1 such lines): is it in K?"),
        ("Temperature / K", "25", "is 25, which is 25.00 K; expected 200 to 400 K"),
        ("Temperature / K", "25", "is it in degC?"),
        ("Chamber temp (C)", "300", "'Chamber temp (C)' is 300"),
        ("Temperature / degC", "-999", "which is -725.85 K; expected 200 to 400 K (1 such lines)"),
    ],
)
def test_a_temperature_that_no_pack_has_is_refused_with_its_line(
    title: str, value: str, said: str
) -> None:
    usual = "293.15" if title.endswith("K") else "20"
    with pytest.raises(CalibrationError, match=r"^t\.csv, line 3: ") as refused:
        read(f"Time / s,Current / A,Voltage / V,{title}", f"0,0,4.1,{usual}", f"1,1,4.0,{value}")
    assert said in str(refused.value)
    assert "is it in" in str(refused.value) or value == "-999"


@pytest.mark.parametrize(
    ("columns", "of_cell_K", "around_K"),
    [
        ("Surface Temperature / degC,Ambient Temperature / degC", 293.15, 293.15),
        ("Chamber temp (C),Surface temp (C)", 283.15, 283.15),
        ("Ambient Temperature / degC,Pressure / Pa", None, 293.15),
        ("Pressure / Pa,Chamber temp (C)", None, 283.15),
        ("Pressure / Pa,Cycle", None, 298.15),
    ],
)
def test_a_temperature_of_the_air_is_not_the_cells(
    columns: str, of_cell_K: float | None, around_K: float
) -> None:
    table = read(f"Time / s,Current / A,Voltage / V,{columns}", "0,0,4.1,20,10", "1,1,4.0,21,11")
    test = reference_test(table, cell_pack())
    assert (None if test.temperature_K is None else test.temperature_K[0]) == of_cell_K
    assert test.ambient_K == around_K


@pytest.mark.parametrize(
    ("header", "lines", "says"),
    [
        ("Time / s,Voltage / V", ("0,4",), "no column for current_A"),
        ("Time / s,Current / A,Voltage / V", ("0,1,4", "1,x,4"), "line 3: current_A is 'x'"),
        (
            "Time / s,Current / A,Voltage / V",
            ("0,1,4", "0,1,4"),
            "line 3: 'Time / s' does not exceed",
        ),
        ("Time / s,Current / A,Voltage / V", ("0,1,4",), "1 samples"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(header: str, lines: tuple[str, ...], says: str) -> None:
    with pytest.raises((CalibrationError, TableError), match=says):
        read(header, *lines)


def test_a_test_without_current_or_answer_is_refused() -> None:
    steady = MeasuredTable(
        name="t", time_s=np.arange(5.0), current_A=np.ones(5), voltage_V=np.full(5, 3.7),
        temperature_K=None,
    )  # fmt: skip
    with pytest.raises(CalibrationError, match="zero throughout"):
        reference_test(replace(steady, current_A=np.zeros(5)), cell_pack())
    with pytest.raises(CalibrationError, match="does not answer"):
        reference_test(steady, cell_pack())


def test_a_wrong_series_count_is_named_with_the_one_that_fits() -> None:
    voltage = np.linspace(16.7, 13.5, 50)
    table = MeasuredTable(
        name="t.csv", time_s=np.arange(50.0), current_A=np.ones(50), voltage_V=voltage,
        temperature_K=None,
    )  # fmt: skip
    cell = cell_pack().cell
    with pytest.raises(CalibrationError, match="it fits 4 or 5 in series"):
        reference_test(table, Pack(cell=cell, series=3))
    test = reference_test(table, Pack(cell=cell, series=4, parallel=2))
    assert test.voltage_V == pytest.approx(voltage / 4)
    assert test.current_A == pytest.approx(np.full(50, 0.5))


def test_tests_that_reach_no_cut_off_leave_the_ends_unknown() -> None:
    def over(high: float, low: float) -> ReferenceTest:
        return ReferenceTest(
            name="t", time_s=np.arange(9.0), current_A=np.array([0.0, *np.ones(8)]),
            voltage_V=np.linspace(high, low, 9),
        )  # fmt: skip

    pack = cell_pack()
    full, empty = pack.cell.upper_cut_off_V, pack.cell.lower_cut_off_V
    assert left_unknown((over(full, empty),), pack) == ()
    (said,) = left_unknown((over(full, 3.6),), pack)
    assert "lower cut-off" in said
    (said,) = left_unknown((over(3.8, empty),), pack)
    assert "upper cut-off" in said


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1e-3, "0.00187 Ah while its voltage goes through 8.% of its charge, but is labelled 2.2"),
        (1e3, "1.87e[+]03 Ah, but is labelled 2.2 Ah: check units"),
        (60.0, "112 Ah, but is labelled 2.2 Ah: check units"),
    ],
)
def test_a_charge_of_another_unit_is_told(factor: float, said: str) -> None:
    """A column in mA that is headed A, and the reverse; minutes headed h."""
    table = discharged(factor)
    with pytest.raises(CalibrationError, match=said):
        reference_test(table, cell_pack())


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.8])
def test_a_cell_may_hold_less_or_more_than_its_label(factor: float) -> None:
    assert reference_test(discharged(factor), cell_pack()).drawn_C()[-1] > 0


def discharged(factor: float) -> MeasuredTable:
    """At 1.1 A through 85 % of the charge of the cell, the current then multiplied."""
    cell, time_s = cell_pack().cell, np.linspace(0.0, 6120.0, 500)
    soc = 0.95 - time_s / 7200
    return MeasuredTable(
        name="t", time_s=time_s, current_A=np.full(500, 1.1 * factor),
        voltage_V=np.array([open_circuit_V(cell, s) for s in soc]), temperature_K=None,
    )  # fmt: skip
