"""`twin explain`: files, their order, words and exit codes; few hypotheses, short recordings."""

import json
import os
import re
import threading
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from analyze.workbench import explain as command
from analyze.workbench.__main__ import main
from analyze.workbench.reveal import belongs_to
from tests.analyze.test_workbench_replay import SAMPLES
from tests.twin.mismatch.recordings import flown, pack
from twin.effects import SelfHeating
from twin.mismatch import Verdict, explain
from twin.mismatch.hypothesis import HYPOTHESES
from twin.pack_file import effects_of, parse_pack_file
from twin.simulate import simulate

PACK = (
    '[pack]\nname = "a"\ncell = "lipo_2200"\nseries = 4\n[start]\nsoc = 1.0\n[twin]\nphysics = []\n'
)
FEW = [h for h in HYPOTHESES if h.id in ("self_heating", "current_gain")]
TRUTH = SelfHeating(heat_transfer_W_m2_K=15.0)


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "explain", partial(explain, hypotheses=FEW))


def call(folder: Path, *arguments: str | Path, pack_text: str = PACK) -> Result:
    (folder / "pack.toml").write_text(pack_text, encoding="utf-8")
    common = ["--pack", str(folder / "pack.toml"), "--out", str(folder / "out")]
    return CliRunner().invoke(main, ["explain", *map(str, arguments), *common])


def put(folder: Path, name: str, seed: int, *, heated: bool = True) -> Path:
    """A CSV of a flight, and beside it, unread, its temperature and cells."""
    own = flown([TRUTH] if heated else [], seed=seed)
    folder.mkdir(exist_ok=True)
    rows = np.column_stack([own.time_s, own.load.current_A, own.voltage_V])
    np.savetxt(
        folder / name, rows, delimiter=",", header="time_s,current_A,voltage_V", comments="",
    )  # fmt: skip
    true = simulate(replace(pack(), effects=(TRUTH,)), own.load)
    rows = np.column_stack([true.time_s, true.temperature_K - 273.15, true.cell_voltage_V[0]])
    np.savetxt(
        folder / f"{Path(name).stem}.hidden", rows[::10], delimiter=",",
        header="time_s,temperature_c,cell_1_v", comments="",
    )  # fmt: skip
    return folder / name


def verdict(folder: Path) -> bytes:
    return (folder / "out" / "mismatch.json").read_bytes()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_the_verdict_is_whole_before_what_is_revealed_is_opened_and_stays(tmp_path: Path) -> None:
    """The CSV is a pipe: whoever writes into it knows when it is opened."""
    log, ahead = put(tmp_path, "a.csv", 1), put(tmp_path, "b.csv", 2)
    hidden = (tmp_path / "b.hidden").read_text(encoding="utf-8")
    pipe = tmp_path / "b.pipe"
    os.mkfifo(pipe)
    seen: list[bytes] = []
    over = threading.Event()

    def reveal_late() -> None:
        file = tmp_path / "out" / "mismatch.json"
        with pipe.open("w", encoding="utf-8") as stream:  # waits until the command opens it
            seen.append(file.read_bytes() if file.exists() else b"")
            stream.write(hidden)
        if not over.wait(20):  # it was opened before its time, and again: let that one end
            pipe.open("w").close()

    writer = threading.Thread(target=reveal_late, daemon=True)
    writer.start()
    result = call(tmp_path, log, "--holdout", ahead, "--reveal", pipe)
    over.set()
    writer.join(timeout=10)
    assert result.exit_code == 0, result.output
    assert seen == [verdict(tmp_path)]
    channels = json.loads((tmp_path / "out" / "reveal.json").read_text())["channels"]
    assert [c["channel"] for c in channels] == ["temperature", "weakest_cell_voltage"]
    assert {c["flight"] for c in channels} == {"b.csv"}
    for c in channels:
        assert c["rmse_after"] < 0.2 * c["rmse_before"]
    page = (tmp_path / "out" / "explain.html").read_text(encoding="utf-8")
    assert "Put to the proof" in page
    # what is revealed, and that it is, changes nothing
    assert call(tmp_path, log, "--holdout", ahead).exit_code == 0
    assert seen == [verdict(tmp_path)]
    assert not (tmp_path / "out" / "reveal.json").exists()


def test_a_start_that_nobody_tells_is_owned_up_to(tmp_path: Path) -> None:
    """Cut off where it flies, a recording has no voltage at rest."""
    log = put(tmp_path, "a.csv", 1, heated=False)
    head, *rows = log.read_text(encoding="utf-8").splitlines()
    log.write_text("\n".join([head, *rows[600:]]), encoding="utf-8")
    told, untold = (call(tmp_path, log, pack_text=t) for t in (PACK, PACK.replace("soc = 1.0", "")))
    assert "Nothing tells well" not in told.output
    assert "verdict  unknown" in told.output  # it was not full any more
    assert "verdict  none" in untold.output
    (said,) = re.findall(
        r"Nothing tells well how full .*: ([0-9.]+) ± [0-9.]+ % in a.csv by a fit", untold.output
    )
    flight = flown(seed=1)
    left = 100 * (1.0 - flight.load.drawn_C()[600] / flight.pack.rated_C)
    assert float(said) == pytest.approx(left, abs=0.5)


