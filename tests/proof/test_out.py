"""`proof.json` keeps its schema, and says what was found in the units of its keys."""

import json
from dataclasses import replace
from importlib import resources
from typing import Any

import jsonschema
import pytest

from proof.out import proof_json
from proof.outcome import Outcome, Proof
from tests.proof.proof_example import judged, proof, recorded, simulated, truth

SCHEMA = json.loads((resources.files("proof") / "proof.schema.json").read_text(encoding="utf-8"))
CHECKER = jsonschema.Draft202012Validator(
    SCHEMA, format_checker=jsonschema.Draft202012Validator.FORMAT_CHECKER
)
CONTROL = judged(1, truth("control", "nothing", strength=1.0), Outcome.RIGHT, "none")
PROOFS = {
    "whole": proof(),
    "no trial": proof([]),
    "simulated": proof(simulated()),
    "recorded": proof(recorded()),
    "controls": proof([CONTROL]),
    "not finite": proof([replace(CONTROL, held_out_after_V=float("nan"), noise_V=0.0)]),
}


def written(of: Proof) -> dict[str, Any]:
    text = json.dumps(proof_json(of), allow_nan=False)
    return dict(json.loads(text))


def test_the_schema_is_one_and_leaves_no_object_open() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    parts = [SCHEMA, *SCHEMA["$defs"].values()]
    assert all(part["additionalProperties"] is False for part in parts)


@pytest.mark.parametrize("which", PROOFS)
def test_every_proof_keeps_the_schema(which: str) -> None:
    CHECKER.validate(written(PROOFS[which]))


def test_a_key_that_the_schema_does_not_know_is_refused() -> None:
    content = written(proof())
    content["trials"][0]["truth"]["secret"] = 1
    with pytest.raises(jsonschema.ValidationError):
        CHECKER.validate(content)


def test_numbers_are_in_the_units_of_their_keys() -> None:
    content = written(proof())
    by_name = {t["name"]: t for t in content["trials"]}
    heat, aged, weak = (by_name[f"trial-{k}"] for k in (13, 14, 16))
    assert heat["noise_mv"] == pytest.approx(8.0)
    assert heat["held_out_over_noise"] == pytest.approx(11.0 / 8.0)
    assert heat["held_out_over_floor"] == pytest.approx(11.0 / 8.0)
    assert heat["channels"][0]["rms_after_k"] == pytest.approx(0.8)
    assert weak["channels"][0]["rms_after_mv"] == pytest.approx(12.0)
    assert aged["truth"]["capacity_ah"] == pytest.approx(2.61)
    assert aged["capacity_error"] == pytest.approx(2.57 / 2.61 - 1)
    limits = {t["id"]: t for t in content["targets"]}
    assert limits["weak cell recorded"]["limit_mv"] == pytest.approx(15.0)
    assert limits["false alarms"]["measured_count"] == 1.0


def test_what_is_not_a_number_is_null() -> None:
    trial = written(PROOFS["not finite"])["trials"][0]
    assert trial["held_out_after_mv"] is None
    assert trial["held_out_over_noise"] is None
