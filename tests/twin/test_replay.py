"""A solution beside a recording, a load from a CSV, and files that appear whole."""

import io
from pathlib import Path

import numpy as np
import pytest

from tests.reports import example
from twin.columns import TableError
from twin.load import Between, Load, LoadError
from twin.load_csv import LoadTable, read_load_csv
from twin.replay import Replay
from twin.solution import Status
from twin.whole_file import write_whole


def replay(recorded_V: np.ndarray, judged: np.ndarray, samples: int) -> Replay:
    return Replay(
        load=Load(time_s=example.T, current_A=example.CURRENT),
        recorded_V=recorded_V,
        judged=judged,
        solution=example.solution(Status.LOWER_CUT_OFF, samples),
    )


def test_the_error_counts_judged_and_measured_samples_up_to_where_it_ended() -> None:
    recorded = np.full(example.T.size, np.nan)
    solution = example.solution(Status.LOWER_CUT_OFF, 100)
    recorded[10:110] = 99.0  # not judged, or beyond the end
    recorded[20:40] = solution.voltage_V[20:40] + 0.03
    recorded[40:60] = solution.voltage_V[40:60] - 0.04
    judged = np.zeros(example.T.size, dtype=bool)
    judged[20:60] = judged[100:] = True
    got = replay(recorded, judged, 100)
    assert got.rmse_V == pytest.approx(np.sqrt((0.03**2 + 0.04**2) / 2))
    assert got.max_error_V == pytest.approx(0.04)


def test_without_a_measured_voltage_there_is_no_error_rather_than_none_at_all() -> None:
    nothing = np.full(example.T.size, np.nan)
    got = replay(nothing, np.ones(example.T.size, dtype=bool), 100)
    assert (got.rmse_V, got.max_error_V) == (None, None)


def test_a_solution_of_another_load_is_refused() -> None:
    with pytest.raises(LoadError, match="not on the times"):
        Replay(
            load=Load(time_s=example.T + 1, current_A=example.CURRENT),
            recorded_V=example.T,
            judged=example.T > 0,
            solution=example.solution(),
        )


