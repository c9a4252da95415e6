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
from analyze.workbench.listing import print_table
from reports.calibration import CalibrationReport
from reports.calibration.summary import summary
from reports.page import Page
from tests.twin.calibrate.synthetic import NOISE_V, cell_pack, measured
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import SEARCH, Calibration, Progress, conclusions, fit
from twin.load import Between, Load
from twin.simulate import simulate
from twin.whole_file import write_whole

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


FILES = {"new.toml", "new.bpx.json", "new.fit.json", "new.html"}


class Killed(BaseException):
    """As by the operating system: nothing is caught, nothing is written after it."""


def first_only(problem: Problem, **options: object) -> Iterator[Progress]:
    """A fit that is over at once."""
    yield next(fit(problem, **options))  # type: ignore[arg-type]


@pytest.fixture
def plain_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without its drawings, which take longer than all else here."""

    def plain(report: CalibrationReport) -> Page:
        return Page(title="t", subtitle="s", sections=(summary(report),), version="1")

    monkeypatch.setattr("analyze.workbench.calibrated_files.calibration_page", plain)


def call(folder: Path, *arguments: str, out: str = "new.toml", pack: str = PACK) -> Result:
    (folder / "pack.toml").write_text(pack, encoding="utf-8")
    common = ["--pack", str(folder / "pack.toml"), "--out", str(folder / "out" / out)]
    return CliRunner().invoke(main, ["calibrate", *arguments, *common])


def put_test(
    folder: Path, *, wave_V: float = 0.0, stop: int | None = None, name: str = "2C"
) -> tuple[str, ReferenceTest]:
    """2C of a cell nobody knows, at the terminals of a 4s2p pack, discharge negative.

    `wave_V` is the height of a wave on it that no cell has, `stop` where it ends early.
    """
    (test,), _, _ = measured(cell_pack(), 4, ("2C",))
    wave = wave_V * np.sin(test.time_s / 20.0)
    test = replace(test, voltage_V=test.voltage_V + wave)
    table = np.column_stack([test.time_s, -2 * test.current_A, 4 * test.voltage_V])[:stop]
    lines = [",".join(f"{v:.6f}" for v in row) for row in table]
    file = folder / f"{name}.csv"
    file.write_text("\n".join(["Test Time / s,Current / A,Voltage / V", *lines]) + "\n")
    return str(file), test


def test_a_pack_file_comes_out_whose_pack_does_what_was_measured(tmp_path: Path) -> None:
    file, test = put_test(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "new.search.json").write_text("{}")  # of an earlier fit: it is replaced
    stated = "[standard_errors.current_gain]\ngain = 0.01\n"
    result = call(tmp_path, file, pack=PACK + stated)
    assert result.exit_code == 0, result.output
    assert "positive current is charge" in result.output
    out = tmp_path / "out"
    assert {p.name for p in out.iterdir()} == FILES
    choice = read_pack(out / "new.toml")
    assert choice.file.pack.name == 'a "pack"'
    assert choice.cell_doubt is not None
    assert "negative.porosity" in choice.cell_doubt.names
    assert choice.life_doubt is None
    assert choice.file.standard_errors["current_gain"] == {"gain": 0.01}
    assert choice.file.twin.physics == ("self_heating", "sei", "series_resistance")
    cell, _ = cell_of(choice.cell)
    pack = pack_of(pack_use(None, choice.file, cell, builtin=False), cell)
    load = Load(time_s=test.time_s, current_A=2 * test.current_A, between=Between.HOLD)
    error = simulate(pack, load).voltage_V / 4 - test.voltage_V
    assert np.sqrt(np.mean(error**2)) < 1.25 * NOISE_V  # it starts full, not as fitted
    told = json.loads((out / "new.fit.json").read_text())
    assert told["tests"][0]["rms_mV"] == pytest.approx(1e3 * NOISE_V, rel=0.1)
    again = call(tmp_path, file, "--resume", pack=PACK + stated)
    assert again.exit_code == 0, again.output
    values = json.loads((out / "new.fit.json").read_text())["values"]
    assert values == pytest.approx(told["values"], rel=1e-2, abs=1e-4)
    assert tomllib.loads((out / "new.toml").read_text())["pack"]["cell"] == "new.bpx.json"


@pytest.mark.usefixtures("plain_page")
def test_a_load_beyond_the_tests_of_a_calibration_is_doubtful(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("analyze.workbench.calibrate.fit", first_only)
    assert call(tmp_path, put_test(tmp_path)[0], "--evaluations", "0").exit_code == 0
    fit_file, out = tmp_path / "out" / "new.fit.json", ["--out", str(tmp_path / "replayed")]
    pack = ["--pack", str(tmp_path / "out" / "new.toml"), *out]
    said = {}
    for name, current_A, asked in (
        ("as fast", 8.0, True),
        ("twice", 16.0, True),
        ("old", 16.0, False),
    ):
        (tmp_path / "load.csv").write_text(f"time_s,current_A\n0,{current_A}\n60,{current_A}\n")
        told = json.loads(fit_file.read_text())
        fit_file.write_text(json.dumps({k: v for k, v in told.items() if asked or k != "asked"}))
        result = CliRunner().invoke(main, ["replay", str(tmp_path / "load.csv"), *pack])
        assert result.exit_code == 0, result.output
        said[name] = "doubtful Beyond the tests that the cell was calibrated to:" in result.output
    assert said == {"as fast": False, "twice": True, "old": False}
    fit_file.write_text(json.dumps(told))
    for sweep, ends in (
        (["--scale", "0.4"], []),
        (["--scale", "1.2,0.4"], ["9.6 A a cell"]),
        (["--c-rate", "1,9"], ["A a cell"]),
        (["--scale", "0.4", "--ambient-c", "-10"], ["a start at -10"]),
    ):
        load = [] if "--c-rate" in sweep else [str(tmp_path / "load.csv")]
        result = CliRunner().invoke(main, ["replay", *load, *sweep, *pack])
        doubts = [line for line in result.output.splitlines() if "Beyond the tests" in line]
        assert len(doubts) == len(ends), sweep
        for doubt, end in zip(doubts, ends, strict=True):
            assert end in doubt, sweep
    fit_file.write_text(json.dumps(json.loads(fit_file.read_text()) | {"asked": {"most_A": [1.0]}}))
    result = CliRunner().invoke(main, ["replay", str(tmp_path / "load.csv"), *pack])
    assert (result.exit_code, "new.fit.json: not the fit of a calibration" in result.output) == (
        2,
        True,
    )


def test_tests_in_one_mount_share_how_they_cool(tmp_path: Path) -> None:
    rows = [f"{t},{0.0 if t < 10 else -4.0},{16.4 - 1e-4 * t},{25 + 0.01 * t}" for t in range(60)]
    head = "time / s,current / A,voltage / V"
    files = [str(tmp_path / f"{name}.csv") for name in "ab"]
    last = [f"60,-4.0,16.39,{celsius}" for celsius in (25.6, 25.61)]  # no test is a copy of another
    for file, end in zip(files, last, strict=True):
        Path(file).write_text("\n".join([f"{head},temperature / C", *rows, end]) + "\n")
    told = {}
    for option in ((), ("--one-mount",)):
        result = call(tmp_path, *files, *option, "--evaluations", "0")
        assert result.exit_code == 0, result.output
        told[option] = json.loads((tmp_path / "out" / "new.fit.json").read_text())["values"]
    own, one = (
        {n for n in values if n.startswith(("mount:", "cooling:"))} for values in told.values()
    )
    assert own == {"mount:a", "mount:b"}
    assert one == {"cooling:a", "cooling:b"}
    for text, pack in (
        (head, PACK),
        (f"{head},temperature / C", PACK.replace('"self_heating", ', "")),
    ):
        for file, end in zip(files, last, strict=True):
            Path(file).write_text("\n".join([text, *rows, end]) + "\n")
        result = call(tmp_path, *files, "--one-mount", pack=pack)
        assert result.exit_code == 2
        assert "expected two tests or more with a column of temperatures" in result.output


def test_no_number_is_cut_off_where_the_terminal_is_narrow(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    monkeypatch.setenv("FORCE_COLOR", "1")  # as on a terminal
    print_table(("parameter", "value"), [("a name that is long", "0.12345678901")])
    assert "a name that is long   0.12345678901" in capsys.readouterr().out


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
    assert not (tmp_path / "out").exists()


def test_a_copy_of_a_test_is_refused(tmp_path: Path) -> None:
    """It would be predicted by itself."""
    file, _ = put_test(tmp_path, stop=50)
    copy = tmp_path / "again.csv"
    copy.write_bytes(Path(file).read_bytes())
    result = call(tmp_path, file, str(copy))
    assert result.exit_code == 2
    assert "again is a copy of 2C: no test counts twice" in result.output


@pytest.mark.usefixtures("plain_page")
def test_a_page_that_cannot_be_written_costs_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: str) -> None:
        if path.suffix == ".html":
            raise OSError(28, "No space left on device", str(path))
        write_whole(path, content)

    monkeypatch.setattr("analyze.workbench.calibrate.fit", first_only)
    monkeypatch.setattr("analyze.workbench.calibrated_files.write_whole", full)
    result = call(tmp_path, put_test(tmp_path, stop=50)[0])
    assert (result.exit_code, "No space left on device" in result.output) == (2, True)
    assert {p.name for p in (tmp_path / "out").iterdir()} == FILES - {"new.html"}


@pytest.mark.usefixtures("plain_page")
@pytest.mark.parametrize(
    ("after", "missing"),
    [
        (1, ["further tests", "2C predicted", "early predicted"]),
        (3, ["2C predicted", "early predicted"]),  # in the fit to the other tests
    ],
)
def test_an_interrupt_while_concluding_leaves_what_is_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int, missing: list[str]
) -> None:
    def interrupted(*arguments: object) -> Iterator[Calibration]:
        for n, found in enumerate(conclusions(*arguments), start=1):  # type: ignore[arg-type]
            if n == after:
                os.kill(os.getpid(), signal.SIGINT)
            assert n <= after
            yield found

    monkeypatch.setattr("analyze.workbench.calibrate.fit", first_only)
    monkeypatch.setattr("analyze.workbench.calibrate.conclusions", interrupted)
    tests = put_test(tmp_path)[0], put_test(tmp_path, stop=150, name="early")[0]
    result = call(tmp_path, *tests)
    assert result.exit_code == 130, result.output
    assert {p.name for p in (tmp_path / "out").iterdir()} == FILES
    told = json.loads((tmp_path / "out" / "new.fit.json").read_text())
    assert len(told["missing"]) == len(missing)
    page = (tmp_path / "out" / "new.html").read_text()
    for text, said in zip(told["missing"], missing, strict=True):
        assert text.startswith(said)
        assert f"missing  {text}: not computed" in result.output
        assert text in page
    assert bool(told["advice"]) == (after > 1)


@pytest.mark.usefixtures("plain_page")
def test_a_kill_while_concluding_leaves_the_fit_and_no_older_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*arguments: object) -> Iterator[Calibration]:
        yield next(conclusions(*arguments))  # type: ignore[arg-type]
        raise Killed

    file, out = put_test(tmp_path, stop=150)[0], tmp_path / "out"
    out.mkdir()
    for name in ("new.html", "new.ageing.json"):
        (out / name).write_text("of an earlier fit")
    monkeypatch.setattr("analyze.workbench.calibrate.fit", first_only)
    monkeypatch.setattr("analyze.workbench.calibrate.conclusions", killed)
    with pytest.raises(Killed):
        call(tmp_path, file)
    assert {p.name for p in out.iterdir()} == FILES - {"new.html"}
    monkeypatch.setattr("analyze.workbench.calibrate.conclusions", conclusions)
    assert call(tmp_path, file, "--resume").exit_code == 0


@pytest.mark.long
@pytest.mark.usefixtures("plain_page")
def test_a_killed_search_is_gone_on_with_as_if_it_had_never_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(problem: Problem, **options: object) -> Iterator[Progress]:
        for best in fit(problem, **options):  # type: ignore[arg-type]
            yield best
            if best.evaluations >= 32:
                raise Killed

    file, most = put_test(tmp_path, wave_V=0.02, stop=150)[0], ("--evaluations", "64")
    assert call(tmp_path, file, *most).exit_code == 0
    search, fitted = (tmp_path / "out" / f"new.{k}.json" for k in ("search", "fit"))
    whole = json.loads(search.read_text()), json.loads(fitted.read_text())
    for path in (tmp_path / "out").iterdir():
        path.unlink()
    with monkeypatch.context() as patch:
        patch.setattr("analyze.workbench.calibrate.fit", killed)
        patch.setattr("analyze.workbench.calibrate.SAVED_EVERY_S", 0.0)
        with pytest.raises(Killed):
            call(tmp_path, file, *most)
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["new.search.json"]
    assert 0 < len(json.loads(search.read_text())["costs"]) < 64
    assert call(tmp_path, file, *most, "--resume").exit_code == 0
    assert (json.loads(search.read_text()), json.loads(fitted.read_text())) == whole


@pytest.mark.usefixtures("plain_page")
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


@pytest.mark.usefixtures("plain_page")
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