def test_what_is_revealed_is_predicted_from_the_start_that_was_found(tmp_path: Path) -> None:
    log = put(tmp_path, "a.csv", 1, heated=False)
    head, *rows = log.read_text(encoding="utf-8").splitlines()
    log.write_text("\n".join([head, *rows[600:]]), encoding="utf-8")
    cells = [f"{t},{float(v) / 4}" for t, _, v in (row.split(",") for row in rows[600:])]
    hidden = tmp_path / "a.hidden"
    hidden.write_text("\n".join(["time_s,cell_1_v", *cells]), encoding="utf-8")
    text = PACK.replace("soc = 1.0", "")
    assert call(tmp_path, log, "--reveal", hidden, pack_text=text).exit_code == 0
    (cell,) = json.loads((tmp_path / "out" / "reveal.json").read_text())["channels"]
    assert cell["rmse_before"] < 10.0  # mV; from a full pack it is far off


def test_a_current_that_never_flows_is_owned_up_to(tmp_path: Path) -> None:
    log = put(tmp_path, "a.csv", 1, heated=False)
    head, *rows = (row.split(",") for row in log.read_text(encoding="utf-8").splitlines())
    text = "\n".join(",".join(row) for row in [head, *([t, "0", v] for t, _, v in rows)])
    log.write_text(text, encoding="utf-8")
    result = call(tmp_path, log)
    assert result.exit_code == 0, result.exc_info
    assert "doubtful a.csv: The current is zero throughout" in result.output


def test_a_reveal_that_cannot_be_read_takes_neither_verdict_nor_page(tmp_path: Path) -> None:
    log = put(tmp_path, "a.csv", 1)
    (tmp_path / "bad").write_text("time_s,temperature_c\n0,x\n1,2\n", encoding="utf-8")
    result = call(tmp_path, log, "--reveal", tmp_path / "bad")
    assert result.exit_code == 2
    assert "bad, line 2: temperature_K is 'x', no number" in result.output
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"mismatch.json", "explain.html"}


def test_one_recording_gives_verdict_page_words_and_an_adopted_pack(tmp_path: Path) -> None:
    log, better = put(tmp_path, "a.csv", 1), tmp_path / "better.toml"
    result = call(tmp_path, log, "--adopt", better)
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    assert "verdict named: The pack heats itself and the twin did not know" in said
    (effect,) = json.loads(verdict(tmp_path))["effects"]
    (adopted,) = effects_of(parse_pack_file(better.read_text(encoding="utf-8"), name="b"))
    assert adopted == SelfHeating(heat_transfer_W_m2_K=effect["parameters"][0]["value"])
    page = (tmp_path / "out" / "explain.html").read_text(encoding="utf-8")
    assert "--pack better.toml" in page
    assert "fitted and held out, SHA-256" in page
    again = call(tmp_path, log, "--adopt", better)
    assert again.exit_code == 0, again.output  # what an earlier call wrote is replaced


def test_where_nothing_is_named_nothing_is_adopted_and_the_page_is_there(tmp_path: Path) -> None:
    log = put(tmp_path, "a.csv", 1, heated=False)
    result = call(tmp_path, log, "--adopt", tmp_path / "better.toml")
    assert result.exit_code == 2
    assert "--adopt: nothing was named, the verdict is 'none'" in result.output
    told = CliRunner().invoke(main, ["explain", "--help"]).output
    assert "or if with --adopt the verdict names nothing" in " ".join(told.split())
    assert not (tmp_path / "better.toml").exists()
    page = (tmp_path / "out" / "explain.html").read_text(encoding="utf-8")
    assert "built-in one" not in result.output + page  # it explains what is missing: nothing is


