"""Sizes in the tables of the mismatch cases."""

from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("pybamm", reason="PyBaMM makes the truth of these cases")

from benchmarks.mismatch_score import judged
from tests.mismatch_cases.case import Case
from tests.mismatch_cases.catalogue import HEATED, LIPO

CASE = Case(
    name="some", split="tune", seed=1, truth=("initial_soc",), sizes=(0.02,), flavours=(0,),
    strength="3x", plan="hover", variant="plain", noise_V=8e-3, missed_V=(), told=LIPO[0],
    recordings=(), concealed=(),
)  # fmt: skip


def verdict(effect: str, *told: tuple[str, float, float]) -> dict[str, Any]:
    parameters = [{"name": name, "value": value, "std": std} for name, value, std in told]
    own = {"id": effect, "equivalent": [], "probability": 0.97, "parameters": parameters}
    return {"verdict": "named", "effects": [own], "rmse_mv": {"holdout_after": 8.0}, "seconds": 1.0}


def test_a_size_is_judged_in_its_stated_deviation() -> None:
    ((effect, off),) = judged(CASE, verdict("initial_soc", ("offset", -0.018, 0.001))).sized
    assert (effect, off) == ("initial_soc", pytest.approx(2.0))


def test_a_number_that_was_not_told_has_no_size() -> None:
    assert judged(CASE, verdict("initial_soc")).sized == ()


def test_what_the_pack_decides_has_no_size() -> None:
    """Cold air or a cold start under a twin with heat; fuller than full is emptier."""
    cold = replace(CASE, truth=("cold_pack",), told=HEATED)
    assert judged(cold, verdict("cold_pack", ("start_offset_K", -0.02, 0.1))).sized == ()
    full = replace(CASE, sizes=(0.06,), flavours=(1,))
    assert judged(full, verdict("initial_soc", ("offset", -0.06, 0.001))).sized == ()
