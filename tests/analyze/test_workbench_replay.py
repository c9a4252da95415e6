"""`twin replay`: a CSV, a log, a sweep; files, words and exit codes."""

import csv
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner, Result

from analyze.__main__ import main as analyse
from analyze.workbench.__main__ import main
from tests.analyze.workbench_inputs import PACK, put_load
from tests.flightlogs import px4_flight as px4
from twin.compiled import compiler

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "sample_logs"
FILES = {"replay.csv", "replay.parquet", "replay.svg", "summary.csv"}


def call(folder: Path, *arguments: str, pack: str = PACK) -> Result:
    (folder / "pack.toml").write_text(pack, encoding="utf-8")
    common = ["--pack", str(folder / "pack.toml"), "--out", str(folder / "out")]
    return CliRunner().invoke(main, ["replay", *arguments, *common])


def load(folder: Path, text: str) -> str:
    (folder / "load.csv").write_text(text, encoding="utf-8")
    return str(folder / "load.csv")


def table(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / "out" / name).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,current_A\n0,1\n", "header, such as 'Time / s' (s or ms or us or min or h); the first"),
        ("time_s;current_A\n0;1\n", "columns have to be parted by commas"),
        ("", "load.csv: the file is empty; expected a recording of time and current"),
        ("time_s,current_A\n0,1\n1,x\n", "load.csv, line 3: current_A is 'x', no number"),
        ("time_s,current_A\n", "no line has a time and a current"),
        ("time_s,current_A\n1,nan\n", "no line has a time and a current"),
        ("time_s,current_A\n0,1\n\n2,1\n1,1\n", "line 5: the clock goes back, from 2 s to 1 s"),
        ("time_s,current_A\n2,1\n1,1\n0,1\n", "(2 such lines; it runs backwards throughout)"),
    ],
)
def test_a_bad_load_is_wrong_use_with_the_place(tmp_path: Path, text: str, said: str) -> None:
    result = call(tmp_path, load(tmp_path, text))
    assert result.exit_code == 2
    assert said in result.output
    assert not (tmp_path / "out").exists()


def test_bytes_that_are_neither_log_nor_text_are_wrong_use(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"\xff\xfe\x00\x80" * 9)
    result = call(tmp_path, str(tmp_path / "x"))
    assert result.exit_code == 2
    assert "not a readable CSV, which is UTF-8 text" in result.output


def test_a_load_is_replayed_into_tables_and_a_drawing(tmp_path: Path) -> None:
    file = load(tmp_path, "time_s,current_A,voltage_V\n0,0,16.4\n1,20,15.9\n60,20,15.5\n")
    result = call(tmp_path, file)
    assert result.exit_code == 0, result.output
    assert {p.name for p in (tmp_path / "out").iterdir()} == FILES
    rows = table(tmp_path, "replay.csv")
    assert len(rows) == 61  # none further apart than a second
    assert [r["recorded_V"] for r in rows[:3]] == ["16.4", "15.9", ""]
    assert float(rows[-1]["charge_Ah"]) == pytest.approx((10 + 59 * 20) / 3600)
    stored = pq.read_table(tmp_path / "out" / "replay.parquet")
    assert stored.column("simulated_V").to_pylist() == [float(r["simulated_V"]) for r in rows]
    (row,) = table(tmp_path, "summary.csv")
    errors_mV = 1e3 * np.array(
        [float(r["recorded_V"]) - float(r["simulated_V"]) for r in rows if r["recorded_V"]]
    )
    assert float(row["voltage_rmse_mv"]) == pytest.approx(np.sqrt(np.mean(errors_mV**2)))
    assert row["status"] == "done"


def test_the_name_of_a_file_is_no_formula(tmp_path: Path) -> None:
    load(tmp_path, "time_s,current_A\n0,20\n5,20\n")
    (tmp_path / "load.csv").rename(tmp_path / "a$1_$2.csv")
    result = call(tmp_path, str(tmp_path / "a$1_$2.csv"))
    assert result.exit_code == 0, result.output
    assert "a$1_$2" in (tmp_path / "out" / "replay.svg").read_text(encoding="utf-8")