def test_a_log_has_its_motions_in_the_spans(tmp_path: Path) -> None:
    wrong = PACK.replace("series = 4", "capacity_ah = 2.2\nseries = 4")
    result = call(
        tmp_path, SAMPLES / "light.ulg", "--conceal", "temperature,cells", pack_text=wrong
    )
    assert result.exit_code == 0, result.output
    found = json.loads(verdict(tmp_path))
    assert found["verdict"] != Verdict.NONE.value  # neither its warmth nor its charge is told
    truth = json.loads((SAMPLES / "light.truth.json").read_text(encoding="utf-8"))["segments"]
    within = [
        (s["motion"], t["motion"])
        for s in found["location"]["spans"]
        for t in truth
        if t["start_s"] <= s["start_s"] and s["stop_s"] <= t["stop_s"]
    ]
    assert all(said == true for said, true in within)
    assert len({said for said, _ in within}) > 2
    page = (tmp_path / "out" / "explain.html").read_text(encoding="utf-8")
    assert re.search(r"Kept from the twin</th><td>cells, temperature", page)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "Missing argument 'LOG...'"),
        (("--holdout", "a.csv", "short.csv"), "Missing argument 'LOG...'"),
        (("a.csv", "--conceal", "temprature"), "no channel 'temprature': expected temperature or"),
        (("a.csv", "--holdout", "a.csv"), "is given twice"),
        (("a.csv", "--adopt", "better.txt"), "expected a name in .toml"),
        (("a.csv", "--adopt", "pack.toml"), "is the pack file to start from: give another name"),
        (("a.csv", "--adopt", "own.toml"), "was not written by an earlier --adopt"),
        (("a.csv", "--adopt", "bad.csv/x.toml"), "bad.csv is a file: expected a folder"),
        (("a.csv", "--adopt", f"{'o' * 300}.toml"), "cannot be written: File name too long"),
        (("a.csv", "--floor-mv", "nan"), "--floor-mv nan: expected a number of mV"),
        (("a.csv", "--floor-mv", "inf"), "--floor-mv inf: expected a number of mV"),
        (("a.csv", "--reveal", "none.csv"), "does not exist"),
        (("silent.csv",), "silent.csv: no voltage was recorded"),
        (("short.csv",), "11 samples with current and voltage in flight, expected 40 or more"),
        (("hop.csv",), "12 s of flight, expected 15 s or more: give a longer recording"),
        (("cell.csv",), "4.100 V is 1.025 V a cell with 4 in series"),
        (("empty.ulg",), "empty.ulg: the file is empty"),
        (("back.csv",), "back.csv, line 4: the clock goes back, from 9 s to 8 s (1 such lines)"),
        ((str(SAMPLES / "light.ulg"), "--between", "hold"), "log: --between belongs to a CSV"),
        (("a.csv", "--battery", "1"), "is no flight log: --battery belongs to one"),
        (("bad.csv",), "no column for time_s and current_A: expected quantity and unit in its"),
        (("amps.csv",), "11.11 Ah between its fullest and its emptiest are 5.1 times the 2.20 Ah"),
    ],
)
def test_wrong_use_is_told_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    put(tmp_path, "a.csv", 1)
    heads = "time_s,current_A,voltage_V\n"
    rows = {
        "silent": [(0, 1, ""), (9, 1, "")],
        "short": [(k, 1, 16) for k in range(11)],
        "hop": [(k / 10, 1, 16) for k in range(121)],
        "cell": [(k, 1, 4.1) for k in range(99)],
        "back": [(0, 1, 16), (9, 1, 16), (8, 1, 16)],
        "amps": [(k, 400, 16) for k in range(101)],
    }
    for name, lines in rows.items():
        text = heads + "".join(f"{t},{i},{v}\n" for t, i, v in lines)
        (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")
    (tmp_path / "empty.ulg").touch()
    (tmp_path / "bad.csv").write_text("t,i\n0,1\n", encoding="utf-8")
    (tmp_path / "own.toml").write_text("# mine\n", encoding="utf-8")
    before = {p.name for p in tmp_path.iterdir()} | {"pack.toml"}
    result = call(tmp_path, *arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())
    assert {p.name for p in tmp_path.iterdir()} == before  # no empty folder either
    assert (tmp_path / "own.toml").read_text(encoding="utf-8") == "# mine\n"


@pytest.mark.parametrize(("floor_mv", "said"), [("4", "verdict  named"), ("4000", "verdict  none")])
def test_what_changes_the_voltage_by_less_than_the_floor_is_not_named(
    tmp_path: Path, floor_mv: str, said: str
) -> None:
    result = call(tmp_path, put(tmp_path, "a.csv", 1), "--floor-mv", floor_mv)
    assert result.exit_code == 0, result.output
    assert said in result.output
    (remark,) = (r for r in json.loads(verdict(tmp_path))["remarks"] if "stated to err" in r)
    assert f"by {float(floor_mv):.3g} mV rms" in remark


@pytest.mark.parametrize(
    ("arguments", "fitted", "held_out"),
    [
        ("a b --holdout c d --pack p --out o", "ab", "cd"),
        ("a --holdout c --pack p --holdout d --out o b", "ab", "cd"),
        ("a --holdout=c --pack p --out o", "a", "c"),
        ("a --holdout=c d --pack p --out o", "a", "cd"),
        ("a b --pack p --out o", "ab", ""),
    ],
)
def test_all_up_to_the_next_option_is_held_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: str, fitted: str, held_out: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in "abcdp":
        (tmp_path / name).touch()
    params = main.commands["explain"].make_context("explain", arguments.split()).params
    assert (params["sources"], params["holdout"]) == (
        tuple(map(Path, fitted)),
        tuple(map(Path, held_out)),
    )


def test_a_folder_with_the_name_of_a_result_is_told_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "out" / "explain.html").mkdir(parents=True)
    (tmp_path / "a.csv").touch()
    result = call(tmp_path, tmp_path / "a.csv")
    assert result.exit_code == 2
    assert "explain.html is a folder: move it out of the way" in " ".join(result.output.split())


