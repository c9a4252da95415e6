"""The command on whole logs: the samples with their true answer, and real ones where they are."""

import json
import re
from importlib import resources
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner

from analyze.__main__ import main
from tests.analyze.calls import PACK

SAMPLES = Path(__file__).parents[2] / "sample_logs"
REAL = Path(__file__).parents[2] / ".." / "shared" / "flights"
LOGS = ("light.ulg", "s500.ulg", "s500_ardupilot.bin", "s500_telemetry.tlog")
STEMS = [name.partition(".")[0] for name in LOGS]
MOTIONS = ("hover", "vertical", "horizontal")
FEATURES = {"peaks", "ripple", "ramps", "duty", "temperature"}
TIME_TAKEN = re.compile(r'("seconds":) [\d.]+|<th scope="row">Time taken</th><td>[\d.]+')


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of all samples, made in this process."""
    folder = tmp_path_factory.mktemp("samples")
    run = CliRunner().invoke(main, [str(SAMPLES), "--out", str(folder)])
    assert run.exit_code == 0, run.output
    assert not run.stderr
    return folder


def result(out: Path, stem: str) -> dict:
    return json.loads((out / stem / "result.json").read_text(encoding="utf-8"))


def truth(stem: str) -> dict:
    return json.loads((SAMPLES / f"{stem}.truth.json").read_text(encoding="utf-8"))


def motion_at(segments: list[dict], t: np.ndarray) -> np.ndarray:
    found = np.full(t.shape, "", dtype=object)
    for s in segments:
        found[(t >= s["start_s"]) & (t < s["stop_s"])] = s["motion"]
    return found


def test_every_sample_and_nothing_else_is_analysed(out: Path) -> None:
    assert {p.name for p in out.iterdir() if p.is_dir()} == set(STEMS)
    assert json.loads((out / "failures.json").read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("stem", STEMS)
def test_the_result_keeps_the_shipped_schema(out: Path, stem: str) -> None:
    text = (resources.files("reports") / "result.schema.json").read_text(encoding="utf-8")
    jsonschema.validate(result(out, stem), json.loads(text))


@pytest.mark.parametrize("stem", STEMS)
def test_the_motions_of_the_truth_are_found(out: Path, stem: str) -> None:
    true = truth(stem)["segments"]
    t = np.arange(true[0]["start_s"], true[-1]["stop_s"], 0.1)
    right = motion_at(result(out, stem)["segments"], t) == motion_at(true, t)
    assert right.mean() >= 0.95


@pytest.mark.parametrize("stem", STEMS)
def test_the_replay_runs_to_the_end_and_starts_as_the_pack_did(out: Path, stem: str) -> None:
    got, true = result(out, stem), truth(stem)
    assert got["replay"]["status"] == "done"
    start = got["provenance"]["parameters"]["initial_soc"]
    assert start == pytest.approx(true["pack"]["initial_soc"], abs=0.03)
    assert got["replay"]["final_soc"] == pytest.approx(true["at_the_end"]["soc"], abs=0.05)
    assert got["replay"]["lithium_audit"]["relative_error"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("stem", STEMS)
def test_the_fit_to_the_flight_comes_closer_to_the_truth(out: Path, stem: str) -> None:
    got, true = result(out, stem), truth(stem)
    fit = got["pack"]["fit"]
    assert fit["rmse_mv"]["after"] < 0.25 * fit["rmse_mv"]["before"]
    assert fit["rmse_mv"]["after"] < 12.0  # 8 mV are noise
    assert fit["rmse_mv"]["holdout_after"] < 0.2 * fit["rmse_mv"]["holdout_before"]
    found = {q["name"]: q["value"] for q in fit["quantities"]}
    assert found["initial_soc"] == pytest.approx(true["pack"]["initial_soc"], abs=0.005)
    # in the amperes of the log, whose gain and offset the truth tells
    assert found["capacity_C"] / 3600 == pytest.approx(true["pack"]["capacity_ah"], rel=0.04)
    assert found["initial_K"] - 273.15 == pytest.approx(
        true["pack"]["initial_temperature_c"], abs=2.5
    )
    assert got["replay"]["final_soc"] == pytest.approx(true["at_the_end"]["soc"], abs=0.015)


@pytest.mark.parametrize("stem", STEMS)
def test_the_damage_of_every_motion_is_told(out: Path, stem: str) -> None:
    got = result(out, stem)
    for name, motion in got["motions"].items():
        damage, beside = motion["damage"], motion["relative_to_constant_current"]
        assert damage["per_flight"]["lithium_mah"] > damage["in_flight"]["lithium_mah"] > 0
        assert beside["per_flight"]["total"]["value"] == pytest.approx(1.0, abs=0.05), name
        assert damage["as_flown"]["sei_mah"] > 0
    currents = [b["current_a"] for b in got["assessment"]["baselines"]]
    means = [motion["mean_current_a"] for motion in got["motions"].values()]
    assert currents[0] <= min(means) < max(means) <= currents[-1]


def test_the_sensor_beside_the_log_is_found_and_aligned(out: Path) -> None:
    got, true = result(out, "s500")["alignment"], truth("s500")["sensor_clock"]
    assert got["offset_s"] == pytest.approx(true["offset_s"], abs=0.05)
    assert got["drift_ppm"] == pytest.approx(true["drift_ppm"], abs=20.0)
    assert result(out, "s500")["quality"]["current_source"] == "sensor"
    assert result(out, "light")["alignment"] is None


def test_the_page_says_at_its_top_what_it_was_fitted_to(out: Path) -> None:
    page = (out / "light/report.html").read_text(encoding="utf-8")
    assert page.index("fitted to this flight, not calibrated to this pack") < page.index("Vehicle")


def test_workers_write_what_one_process_writes(out: Path, tmp_path: Path) -> None:
    logs = [str(SAMPLES / name) for name in ("light.ulg", "s500_telemetry.tlog")]
    run = CliRunner().invoke(main, [*logs, "--out", str(tmp_path), "--jobs", "2"])
    assert run.exit_code == 0, run.output
    for stem in ("light", "s500_telemetry"):
        for name in ("report.html", "result.json", "segments.csv"):
            alone, shared = (
                TIME_TAKEN.sub("", (folder / stem / name).read_text(encoding="utf-8"))
                for folder in (out, tmp_path)
            )
            assert shared == alone


@pytest.mark.long
def test_a_thorough_analysis_adds_lives_counterfactuals_and_what_is_not_known(
    tmp_path: Path,
) -> None:
    (tmp_path / "pack.toml").write_text(PACK, encoding="utf-8")
    common = [str(SAMPLES / "light.ulg"), "--pack", str(tmp_path / "pack.toml"), "--out"]
    for name, more in (("quick", []), ("thorough", ["--thorough"])):
        run = CliRunner().invoke(main, [*common, str(tmp_path / name), *more])
        assert run.exit_code == 0, run.output
    quick, thorough = (result(tmp_path / name, "light") for name in ("quick", "thorough"))
    assert quick["assessment"]["life"] is None
    life = thorough["assessment"]["life"]
    assert life["as_flown"]["flights"] > 0
    # what is not known of ageing: a factor of hundreds
    assert life["as_flown"]["upper_95"] > 10 * life["as_flown"]["lower_95"] > 0
    assert (life["cell_uncertain"], life["ageing"]) == (False, "assumed")
    assert set(life["motions"]) == set(MOTIONS)
    for name in MOTIONS:
        before, after = (r["motions"][name] for r in (quick, thorough))
        assert before["damage"]["counterfactuals"] is None
        assert set(after["damage"]["counterfactuals"]) == FEATURES
    quick_std, thorough_std = (
        r["motions"]["hover"]["relative_to_constant_current"]["per_flight"]["lithium"]["std"]
        for r in (quick, thorough)
    )
    assert thorough_std > quick_std > 0  # the other motions have one segment each, and no spread


@pytest.mark.long
@pytest.mark.skipif(not REAL.is_dir(), reason="the real logs are not beside the project")
def test_no_real_log_makes_the_program_fail_in_a_way_it_does_not_name(tmp_path: Path) -> None:
    run = CliRunner().invoke(main, [str(REAL), "--out", str(tmp_path)])
    assert run.exit_code in (0, 1)
    failures = json.loads((tmp_path / "failures.json").read_text(encoding="utf-8"))
    assert not [f for f in failures if f["code"] == "unexpected"]
    results = list(tmp_path.glob("*/result.json"))
    assert len(results) >= 10
    for path in results:
        result = json.loads(path.read_text(encoding="utf-8"))
        replay, fit = result["replay"], result["pack"]["fit"]
        assert replay["status"]
        assert (fit is None) == bool(result["pack"]["fit_refusal"])
        assert fit is None or fit["rmse_mv"]["after"] < fit["rmse_mv"]["before"]
        assert replay["voltage_rmse_mv"] is None or replay["voltage_rmse_mv"] > 0
