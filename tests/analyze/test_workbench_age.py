"""`twin age`: rows, going on, interrupts, and what it refuses."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from itertools import islice
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner, Result

import analyze.workbench.age as command
from analyze.pack_choice import read_pack
from analyze.workbench.__main__ import main
from analyze.workbench.drawn import pack_alone
from tests.analyze.workbench_inputs import AGEING, PACK, put_load
from twin.ageing import Regime, age
from twin.load import Load

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "sample_logs"
PATIENCE_S = 300.0  # a compiler and other tests may have the machine
UNLIKE = AGEING.replace('"sei"', '"sei", "weak_cell"') + (
    "[effects.weak_cell]\ncell = 2\ncapacity_factor = 0.9\nsoc_offset = -0.05\n"
)
FILES = {"ageing.csv", "ageing.parquet", "ageing.svg", "ageing.checkpoint.json"}


def arguments(folder: Path, *more: str, pack: str = AGEING, out: str = "out") -> list[str]:
    (folder / "pack.toml").write_text(pack, encoding="utf-8")
    file = folder / "load.csv"
    source = str(file) if file.exists() else put_load(folder, seconds=60.0, current_A=22.0)
    common = ["--pack", str(folder / "pack.toml"), "--out", str(folder / out)]
    return ["age", source, *common, *more]


def call(folder: Path, *more: str, **how: str) -> Result:
    return CliRunner().invoke(main, arguments(folder, *more, **how))


def table(folder: Path, out: str = "out", name: str = "ageing") -> list[dict[str, str]]:
    with (folder / out / f"{name}.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_a_life_is_a_row_a_cycle(tmp_path: Path) -> None:
    result = call(tmp_path, "--cycles", "3")
    assert result.exit_code == 0, result.output
    assert {p.name for p in (tmp_path / "out").iterdir()} == FILES
    rows = table(tmp_path)
    assert [r["cycle"] for r in rows] == ["0", "1", "2", "3"]
    capacities = [float(r["capacity_ah"]) for r in rows]
    assert capacities == sorted(capacities, reverse=True)
    assert {r["status"] for r in rows} == {"done"}
    assert float(rows[1]["charge_ah"]) == pytest.approx(22 / 60)
    assert all(abs(float(r["lithium_audit"])) < 1e-12 for r in rows)
    stored = pq.read_table(tmp_path / "out" / "ageing.parquet")
    assert stored.column("capacity_ah").to_pylist() == capacities
    assert "not measured on this pack" in result.output


def test_going_on_gives_the_bytes_of_a_run_that_never_stopped(tmp_path: Path) -> None:
    assert call(tmp_path, "--cycles", "4", out="whole").exit_code == 0
    assert call(tmp_path, "--cycles", "2").exit_code == 0
    result = call(tmp_path, "--cycles", "4", "--resume")
    assert result.exit_code == 0, result.output
    assert "going on after cycle 2" in result.output
    for name in FILES:
        whole, parts = ((tmp_path / out / name).read_bytes() for out in ("whole", "out"))
        assert whole == parts, name


def test_unlike_cells_have_a_table_of_their_own(tmp_path: Path) -> None:
    assert call(tmp_path, "--cycles", "2", out="whole", pack=UNLIKE).exit_code == 0
    assert call(tmp_path, "--cycles", "1", pack=UNLIKE).exit_code == 0
    result = call(tmp_path, "--cycles", "2", "--resume", pack=UNLIKE)
    assert result.exit_code == 0, result.output
    made = {p.name for p in (tmp_path / "out").iterdir()}
    assert made == FILES | {"cells.csv", "cells.parquet"}
    for name in made:
        whole, parts = ((tmp_path / out / name).read_bytes() for out in ("whole", "out"))
        assert whole == parts, name
    rows = table(tmp_path, name="cells")
    assert [(r["cycle"], r["kind"], r["cells"]) for r in rows[2:4]] == [
        ("1", "others", "3"), ("1", "cell 2", "1"),
    ]  # fmt: skip
    pack, (others, weak) = table(tmp_path)[-1], rows[-2:]
    assert len(rows) == 6
    assert float(weak["full_v"]) < 4.2 < float(others["full_v"])
    assert float(pack["capacity_ah"]) < float(weak["capacity_ah"]) < float(others["capacity_ah"])
    assert float(pack["sei_ah"]) == pytest.approx(
        (3 * float(others["sei_ah"]) + float(weak["sei_ah"])) / 4
    )
    for said in ("cell 2", "cells.csv"):
        assert said in result.output
    picture = (tmp_path / "out" / "ageing.svg").read_text(encoding="utf-8")
    assert all(f">{name} alone</text>" in picture for name in ("others", "cell 2"))


def test_a_temperature_list_is_a_life_each_as_if_asked_for_alone(tmp_path: Path) -> None:
    result = call(tmp_path, "--cycles", "1", "--ambient-c", "40,-5")
    assert result.exit_code == 0, result.output
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"40C", "-5C"}
    warm, cold = (table(tmp_path, f"out/{name}")[-1] for name in ("40C", "-5C"))
    assert float(warm["min_v"]) > float(cold["min_v"]) + 0.3
    assert float(warm["sei_ah"]) > 2 * float(cold["sei_ah"])
    told = AGEING + "[environment]\nambient_c = 40\n"
    assert call(tmp_path, "--cycles", "1", pack=told, out="alone").exit_code == 0
    for name in FILES - {"ageing.checkpoint.json"}:
        one, listed = ((tmp_path / out / name).read_bytes() for out in ("alone", "out/40C"))
        assert one == listed, name
    again = call(tmp_path, "--cycles", "1", "--ambient-c", "25,40")
    assert again.exit_code == 2
    assert "40C/ageing.checkpoint.json is there from an earlier run" in " ".join(
        again.output.split()
    )
    assert not (tmp_path / "out" / "25C").exists()


def test_an_interrupt_is_the_end_of_a_list_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*arguments, **how):
        for aged in age(*arguments, **how):
            if aged.cycle.number == 1:
                signal.raise_signal(signal.SIGINT)
            yield aged

    monkeypatch.setattr(command, "age", interrupted)
    result = call(tmp_path, "--cycles", "1", "--ambient-c", "10,20")
    assert result.exit_code == 130
    assert "1 of 2 temperatures were begun" in result.output
    assert len(table(tmp_path, "out/10C")) == 2
    assert not list((tmp_path / "out" / "20C").iterdir())


def test_enough_is_enough(tmp_path: Path) -> None:
    assert call(tmp_path, "--cycles", "2").exit_code == 0
    before = (tmp_path / "out" / "ageing.csv").read_bytes()
    assert call(tmp_path, "--cycles", "1", "--resume").exit_code == 0
    assert (tmp_path / "out" / "ageing.csv").read_bytes() == before


def test_resume_without_a_run_begins_one(tmp_path: Path) -> None:
    assert call(tmp_path, "--cycles", "1", "--resume").exit_code == 0
    assert len(table(tmp_path)) == 2


def test_a_run_is_not_overwritten_unasked(tmp_path: Path) -> None:
    assert call(tmp_path, "--cycles", "1").exit_code == 0
    result = call(tmp_path, "--cycles", "1")
    assert result.exit_code == 2
    assert "--resume goes on with it" in result.output


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("pack", "not the same pack"),
        ("load", "not the same load"),
        ("protocol", "protocol was flown once, rest 1800.0 s"),
    ],
)
def test_another_run_is_not_gone_on_with(tmp_path: Path, change: str, said: str) -> None:
    assert call(tmp_path, "--cycles", "1").exit_code == 0
    before = (tmp_path / "out" / "ageing.checkpoint.json").read_bytes()
    if change == "load":
        put_load(tmp_path, seconds=61.0, current_A=22.0)
    pack = AGEING.replace("0.9", "0.8") if change == "pack" else AGEING
    more = ["--rest-s", "60"] if change == "protocol" else []
    result = call(tmp_path, "--cycles", "2", "--resume", *more, pack=pack)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())
    assert (tmp_path / "out" / "ageing.checkpoint.json").read_bytes() == before


@pytest.mark.parametrize("text", ["", "{", "[]", '{"identity": {}, "cycles": []}'])
def test_a_checkpoint_that_is_none_is_wrong_use(tmp_path: Path, text: str) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "ageing.checkpoint.json").write_text(text, encoding="utf-8")
    result = call(tmp_path, "--cycles", "1", "--resume")
    assert result.exit_code == 2
    assert "is no checkpoint" in result.output


def test_a_flight_the_pack_cannot_make_is_the_end_with_all_before_kept(tmp_path: Path) -> None:
    put_load(tmp_path, seconds=600.0, current_A=22.0)
    for more in ([], ["--resume"]):
        result = call(tmp_path, "--cycles", "9", *more)
        assert result.exit_code == 1
        assert "Cycle 1 could not be completed; in the flight" in result.output
        first, last = table(tmp_path)
        assert (first["status"], last["status"], last["stopped_in"]) == (
            "done", "lower_cut_off", "flight",
        )  # fmt: skip
        assert 0 < float(last["flown_s"]) < 600


def test_a_profile_is_repeated_to_the_cut_off(tmp_path: Path) -> None:
    result = call(tmp_path, "--cycles", "1", "--repeat", "--rest-s", "0")
    assert result.exit_code == 0, result.output
    flown = table(tmp_path)[1]
    assert float(flown["charge_ah"]) > 1.9
    assert float(flown["flown_s"]) > 300


def test_the_options_of_the_charge_are_those_of_the_regime(tmp_path: Path) -> None:
    more = ["--charge-rate", "0.5", "--until-rate", "0.2", "--charge-to", "4.1"]
    result = call(tmp_path, "--cycles", "1", *more)
    assert result.exit_code == 0, result.output
    pack, _, _ = pack_alone(read_pack(tmp_path / "pack.toml"))
    load = Load(time_s=np.array([0.0, 60.0]), current_A=np.full(2, 22.0))
    regime = Regime(load=load, charge_rate=0.5, until_rate=0.2, full_V=4.1)
    rows = table(tmp_path)
    for row, expected in zip(rows, islice(age(pack, regime), 2), strict=True):
        charged_Ah, time_h = expected.cycle.charged_C / 3600, expected.cycle.time_s / 3600
        assert float(row["charged_ah"]) == pytest.approx(charged_Ah, rel=1e-3)
        assert float(row["time_h"]) == pytest.approx(time_h, rel=1e-3)


def test_a_life_stops_at_a_capacity(tmp_path: Path) -> None:
    result = call(tmp_path, "--cycles", "9", "--stop-at-capacity", "0.9998")
    assert result.exit_code == 0
    assert "below 99.98 %" in result.output
    rows = table(tmp_path)
    assert 2 <= len(rows) < 10
    share = [float(r["capacity_ah"]) / float(rows[0]["capacity_ah"]) for r in rows]
    assert share[-1] < 0.9998 <= share[-2]


def test_a_pack_without_ageing_is_refused_with_the_names_of_what_there_is(tmp_path: Path) -> None:
    result = call(tmp_path, "--cycles", "1", pack=PACK)
    assert result.exit_code == 2
    assert "nothing in this pack ages" in result.output
    assert '"sei_on_cracks"' in result.output
    assert not (tmp_path / "out").exists()


def test_a_load_that_charges_is_refused(tmp_path: Path) -> None:
    put_load(tmp_path, seconds=60.0, current_A=-1.0)
    result = call(tmp_path, "--cycles", "1")
    assert result.exit_code == 2
    assert "discharge current is positive" in result.output


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--charge-to", "4.3"], "charge to 4.3 V a cell: expected 2.75 to 4.2, its cut-offs"),
        (["--charge-to", "2.0"], "charge to 2.0 V a cell: expected 2.75 to 4.2, its cut-offs"),
        (["--stop-at-capacity", "nan"], "--stop-at-capacity nan: expected a share"),
        (["--ambient-c", "20,20.0000001"], "--ambient-c: two temperatures have the folder 20C"),
    ],
)
def test_what_cannot_be_done_is_refused_before_there_is_a_folder(
    tmp_path: Path, more: list[str], said: str
) -> None:
    result = call(tmp_path, "--cycles", "1", *more)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_a_log_is_flown(tmp_path: Path) -> None:
    (tmp_path / "load.csv").touch()
    ask = arguments(tmp_path, "--cycles", "1")
    ask[1] = str(SAMPLES / "light.ulg")
    result = CliRunner().invoke(main, ask)
    assert result.exit_code == 0, result.output
    assert len(table(tmp_path)) == 2


@pytest.mark.parametrize("whole", [0, 2])
def test_the_cycle_at_an_interrupt_is_finished_and_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: int
) -> None:
    def interrupted(*arguments, **how):
        for aged in age(*arguments, **how):
            if aged.cycle.number == whole:
                signal.raise_signal(signal.SIGINT)
            yield aged

    monkeypatch.setattr(command, "age", interrupted)
    before = signal.getsignal(signal.SIGINT)
    result = call(tmp_path, "--cycles", "9")
    assert signal.getsignal(signal.SIGINT) is before
    assert result.exit_code == 130
    assert f"after {whole} of 9 cycles" in result.output
    assert len(table(tmp_path)) == whole + 1
    state = json.loads((tmp_path / "out" / "ageing.checkpoint.json").read_text(encoding="utf-8"))
    assert len(state["cycles"]) == whole + 1


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_keeps_the_whole_cycles(tmp_path: Path) -> None:
    """From outside, wherever it meets the program, and twice over the same folder."""
    code = (
        "import analyze.workbench.life as a; a.SAVED_EVERY_S = 0.0\n"
        "from analyze.workbench.__main__ import main; main()"
    )
    done = [0]
    for more in ((), ("--resume",)):
        command = [sys.executable, "-c", code, *arguments(tmp_path, "--cycles", "100000", *more)]
        with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True) as process:
            try:
                wait_for_rows(tmp_path, done[-1] + 3)
                process.send_signal(signal.SIGINT)
                _, said = process.communicate(timeout=PATIENCE_S)
            finally:
                process.kill()
        assert process.returncode == 130, said
        assert "--resume goes on" in said
        rows = table(tmp_path)
        assert [int(r["cycle"]) for r in rows] == list(range(len(rows)))
        done.append(len(rows))
        assert {p.name for p in (tmp_path / "out").iterdir()} == FILES
    assert 3 <= done[1] < done[2]


def wait_for_rows(folder: Path, count: int) -> None:
    limit = time.monotonic() + PATIENCE_S
    while not ((folder / "out" / "ageing.csv").exists() and len(table(folder)) >= count):
        assert time.monotonic() < limit, f"no {count} rows in {PATIENCE_S} s"
        time.sleep(0.05)
