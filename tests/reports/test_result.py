"""`result.json`: its schema is shipped, current, and kept by every report."""

import json
from dataclasses import replace
from importlib import resources

import jsonschema
import numpy as np
import pytest
from pydantic import ValidationError

from reports.flight import Fitting, NoMismatch
from reports.result import Result, schema_text
from reports.results import result_of
from segment.segment import Motion
from tests.reports import example
from tests.reports.mismatch_example import finding
from twin.calibrate.flight import NotFitted
from twin.effects import SelfHeating
from twin.mismatch import Verdict
from twin.solution import Status

SHIPPED = (resources.files("reports") / "result.schema.json").read_text(encoding="utf-8")
NO_VOLTAGE = example.recording(voltage_V=np.full(example.T.size, np.nan), alignment=None)
REPORTS = {
    "whole": example.report(),
    "without a sensor": example.report(recording=NO_VOLTAGE, segments=()),
    "ended early": example.report(played=example.solution(Status.ELECTRODE_EMPTY, 50)),
    "ended at once": example.report(played=example.solution(Status.NOT_CONVERGED, 0)),
    "not fitted": example.report(
        pack=replace(
            example.pack(), fitting=Fitting(outcome=NotFitted("it was a hop"), before_V=None)
        )
    ),
    "pack file": example.report(pack=example.pack()),
    "no date": example.report(log=replace(example.log(), start_utc=None)),
    "mismatch": example.report(mismatch=finding()),
    "no cause": example.report(mismatch=finding(Verdict.UNKNOWN)),
}
# The contract that other programs rely on, written out by hand.
KEYS = {
    "": "schema_version flight pack quality alignment segments motions replay assessment mismatch "
    "provenance",
    "flight": "file sha256 format firmware vehicle start_utc duration_s in_air_s",
    "quality": "warnings dropouts_s recovered_fraction coulomb_check resistance_mohm",
    "alignment": "method offset_s drift_ppm correlation uncertainty_s",
    "motions": "hover vertical horizontal",
    "replay": "voltage_rmse_mv max_error_mv final_soc max_temperature_c lithium_audit",
    "provenance": "version cell parameters solver seconds",
}
MOTION_KEYS = (
    "time_s charge_ah energy_wh mean_current_a rms_current_a p99_current_a ripple_a damage "
    "relative_to_constant_current"
)


def document(which: str) -> dict:
    return json.loads(result_of(REPORTS[which]).model_dump_json())


def test_time_in_flight_is_without_landings_in_between_and_gaps() -> None:
    landed = tuple(
        replace(s, motion=Motion.GROUND) if s.motion is Motion.VERTICAL else s
        for s in example.segments()
    )
    assert document("whole")["flight"]["in_air_s"] == 46.0
    assert result_of(example.report(segments=landed)).flight.in_air_s == 38.0
    assert result_of(example.report(segments=landed[:-1])).flight.in_air_s == 34.0


def test_the_fit_is_told_with_the_error_before_and_after() -> None:
    pack = document("whole")["pack"]
    assert pack["fit"]["rmse_mv"]["before"] == pytest.approx(72.1)
    assert pack["fit"]["rmse_mv"]["after"] == document("whole")["replay"]["voltage_rmse_mv"]
    assert pack["fit"]["rmse_mv"]["holdout_after"] == pytest.approx(9.0)
    (capacity,) = (q for q in pack["fit"]["quantities"] if q["name"] == "capacity_C")
    assert (capacity["value"], capacity["verdict"]) == (pytest.approx(7380.0), "identified")
    assert pack["fit_refusal"] == ""
    assert document("not fitted")["pack"]["fit"] is None
    assert document("not fitted")["pack"]["fit_refusal"] == "it was a hop"
    assert document("pack file")["pack"]["fit"] is None
    assert document("pack file")["pack"]["fit_refusal"] == ""


def test_the_shipped_schema_is_current() -> None:
    assert schema_text() == SHIPPED, "python -m reports.result > reports/result.schema.json"


@pytest.mark.parametrize("which", REPORTS)
def test_every_result_keeps_the_schema(which: str) -> None:
    schema = json.loads(SHIPPED)
    jsonschema.Draft202012Validator.check_schema(schema)
    checker = jsonschema.Draft202012Validator(
        schema, format_checker=jsonschema.Draft202012Validator.FORMAT_CHECKER
    )
    checker.validate(document(which))


@pytest.mark.parametrize("which", REPORTS)
def test_a_result_is_read_back_as_it_was_written(which: str) -> None:
    result = result_of(REPORTS[which])
    assert Result.model_validate_json(result.model_dump_json()) == result


