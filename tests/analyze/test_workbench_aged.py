"""`twin calibrate --aged`: a life, and what goes with it or not."""

import json
import tomllib
from pathlib import Path

import pytest

from analyze.pack_choice import read_pack
from analyze.workbench.aged import Life
from tests.analyze.test_workbench_calibrate import FILES, call

LIFE = "Cycle,Capacity / Ah\n0,2.190\n2,2.182\n4,2.178\n"
PROFILE = "Test Time / s,Current / A\n0,3.3\n600,3.3\n"
AGED = '[pack]\nname = "p"\ncell = "lipo_2200"\nseries = 2\n[twin]\nphysics = ["sei"]\n'
AGED += "[effects.sei]\nsolvent_diffusivity_m2_s = 2e-20\n"


def put_life(folder: Path) -> list[str]:
    (folder / "life.csv").write_text(LIFE)
    (folder / "profile.csv").write_text(PROFILE)
    return ["--aged", str(folder / "life.csv"), "--cycle", str(folder / "profile.csv")]


def test_a_life_alone_gives_a_pack_file_that_ages_so(tmp_path: Path) -> None:
    result = call(tmp_path, *put_life(tmp_path), pack=AGED)
    assert result.exit_code == 0, result.output
    assert "3 check-ups, 4 cycles of profile.csv" in result.output
    assert "this life does not tell sei.resistivity_ohm_m" in result.output
    out = tmp_path / "out"
    told = json.loads((out / "new.ageing.json").read_text())
    values = {p["name"]: p["value"] for p in told["parameters"]}
    sei = tomllib.loads((out / "new.toml").read_text())["effects"]["sei"]
    assert sei["solvent_diffusivity_m2_s"] == values["sei.solvent_diffusivity_m2_s"] > 2e-20
    again = call(tmp_path, *put_life(tmp_path), "--charge-to", "4.3", pack=AGED)
    assert again.exit_code == 2
    assert "charge to 4.3 V a cell: expected" in again.output
    choice = read_pack(out / "new.toml")
    assert choice.life_doubt is not None
    assert "sei.solvent_diffusivity_m2_s" in choice.life_doubt.names
    assert choice.cell_doubt is None


def test_a_life_alone_leaves_no_mixed_set(tmp_path: Path) -> None:
    """Pack file and fit to a life of one calibration, cell and fit of another."""
    (tmp_path / "out").mkdir()
    for name in FILES:
        (tmp_path / "out" / name).write_text("of tests", encoding="utf-8")
    result = call(tmp_path, *put_life(tmp_path), pack=AGED)
    assert result.exit_code == 2
    assert "(new.fit.json), which a life alone does not replace" in " ".join(result.output.split())
    assert {p.name for p in (tmp_path / "out").iterdir()} == FILES
    assert {p.read_text() for p in (tmp_path / "out").iterdir()} == {"of tests"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "nothing to calibrate from"),
        (["--aged", "life.csv"], "--aged and --cycle belong together"),
    ],
)
def test_half_a_life_is_refused(tmp_path: Path, arguments: list[str], said: str) -> None:
    put_life(tmp_path)
    given = [str(tmp_path / a) if a.endswith(".csv") else a for a in arguments]
    result = call(tmp_path, *given, pack=AGED)
    assert result.exit_code == 2
    assert said in result.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--resume", "--seed", "0"], "--seed, --resume: nothing to do without a TEST.csv"),
        (["--one-mount"], "--one-mount: nothing to do without a TEST.csv"),
        (["--evaluations", "9"], "--evaluations: nothing to do without a TEST.csv"),
    ],
)
def test_options_of_tests_are_refused_where_there_is_a_life_alone(
    tmp_path: Path, arguments: list[str], said: str
) -> None:
    result = call(tmp_path, *put_life(tmp_path), *arguments, pack=AGED)
    assert (result.exit_code, said in result.output) == (2, True), result.output


@pytest.mark.parametrize(
    "option", ["--repeat", "--rest-s=1800", "--charge-rate=1", "--until-rate=1", "--charge-to=4"]
)
def test_options_of_a_life_are_refused_where_there_is_none(tmp_path: Path, option: str) -> None:
    (tmp_path / "t.csv").write_text("a,b\n1,2\n")
    result = call(tmp_path, str(tmp_path / "t.csv"), option)
    assert result.exit_code == 2
    assert f"{option.partition('=')[0]}: nothing to do without --aged" in result.output


def test_how_the_current_of_a_log_runs_is_not_asked(tmp_path: Path) -> None:
    put_life(tmp_path)
    log = str(Path(__file__).parents[2] / "sample_logs" / "light.ulg")
    life = ["--aged", str(tmp_path / "life.csv"), "--cycle", log, "--between", "hold"]
    result = call(tmp_path, *life, pack=AGED)
    assert result.exit_code == 2
    assert "light.ulg is a flight log" in result.output


@pytest.mark.parametrize(
    ("arguments", "between"),
    [([], None), (["--between", "hold"], "hold"), (["--between", "linear"], "linear")],
)
def test_how_the_load_of_a_cycle_runs_between_rows_is_what_is_said_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], between: str | None
) -> None:
    lives: list[Life] = []
    monkeypatch.setattr(
        "analyze.workbench.calibrate.run_life", lambda life: lives.append(life) or 0
    )
    result = call(tmp_path, *put_life(tmp_path), *arguments, pack=AGED)
    assert result.exit_code == 0, result.output
    assert [life.between for life in lives] == [between]