@pytest.mark.parametrize(
    "header",
    [
        "time_s,current_A,voltage_V",
        "Test Time / s, Current / A ,Voltage / V,Step",
        "Time [s],I[A],U[V]",
        "time/s,<I>/A,Ewe/V",
        "time/s,I/A,Ecell/V",
        "Time (s),Current (A),Potential (V)",
        "t/s,Ibatt_A,Vbat_V",
        "t [s],I [A],V_batt [V]",
        "\ufefftest_time_second,current_ampere,voltage_volt,ambient_temp_C",
    ],
)
def test_columns_are_known_by_their_header(tmp_path: Path, header: str) -> None:
    file = tmp_path / "load.csv"
    file.write_text(f"{header}\n0,1,16.5\n1,2,\n\n2,3,16.3\n", encoding="utf-8")
    with file.open(encoding="utf-8", newline="") as stream:
        table = read_load_csv(stream, name="load.csv")
    load = table.load(between=Between.HOLD, ambient_K=290.0)
    np.testing.assert_array_equal(load.current_A, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(table.voltage_V, [16.5, np.nan, 16.3])
    assert load.charge_C() == 3.0


def read(text: str) -> LoadTable:
    return read_load_csv(io.StringIO(text), name="load.csv")


def test_units_temperature_and_cells_are_read_and_the_air_is_not_the_pack() -> None:
    table = read(
        "Time / min,Current / mA,Cell 1 / V,Cell 2 / mV,Ambient Temp / degC,Cell Temp / degC\n"
        "0,1000,4.1,4000,10,20\n1,2000,4.0,,n/a,21\n"
    )
    np.testing.assert_allclose(table.time_s, [0.0, 60.0])
    np.testing.assert_allclose(table.current_A, [1.0, 2.0])
    assert table.cell_voltage_V is not None
    np.testing.assert_allclose(table.cell_voltage_V, [[4.1, 4.0], [4.0, np.nan]])
    np.testing.assert_allclose(table.voltage_V, [8.1, np.nan])
    np.testing.assert_allclose(table.temperature_K, [293.15, 294.15])


@pytest.mark.parametrize("blank", ["Cell 3 / V", "Voltage / V"])
def test_a_column_without_an_entry_is_no_cell_and_no_voltage(blank: str) -> None:
    rows = "".join(f"{t},{-t % 7},{4.1 - 0.01 * (-t % 7)},4,\n" for t in range(30))
    table = read(f"Time / s,Current / A,Cell 1 / V,Cell 2 / V,{blank}\n{rows}")
    assert table.cell_voltage_V is not None
    assert table.cell_voltage_V.shape == (30, 2)
    assert table.voltage_V == pytest.approx(table.cell_voltage_V.sum(axis=1))
    assert table.remarks == ()


@pytest.mark.parametrize("title", ["Temperature", "temperature_F"])
def test_a_temperature_in_no_unit_that_is_known_is_told(title: str) -> None:
    """A pack at 5 degC would be one at 25, not measured, and look like a cold one."""
    table = read(f"time_s,current_A,voltage_V,{title}\n0,1,16,41\n1,2,16,41\n")
    assert table.temperature_K is None
    assert table.remarks[-1].startswith(f"{title!r} is a temperature in no unit that is known")


def test_units_change_nothing() -> None:
    plain = read("time_s,current_A,voltage_V\n0,0.5,16.2\n1.5,20,15.4\n")
    scaled = read("Time / ms,Current / mA,Voltage / mV\n0,500,16200\n1500,20000,15400\n")
    for name in ("time_s", "current_A", "voltage_V"):
        np.testing.assert_allclose(getattr(scaled, name), getattr(plain, name))


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (["0", "1", "1.7e9", "1700000001"], r"19676 days.*1.7e\+09 s, is before line 4"),
        ([f"{k}e5" for k in range(600)], "693 days long"),
    ],
    ids=["a clock that was set", "microseconds that are called seconds"],
)
def test_what_no_twin_could_follow_is_refused(times: list[str], said: str) -> None:
    with pytest.raises(TableError, match=said):
        read("\n".join(["time_s,current_A", *(f"{t},1" for t in times)]))


def test_lines_that_cannot_be_used_are_left_out_and_told() -> None:
    table = read("time_s,current_A,voltage_V\n0,0,4\n1,1,4\n1,2,3.9\n2,nan,3.8\n3,2,3.7\n4,2\n5")
    np.testing.assert_array_equal(table.time_s, [0.0, 1.0, 3.0, 4.0])
    np.testing.assert_array_equal(table.current_A, [0.0, 2.0, 2.0, 2.0])
    np.testing.assert_array_equal(table.voltage_V, [4.0, 3.9, 3.7, np.nan])
    assert table.remarks == (
        "Lines that have no time, or no current that can flow, are left out: 2.",
        "Lines that have the time of the line after them are left out: 1.",
        "Lines without a voltage, where nothing is compared with it: 1.",
    )


def test_both_sides_of_a_step_count() -> None:
    """As cyclers write it, at one time: 5 A for an hour is 5 Ah, and the loaded voltage is read."""
    rows = [(0, 0, 4.2), (0, 5, 4.1), *((60 * k, 5, 4.1 - 0.01 * k) for k in range(1, 61))]
    rows += [(3600, 0, 3.6), *((3600 + 60 * k, 0, 3.6) for k in range(1, 5))]
    table = read("\n".join(["time_s,current_A,voltage_V", *(",".join(map(str, r)) for r in rows)]))
    load = table.load(between=Between.LINEAR, ambient_K=298.15)
    assert load.drawn_C()[-1] == pytest.approx(18000.0, rel=1e-4)
    assert np.diff(table.time_s).min() == pytest.approx(0.06)
    assert table.voltage_V is not None
    assert table.voltage_V[table.current_A == 5.0][-1] == pytest.approx(3.5)
    (said,) = table.remarks
    assert said.endswith("count as just before it: 2.")