def test_no_recording_takes_the_place_of_another(tmp_path: Path) -> None:
    """Names that differ by bytes that cannot be printed."""
    logs = [Path(os.fsdecode(name)) for name in (b"a\xff.csv", b"a\xfe.csv", b"b.csv")]
    request = command.Request(
        sources=tuple(logs), holdout=(), pack=tmp_path, out=tmp_path, adopt=None, between=None,
        battery=None, conceal="", reveal=(),
    )  # fmt: skip
    assert request.named == dict(zip(("a?.csv (1)", "a?.csv (2)", "b.csv"), logs, strict=True))


def test_a_folder_that_cannot_be_made_is_wrong_use(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file", encoding="utf-8")
    result = call(tmp_path, put(tmp_path, "a.csv", 1))
    assert result.exit_code == 2
    assert "out is a file: expected a folder" in result.output


def test_recordings_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    logs = [put(tmp_path / folder, "log.csv", seed) for folder, seed in (("x", 1), ("y", 2))]
    result = call(tmp_path, *logs)
    assert result.exit_code == 0, result.output
    assert result.output.count("The cell of the pack file is a built-in one") == 1
    assert result.output.startswith(f"{logs[0].as_posix()}, {logs[1].as_posix()}\npack     a: 4 in")
    assert result.output.count("pack     a: 4 in series") == 1
    page = (tmp_path / "out" / "explain.html").read_text(encoding="utf-8")
    assert page.count("The cell of the pack file is a built-in one") == 1
    flights = {s["flight"] for s in json.loads(verdict(tmp_path))["location"]["spans"]}
    assert flights == {log.as_posix() for log in logs}


def test_a_csv_belongs_to_the_recording_it_is_named_after_else_to_the_last() -> None:
    logs = {name: Path("/logs") / name for name in ("a.ulg", "a_2.ulg", "b.ulg")}
    for file, flight in (
        ("a.warm.csv", "a.ulg"), ("a_warm.csv", "a.ulg"), ("a_2_warm.csv", "a_2.ulg"),
        ("a.ulg", "a.ulg"), ("warm.csv", "b.ulg"), ("abc.csv", "b.ulg"),
    ):  # fmt: skip
        assert belongs_to(Path("/else") / file, logs) == flight
    days = {f"{day}/a.ulg": Path(f"/{day}/a.ulg") for day in ("1", "2")}
    for day in ("1", "2"):
        assert belongs_to(Path(f"/{day}/a.warm.csv"), days) == f"{day}/a.ulg"


def test_how_a_csv_runs_between_rows_is_not_said_of_a_log_beside_it(tmp_path: Path) -> None:
    (csv := tmp_path / "a.csv").write_text("time_s,current_A\n0,1\n1,1\n")
    log = SAMPLES / "light.ulg"
    both = command.Request(
        sources=(csv, log), holdout=(), pack=tmp_path, out=tmp_path, adopt=None, between="hold",
        battery=None, conceal="", reveal=(),
    )  # fmt: skip
    assert [command._between(path, both) for path in both.logs] == ["hold", None]
    assert command._between(log, replace(both, sources=(log,))) == "hold"  # and is refused


def test_a_copy_of_what_is_fitted_cannot_be_held_out(tmp_path: Path) -> None:
    own = put(tmp_path, "flight.csv", 1)
    copy = tmp_path / "copy.csv"
    copy.write_bytes(own.read_bytes())
    done = call(tmp_path, own, "--holdout", copy)
    assert done.exit_code == 2
    assert "copy.csv is a copy of " in done.output
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("series", [11, 12])
def test_a_pack_that_is_fuller_than_full_has_more_cells_than_it_is_told(
    series: int, tmp_path: Path
) -> None:
    """Twelve cells; with eleven each would be 4.3 V."""
    own = flown([], seed=1)
    rows = np.column_stack([own.time_s, own.load.current_A, 3 * own.voltage_V])
    np.savetxt(
        tmp_path / "flight.csv", rows, delimiter=",", header="time_s,current_A,voltage_V",
        comments="",
    )  # fmt: skip
    text = PACK.replace("series = 4", f"series = {series}")
    done = call(tmp_path, tmp_path / "flight.csv", pack_text=text)
    said = "are there more cells in series than the pack file says" in done.output
    assert said is (series == 11)
