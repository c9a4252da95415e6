"""`twin calibrate`: files, words and exit codes."""

import json
import os
import signal
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from analyze.pack_choice import cell_of, read_pack
from analyze.start import pack_of, pack_use
from analyze.workbench.__main__ import main
from tests.twin.calibrate.synthetic import NOISE_V, cell_pack, measured
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import SEARCH, Progress, fit
from twin.load import Between, Load
from twin.simulate import simulate

PACK = """[pack]
name = "a \\"pack\\""
cell = "lipo_2200"
capacity_ah = 4.4
series = 4
parallel = 2
[environment]
ambient_c = 25.0
[twin]
physics = ["self_heating", "sei"]
"""


def call(folder: Path, *arguments: str, out: str = "new.toml", pack: str = PACK) -> Result:
    (folder / "pack.toml").write_text(pack, encoding="utf-8")
    common = ["--pack", str(folder / "pack.toml"), "--out", str(folder / "out" / out)]
    return CliRunner().invoke(main, ["calibrate", *arguments, *common])


def put_test(
    folder: Path, *, wave_V: float = 0.0, stop: int | None = None
) -> tuple[str, ReferenceTest]:
    """2C of a cell nobody knows, at the terminals of a 4s2p pack, discharge negative.

    `wave_V` is the height of a wave on it that no cell has, `stop` where it ends early.
    """
    (test,), _, _ = measured(cell_pack(), 4, ("2C",))
    wave = wave_V * np.sin(test.time_s / 20.0)
    test = replace(test, voltage_V=test.voltage_V + wave)
    table = np.column_stack([test.time_s, -2 * test.current_A, 4 * test.voltage_V])[:stop]
    lines = [",".join(f"{v:.6f}" for v in row) for row in table]
    file = folder / "2C.csv"
    file.write_text("\n".join(["Test Time / s,Current / A,Voltage / V", *lines]) + "\n")
    return str(file), test


def test_a_pack_file_comes_out_whose_pack_does_what_was_measured(tmp_path: Path) -> None:
    file, test = put_test(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "new.search.json").write_text("{}")  # of an earlier fit: it is replaced
    result = call(tmp_path, file)
    assert result.exit_code == 0, result.output
    assert "positive current is charge" in result.output
    out = tmp_path / "out"
    assert {p.name for p in out.iterdir()} == {"new.toml", "new.bpx.json", "new.fit.json"}
    choice = read_pack(out / "new.toml")
    assert choice.file.pack.name == 'a "pack"'
    assert choice.file.twin.physics == ("self_heating", "sei", "series_resistance")
    cell, _ = cell_of(choice.cell)
    pack = pack_of(pack_use(None, choice.file, cell, builtin=False), cell)
    load = Load(time_s=test.time_s, current_A=2 * test.current_A, between=Between.HOLD)
    error = simulate(pack, load).voltage_V / 4 - test.voltage_V
    assert np.sqrt(np.mean(error**2)) < 1.25 * NOISE_V  # it starts full, not as fitted
    told = json.loads((out / "new.fit.json").read_text())
    assert told["tests"][0]["rms_mV"] == pytest.approx(1e3 * NOISE_V, rel=0.1)
    again = call(tmp_path, file, "--resume")
    assert again.exit_code == 0, again.output
    values = json.loads((out / "new.fit.json").read_text())["values"]
    assert values == pytest.approx(told["values"], rel=1e-2, abs=1e-4)
    assert tomllib.loads((out / "new.toml").read_text())["pack"]["cell"] == "new.bpx.json"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,2\n", "no column for time_s"),
        ("time / s,current / A,voltage / V\n0,0,16\n1,0,16\n", "the current is zero throughout"),
        ("time / s,current / A,voltage / V\n0,0,4\n1,1,3.9\n", "1 in series"),
    ],
)
def test_a_file_that_cannot_be_used_is_named(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    result = call(tmp_path, str(tmp_path / "t.csv"))
    assert result.exit_code == 2
    assert said in result.output
    assert not (tmp_path / "out").exists()


def test_options_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    file, _ = put_test(tmp_path)
    result = call(tmp_path, file, out="new.json")
    assert (result.exit_code, "expected a name in .toml" in result.output) == (2, True)
    result = call(tmp_path, file, "--resume")
    assert (result.exit_code, "holds no earlier fit" in result.output) == (2, True)


def test_what_was_found_before_an_interrupt_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(problem: Problem, **options: object) -> Iterator[Progress]:
        for best in fit(problem, **options):  # type: ignore[arg-type]
            os.kill(os.getpid(), signal.SIGINT)
            yield best

    monkeypatch.setattr("analyze.workbench.calibrate.fit", interrupted)
    file, _ = put_test(tmp_path)
    result = call(tmp_path, file)
    assert result.exit_code == 130, result.output
    assert "--resume goes on from it" in result.output
    assert (tmp_path / "out" / "new.fit.json").exists()
    assert read_pack(tmp_path / "out" / "new.toml").file.pack.series == 4


def test_what_least_squares_leave_is_searched_and_an_interrupted_search_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(problem: Problem, **options: object) -> Iterator[Progress]:
        for best in fit(problem, **options):  # type: ignore[arg-type]
            if best.stage == SEARCH:
                os.kill(os.getpid(), signal.SIGINT)
            yield best

    file = put_test(tmp_path, wave_V=0.02, stop=150)[0]
    with monkeypatch.context() as patch:
        patch.setattr("analyze.workbench.calibrate.fit", interrupted)
        result = call(tmp_path, file)
    assert result.exit_code == 130, result.output
    kept = tmp_path / "out" / "new.search.json"
    before = json.loads(kept.read_text())
    count = len(before["costs"])
    assert 0 < count < 1000
    assert before["costs"][0] == min(before["costs"])  # it begins where least squares end
    result = call(tmp_path, file, "--resume", "--evaluations", str(count + 10))
    assert result.exit_code == 0, result.output
    assert f"fitted   search, {count + 10} evaluations: " in result.output
    assert "new.search.json" in result.output
    after = json.loads(kept.read_text())
    assert len(after["costs"]) == count + 10
    assert after["costs"][:count] == before["costs"]
    result = call(tmp_path, file, "--resume", "--evaluations", "400", "--seed", "1")
    assert (result.exit_code, "another seed" in result.output) == (2, True), result.output
    result = call(tmp_path, file, "--resume", "--evaluations", "0")
    assert (result.exit_code, "evaluations" in result.output) == (0, False), result.output
    assert json.loads(kept.read_text()) == after
