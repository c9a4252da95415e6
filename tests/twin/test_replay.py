"""A solution beside a recording, and the command that makes one from a CSV."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tests.reports import example
from twin.__main__ import main
from twin.load import Between, Load, LoadError
from twin.load_csv import read_load_csv
from twin.replay import Replay
from twin.solution import Status
from twin.whole_file import write_whole

PACK = '[pack]\nname = "a"\ncell = "lipo_2200"\nseries = 4\n[start]\nsoc = 0.9\n'


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
    "header", ["time_s,current_A,voltage_V", "Test Time / s, Current / A ,Voltage / V,Step"]
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


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,current_A\n0,1\n", "no column 'time_s'"),
        ("", "no column 'time_s'"),
        ("time_s,current_A\n0,1\n1,x\n", "load.csv, line 3: current_A is 'x', no number"),
        ("time_s,current_A\n0,1\n1\n", "line 3: current_A is ''"),
        ("time_s,current_A\n", "needs a sample or more"),
        ("time_s,current_A\n1,1\n0,1\n", r"does not exceed"),
        ("time_s,current_A\n0,1\n1,nan\n", "not finite"),
    ],
)
def test_a_bad_load_is_wrong_use_with_the_place(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "load.csv").write_text(text, encoding="utf-8")
    (tmp_path / "pack.toml").write_text(PACK, encoding="utf-8")
    result = run(tmp_path)
    assert result.exit_code == 2
    assert said in result.output
    assert not (tmp_path / "out").exists()


def run(folder: Path):
    return CliRunner().invoke(
        main,
        ["replay", str(folder / "load.csv"), "--pack", str(folder / "pack.toml"), "--out",
         str(folder / "out")],
    )  # fmt: skip


def test_a_load_is_replayed_into_a_table_and_a_drawing(tmp_path: Path) -> None:
    (tmp_path / "load.csv").write_text(
        "time_s,current_A,voltage_V\n0,0,16.4\n1,20,15.9\n60,20,15.5\n", encoding="utf-8"
    )
    (tmp_path / "pack.toml").write_text(PACK, encoding="utf-8")
    result = run(tmp_path)
    assert result.exit_code == 0, result.output
    assert "mV RMS" in result.output
    rows = (tmp_path / "out" / "replay.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 4
    assert (tmp_path / "out" / "replay.svg").read_text(encoding="utf-8").endswith("</svg>\n")


def test_a_load_beyond_the_pack_is_written_as_far_as_it_came(tmp_path: Path) -> None:
    (tmp_path / "load.csv").write_text(
        "time_s,current_A\n0,20\n3600,20\n", encoding="utf-8"
    )  # 20 Ah from 2.2 Ah
    (tmp_path / "pack.toml").write_text(PACK, encoding="utf-8")
    result = run(tmp_path)
    assert result.exit_code == 1
    assert "cut-off" in result.output or "lithium" in result.output
    assert (tmp_path / "out" / "replay.csv").is_file()


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