def test_a_load_beyond_the_pack_is_written_as_far_as_it_came(tmp_path: Path) -> None:
    result = call(tmp_path, load(tmp_path, "time_s,current_A\n0,20\n3600,20\n"))  # 20 of 2.2 Ah
    assert result.exit_code == 1
    assert "the voltage reached the lower cut-off" in result.output
    (row,) = table(tmp_path, "summary.csv")
    assert 0 < float(row["simulated_s"]) < 600
    assert {p.name for p in (tmp_path / "out").iterdir()} == FILES


def test_a_load_that_fails_at_once_gives_empty_tables(tmp_path: Path) -> None:
    result = call(tmp_path, load(tmp_path, "time_s,current_A\n0,5000\n9,5000\n"))
    assert result.exit_code == 1
    assert table(tmp_path, "replay.csv") == []
    (row,) = table(tmp_path, "summary.csv")
    assert (row["end_v"], float(row["charge_ah"])) == ("", pytest.approx(0.0, abs=1e-3))


def test_held_rows_draw_another_charge_than_straight_ones(tmp_path: Path) -> None:
    file = load(tmp_path, "time_s,current_A\n0,20\n60,0\n")
    drawn = []
    for between in ("hold", "linear"):
        assert call(tmp_path, file, "--between", between).exit_code == 0
        drawn.append(float(table(tmp_path, "summary.csv")[0]["charge_ah"]))
    assert drawn == pytest.approx([1 / 3, 1 / 6])


def test_a_log_is_replayed_as_the_analysis_does(tmp_path: Path) -> None:
    result = call(tmp_path, str(SAMPLES / "light.ulg"))
    assert result.exit_code == 0, result.output
    (row,) = table(tmp_path, "summary.csv")
    common = ["--pack", str(tmp_path / "pack.toml"), "--out", str(tmp_path / "analysis")]
    assert CliRunner().invoke(analyse, [str(SAMPLES / "light.ulg"), *common]).exit_code == 0
    text = (tmp_path / "analysis" / "light" / "result.json").read_text(encoding="utf-8")
    expected = json.loads(text)["replay"]
    assert float(row["voltage_rmse_mv"]) == pytest.approx(expected["voltage_rmse_mv"], rel=1e-9)
    assert float(row["max_error_mv"]) == pytest.approx(expected["max_error_mv"], rel=1e-9)


def test_the_battery_that_is_asked_for_is_drawn_from(tmp_path: Path) -> None:
    (tmp_path / "two.ulg").write_bytes(px4.ulog(more=[px4.other_pack(4.0, 15.9)]))
    for more, least, most in (([], 10.0, 20.0), (["--battery", "1"], 3.98, 4.02)):
        result = call(tmp_path, str(tmp_path / "two.ulg"), *more)
        assert result.exit_code == 0, result.output
        amps = [float(r["current_A"]) for r in table(tmp_path, "replay.csv")]
        assert least < max(amps) < most


def test_the_sensor_that_is_asked_for_tells_the_current(tmp_path: Path) -> None:
    """Of a log without one beside it, whose own current is 2 % low and 0.1 A high."""
    log = tmp_path / "alone.ulg"
    log.write_bytes((SAMPLES / "s500.ulg").read_bytes())
    charges_Ah = []
    for more in ([], ["--sensor", str(SAMPLES / "s500.sensor.csv")]):
        result = call(tmp_path, str(log), *more)
        assert result.exit_code == 0, result.output
        charges_Ah.append(float(table(tmp_path, "summary.csv")[0]["charge_ah"]))
    own = json.loads((SAMPLES / "s500.truth.json").read_text(encoding="utf-8"))["autopilot_current"]
    seconds = float(table(tmp_path, "replay.csv")[-1]["time_s"])
    true_Ah = (charges_Ah[0] - own["bias_a"] * seconds / 3600) / own["gain"]
    assert charges_Ah[1] == pytest.approx(true_Ah, rel=1e-3)  # 3e-4 off; the autopilot's 1.4 %