@pytest.mark.parametrize("part", KEYS)
def test_the_agreed_keys_are_there(part: str) -> None:
    whole = document("whole")
    assert set(KEYS[part].split()) <= set(whole[part] if part else whole)


def test_each_motion_has_the_agreed_keys_and_a_motion_not_flown_is_null() -> None:
    whole = document("whole")["motions"]
    assert set(whole["hover"]) == set(MOTION_KEYS.split())
    assert document("without a sensor")["motions"] == dict.fromkeys(whole)


def test_the_mismatch_is_that_of_the_finding_and_null_where_there_is_none() -> None:
    assert document("whole")["mismatch"] is None
    part = document("mismatch")["mismatch"]
    assert part["verdict"] == "named"
    assert {"verdict", "effects", "location", "rmse_mv", "candidates", "advice"} <= set(part)
    endless = replace(finding(), errors=replace(finding().errors, after=float("nan")))
    assert result_of(example.report(mismatch=endless)).mismatch.rmse_mv.after is None


def test_the_numbers_of_a_mismatch_are_those_of_the_finding_in_mv() -> None:
    part = document("mismatch")["mismatch"]
    assert part["rmse_mv"] == pytest.approx(
        {
            "noise_floor": 8.0,
            "before": 35.1,
            "after": 8.1,
            "holdout_before": 35.2,
            "holdout_after": 8.2,
        }
    )
    span = part["location"]["spans"][0]
    assert (span["flight"], span["motion"], span["share"]) == ("b.ulg", "vertical", 0.55)
    assert (span["start_s"], span["stop_s"]) == (60.0, 119.9)
    assert span["mean_mv"] == pytest.approx(45.0)
    assert part["location"]["drivers"] == [{"quantity": "heating_history", "explained": 0.83}]
    errors_mv = {c["id"]: c["holdout_rmse_mv"] for c in part["candidates"]}
    assert errors_mv == pytest.approx(
        {
            "self_heating": 8.2,
            "current_gain+self_heating": 8.2,
            "current_gain": 21.0,
            "self_heating+leakage": 8.3,
            "none": 35.2,
        }
    )
    (term,) = document("no cause")["mismatch"]["terms"]
    assert term["quantity"] == "current_squared"
    assert term["size_mv"] == pytest.approx(-12.3)


def test_the_effect_that_a_mismatch_names_is_told_with_its_physics() -> None:
    (effect,) = document("mismatch")["mismatch"]["effects"]
    assert (effect["id"], effect["probability"], effect["equivalent"]) == ("self_heating", 0.98, [])
    (value,) = effect["parameters"]
    assert value["name"] == "heat_transfer_W_m2_K"
    assert (value["value"], value["std"]) == (12.3, pytest.approx(0.6))
    assert effect["equation"] == SelfHeating.equation
    assert effect["source"] == SelfHeating.source


def test_what_could_not_be_judged_has_its_reason_among_the_warnings() -> None:
    unjudged = example.report(
        no_damage="No motion lasted long enough.", mismatch=NoMismatch("Too little to judge.")
    )
    result = result_of(unjudged)
    assert (result.assessment, result.mismatch) == (None, None)
    said = {w.code: w.message for w in result.quality.warnings}
    assert said["no_damage"] == "No motion lasted long enough."
    assert said["no_mismatch"] == "Too little to judge."
    judged = {w.code for w in result_of(REPORTS["mismatch"]).quality.warnings}
    assert not judged & {"no_damage", "no_mismatch"}


def test_a_number_that_is_none_never_reaches_the_file() -> None:
    with pytest.raises(ValidationError):
        result_of(
            example.report(provenance=replace(example.report().provenance, seconds=float("nan")))
        )


def test_units_are_those_of_the_keys() -> None:
    whole = document("whole")
    assert whole["motions"]["hover"]["charge_ah"] == pytest.approx(18 * 16 / 3600)
    assert whole["motions"]["hover"]["energy_wh"] == pytest.approx(18 * 16 * 15.8 / 3600)
    assert whole["quality"]["resistance_mohm"] == pytest.approx(30.0)
    assert whole["replay"]["max_temperature_c"] == pytest.approx(25 + 0.05 * example.T[-1])
    assert whole["replay"]["final_soc"] == example.solution().soc[-1]
    assert whole["pack"]["capacity_ah"] == pytest.approx(2.2)


def test_the_percentile_is_that_of_the_samples_of_all_segments() -> None:
    inside = (example.T >= 14) & (example.T < 30)
    expected = np.quantile(example.CURRENT[inside], 0.99)
    assert document("whole")["motions"]["hover"]["p99_current_a"] == pytest.approx(expected)