def test_a_clock_in_whole_seconds_has_no_steps() -> None:
    lines = [f"{k // 2},{5 + k % 3},{4 - 0.01 * (k % 3)}" for k in range(40)]
    table = read("\n".join(["time_s,current_A,voltage_V", *lines]))
    assert np.diff(table.time_s).tolist() == [1.0] * 19
    assert "have the time of the line after them are left out: 20." in table.remarks[0]


def test_a_constant_current_has_a_sign_and_none_at_all_stays() -> None:
    text = "time_s,current_A,voltage_V\n0,{0},4.1\n10,{0},4.0\n20,{0},3.95\n"
    assert read(text.format(-2)).current_A[0] == 2.0
    assert read(text.format(2)).current_A[0] == 2.0
    assert read(text.format(0)).remarks == ()


def test_a_file_is_replaced_in_one_step_or_left_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    write_whole(file, "first\r\n")
    assert file.read_bytes() == b"first\r\n"
    with pytest.raises(UnicodeEncodeError):
        write_whole(file, "\udcff")
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert file.read_bytes() == b"first\r\n"


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_what_stops_a_write_leaves_no_part_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    def stopped(*_: object) -> None:
        raise error

    monkeypatch.setattr(Path, "replace", stopped)
    with pytest.raises(type(error)):
        write_whole(tmp_path / "a.txt", "text")
    assert not list(tmp_path.iterdir())


def test_lines_without_a_voltage_are_counted() -> None:
    text = "time_s,current_A,voltage_V\n0,-1,{}\n1,-2,{}\n2,-3,\n"
    some, none = read(text.format("4.1", "4.0")), read(text.format("", ""))
    assert "Lines without a voltage, where nothing is compared with it: 1." in some.remarks
    assert none.remarks == (
        "No line has a voltage, which would say if positive current discharges: so taken.",
    )


def test_no_voltage_at_all_is_none_and_is_told() -> None:
    """A sensor that drops out writes 0."""
    table = read("time_s,current_A,voltage_V\n0,1.0,4.1\n1,3.0,0\n2,3.0,0.0\n3,3.0,4.02\n")
    assert table.voltage_V is not None
    assert np.isnan(table.voltage_V).tolist() == [False, True, True, False]
    assert any("a voltage of 0 V" in r and r.endswith(": 2.") for r in table.remarks)
    assert table.current_A.tolist() == [1.0, 3.0, 3.0, 3.0]  # which zeros would have turned round


def test_a_cell_that_drops_out_takes_the_sum_with_it_and_no_place_without_one_does() -> None:
    table = read(
        "time_s,current_A,cell_1_v,cell_2_v,cell_3_v\n0,0.1,4.1,4.1,0\n1,9,3.9,0,0\n2,9,3.9,3.8,0\n"
    )
    assert table.voltage_V == pytest.approx([8.2, np.nan, 7.7], nan_ok=True)
    assert table.cell_voltage_V is not None
    assert table.cell_voltage_V.shape == (3, 2)
    assert table.current_A.tolist() == [0.1, 9.0, 9.0]
    assert any("a voltage of 0 V" in r and r.endswith(": 1.") for r in table.remarks)


def test_a_temperature_that_no_pack_can_have_is_none_and_counted() -> None:
    table = read("time_s,current_A,temperature_c\n0,1,20\n1,1,-999\n2,1,21\n")
    assert table.temperature_K == pytest.approx([293.15, np.nan, 294.15], nan_ok=True)
    assert any("that no pack can have" in r and r.endswith(": 1.") for r in table.remarks)


def test_the_largest_number_that_a_logger_has_is_no_measurement() -> None:
    """Of a published test: 3.4e38 A in its first row, for no answer."""
    table = read(
        "time_s,current_A,voltage_V\n0,3.40E+38,4.15\n1,3.0,4.04\n2,3.0,-3.4e38\n3,3.0,4.02"
    )
    assert table.time_s.tolist() == [1.0, 2.0, 3.0]
    assert table.current_A.tolist() == [3.0] * 3
    assert table.voltage_V is not None
    assert np.isnan(table.voltage_V).tolist() == [False, True, False]
    assert table.remarks[0].endswith("no current that can flow, are left out: 1.")