def test_a_broken_log_is_wrong_use(tmp_path: Path) -> None:
    (tmp_path / "a.ulg").write_bytes((SAMPLES / "light.ulg").read_bytes()[:200])
    result = call(tmp_path, str(tmp_path / "a.ulg"))
    assert result.exit_code == 2
    assert "a.ulg" in result.output


def test_a_temperature_list_is_a_case_each(tmp_path: Path) -> None:
    file = put_load(tmp_path, seconds=60.0, current_A=20.0)
    assert call(tmp_path, file, "--ambient-c", "-10,25").exit_code == 0
    cold, warm = table(tmp_path, "summary.csv")
    assert (cold["case"], warm["case"]) == ("-10 °C", "25 °C")
    assert float(cold["min_v"]) < float(warm["min_v"]) - 0.3
    rows = table(tmp_path, "replay.csv")
    assert {float(r["temperature_K"]) for r in rows if r["time_s"] == "0"} == {263.15, 298.15}


def test_a_scaled_current_draws_as_much_more_and_is_compared_with_nothing(tmp_path: Path) -> None:
    file = load(tmp_path, "time_s,current_A,voltage_V\n0,10,16\n60,10,15.9\n")
    result = call(tmp_path, file, "--scale", "1,2")
    assert result.exit_code == 0, result.output
    once, twice = table(tmp_path, "summary.csv")
    assert float(twice["charge_ah"]) == pytest.approx(2 * float(once["charge_ah"]))
    assert once["voltage_rmse_mv"]
    assert not twice["voltage_rmse_mv"]


def test_a_rate_sweep_goes_down_to_the_cut_off(tmp_path: Path) -> None:
    result = call(tmp_path, "--c-rate", "1,4", "--ambient-c", "0,25")
    assert result.exit_code == 0, result.output
    rows = table(tmp_path, "summary.csv")
    assert [r["case"] for r in rows] == ["0 °C, 1C", "0 °C, 4C", "25 °C, 1C", "25 °C, 4C"]
    drawn = [float(r["charge_ah"]) for r in rows]
    assert drawn[1] < drawn[0] < drawn[2]
    assert drawn[1] < drawn[3] < drawn[2]
    for row, ah in zip(rows, drawn, strict=True):
        assert row["status"] == "lower_cut_off"
        assert float(row["simulated_s"]) == pytest.approx(3600 * ah / (2.2 * float(row["c_rate"])))
        assert float(row["end_v"]) == pytest.approx(4 * 2.75, abs=0.1)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "name a log or a LOAD.csv, or give --c-rate"),
        (("LOAD", "--c-rate", "1"), "it takes no load"),
        (("--c-rate", "1", "--scale", "2"), "no load and no --scale, --between, --sensor or"),
        (("--c-rate", "1", "--between", "linear"), "no --scale, --between, --sensor or --battery"),
        (("--c-rate", "1", "--sensor", "LOAD"), "no --scale, --between, --sensor or --battery"),
        (("--c-rate", "1", "--battery", "0"), "no --scale, --between, --sensor or --battery"),
        (("--c-rate", "1,x"), "expected numbers above 0"),
        (("--c-rate", "-1"), "expected numbers above 0 with commas"),
        (("--c-rate", "inf"), "expected numbers above 0"),
        (("LOAD", "--ambient-c", "25,-99"), "expected numbers above -73, 126 at most, with commas"),
        ((str(SAMPLES / "light.ulg"), "--between", "hold"), "log: --between belongs to a CSV"),
        ((str(SAMPLES / "light.ulg"), "--sensor", __file__), "no table: expected lines of a time"),
        (("LOAD", "--battery", "1"), "--battery belongs to one"),
    ],
)
def test_what_cannot_be_meant_is_wrong_use(
    tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    file = put_load(tmp_path, seconds=2.0, current_A=1.0)
    result = call(tmp_path, *(file if a == "LOAD" else a for a in arguments))
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())


def test_a_bad_pack_file_is_wrong_use(tmp_path: Path) -> None:
    file = put_load(tmp_path, seconds=2.0, current_A=1.0)
    result = call(tmp_path, file, pack=PACK + "[twin]\nphysics = ['sie']\n")
    assert result.exit_code == 2
    assert "no effect 'sie'" in result.output


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_is_wrong_use(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir(mode=0o500)
    result = call(tmp_path, put_load(tmp_path, seconds=2.0, current_A=1.0))
    assert result.exit_code == 2
    assert "may not be written to" in result.output


def test_a_file_in_place_of_the_folder_is_wrong_use(tmp_path: Path) -> None:
    (tmp_path / "out").touch()
    result = call(tmp_path, put_load(tmp_path, seconds=2.0, current_A=1.0))
    assert result.exit_code == 2
    assert "out is a file: expected a folder" in result.output


def test_a_current_that_saturates_is_doubtful(tmp_path: Path) -> None:
    lively_A = np.minimum(np.random.default_rng(1).normal(10.0, 3.0, 60), 11.0)
    rows = "".join(f"{t},{i}\n" for t, i in enumerate(lively_A.tolist()))
    result = call(tmp_path, load(tmp_path, f"time_s,current_A\n{rows}"))
    assert result.exit_code == 0, result.output
    count = int(np.sum(lively_A == 11.0))
    assert f"doubtful {count} samples stand at 11.0 A, the most that the current" in result.output
    programmed = call(tmp_path, str(tmp_path / "load.csv"), "--between", "hold")
    assert "samples stand at" not in programmed.output
    steady = call(tmp_path, put_load(tmp_path, seconds=5.0, current_A=1.0))
    assert "samples stand at" not in steady.output
    bench_A = 5.0 + 0.001 * np.minimum(np.random.default_rng(1).normal(0.0, 1.0, 60), 0.5)
    rows = "".join(f"{t},{i}\n" for t, i in enumerate(bench_A.tolist()))
    bench = call(tmp_path, load(tmp_path, f"time_s,current_A\n{rows}"))
    assert bench.exit_code == 0, bench.output
    assert "samples stand at" not in bench.output


def test_a_voltage_slower_than_its_log_is_doubtful(tmp_path: Path) -> None:
    current_A = np.random.default_rng(1).normal(2.0, 0.4, 400)
    held_V = np.repeat(np.round(16.0 - 0.2 * current_A[::4], 2), 4)
    both = enumerate(zip(current_A.tolist(), held_V.tolist(), strict=True))
    rows = "".join(f"{t / 10},{i},{v}\n" for t, (i, v) in both)
    path = load(tmp_path, f"time_s,current_A,voltage_V\n{rows}")
    result = call(tmp_path, path)
    assert result.exit_code == 0, result.output
    repeats = int(np.count_nonzero(np.diff(held_V) == 0.0))
    assert f"more seldom than it is logged: {repeats} of 400 samples repeat it" in result.output


def test_the_cases_before_an_interrupt_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import analyze.workbench.cases as cases

    simulate, calls = cases.simulate, []

    def interrupted(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            signal.raise_signal(signal.SIGINT)
        return simulate(*arguments)

    monkeypatch.setattr(cases, "simulate", interrupted)
    file = put_load(tmp_path, seconds=5.0, current_A=1.0)
    result = call(tmp_path, file, "--ambient-c", "0,10,20,30")
    assert result.exit_code == 130
    assert "2 of 4 cases are done" in result.output
    assert [r["case"] for r in table(tmp_path, "summary.csv")] == ["0 °C", "10 °C"]


@pytest.mark.skipif(compiler() is None, reason="no C compiler: nothing to miss")
def test_what_makes_it_slow_is_said_in_plain_words(tmp_path: Path) -> None:
    (tmp_path / "pack.toml").write_text(PACK, encoding="utf-8")
    file = put_load(tmp_path, seconds=5.0, current_A=1.0)
    command = [sys.executable, "-m", "analyze.workbench", "replay", file]
    command += ["--pack", str(tmp_path / "pack.toml"), "--out", str(tmp_path / "out")]
    nowhere = os.environ | {"DRONE_BATTERY_HEALTH_CACHE": str(tmp_path / "pack.toml")}
    done = subprocess.run(command, env=nowhere, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[0].startswith("warning  no compiled equations (")
    assert "RuntimeWarning" not in done.stderr
