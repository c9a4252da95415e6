"""A verdict beside the truth."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proof.compare import adopted, opened, outcome, sized
from proof.outcome import Named, Outcome
from proof.targets import predicted_rms
from proof.truth import NO_NAME, Channel, Number, Truth
from tests.proof import trials
from tests.proof.trials import asked
from tests.twin.mismatch.recordings import pack
from twin.effects import SeriesResistance, WeakCell
from twin.simulate import simulate


def truth(kind: str = "single", **more: object) -> Truth:
    plain: dict[str, object] = {
        "kind": kind, "said": "", "verdicts": ("named",), "effects": (("a",),), "strength": 3.0,
        "floor_V": 0.01,
    }  # fmt: skip
    return Truth(**(plain | more))  # type: ignore[arg-type]


def named(*lists: tuple[str, ...]) -> tuple[Named, ...]:
    return tuple(Named(id=own[0], probability=0.9, equivalent=own[1:]) for own in lists)


SINGLE, PAIR = truth(), truth("pair", effects=(("a",), ("b",)))
CONTROL = truth("control", verdicts=("none",), effects=())
FOREIGN = truth("foreign", verdicts=("unknown",), effects=())
EITHER = truth("ageing", effects=(("a", "b"),), also=("r",))
REAL = truth("real control", verdicts=NO_NAME, effects=())
UNEVEN = truth("real foreign", verdicts=("unknown",), effects=())


@pytest.mark.parametrize(
    ("true", "said", "lists", "expected"),
    [
        (SINGLE, "named", [("a",)], Outcome.RIGHT),
        (SINGLE, "named", [("x", "y", "a")], Outcome.RIGHT),  # alike by the recordings
        (SINGLE, "named", [("x", "y", "z", "w", "a")], Outcome.WRONG),  # alike to all says nothing
        (SINGLE, "named", [("x",)], Outcome.WRONG),
        (SINGLE, "named", [("a",), ("x",)], Outcome.WRONG),  # one too many
        (SINGLE, "unknown", [], Outcome.MISSED),
        (SINGLE, "none", [], Outcome.MISSED),
        (PAIR, "named", [("b",), ("a",)], Outcome.RIGHT),
        (PAIR, "named", [("b", "a"), ("x", "b")], Outcome.RIGHT),
        (PAIR, "named", [("b",)], Outcome.PART),
        (PAIR, "named", [("b", "a"), ("x",)], Outcome.WRONG),  # one list is one effect
        (PAIR, "named", [("a",), ("b",), ("x",)], Outcome.WRONG),
        (CONTROL, "none", [], Outcome.RIGHT),
        (CONTROL, "named", [("a",)], Outcome.WRONG),
        (CONTROL, "unknown", [], Outcome.WRONG),  # a false alarm too
        (FOREIGN, "unknown", [], Outcome.RIGHT),
        (FOREIGN, "named", [("a",)], Outcome.WRONG),
        (FOREIGN, "none", [], Outcome.MISSED),
        (EITHER, "named", [("b",), ("r",)], Outcome.RIGHT),
        (EITHER, "named", [("b",), ("x",)], Outcome.WRONG),
        (EITHER, "named", [("r",)], Outcome.PART),
        (REAL, "unknown", [], Outcome.RIGHT),
        (REAL, "ambiguous", [], Outcome.WRONG),  # names, and not which
        (UNEVEN, "unknown", [], Outcome.RIGHT),
        (UNEVEN, "none", [], Outcome.MISSED),
        (UNEVEN, "named", [("heat",)], Outcome.WRONG),
        (REAL, "named", [("heat",)], Outcome.WRONG),
        (REAL, "named", [("x",)], Outcome.WRONG),
    ],
)
def test_outcome(true: Truth, said: str, lists: list[tuple[str, ...]], expected: Outcome) -> None:
    assert outcome(true, said, named(*lists)) is expected


def _value(name: str, value: float) -> Mapping[str, Any]:
    return {"name": name, "value": value, "std": 1e-3, "unit": "Ohm"}


ALIKE: Mapping[str, Any] = {
    "verdict": "named",
    "effects": [
        {
            "id": "series_resistance",
            "equivalent": ["weak_cell"],
            "parameters": [_value("resistance_ohm", 0.02)],
            "instead": {"weak_cell": [_value("resistance_ohm", 0.0201)]},
        }
    ],
}


def test_of_effects_that_look_alike_the_one_asked_about_is_adopted() -> None:
    plain, about_heat, about_cells = (
        adopted(pack(), ALIKE, about) for about in ((), ("cold_pack",), ("weak_cell",))
    )
    assert plain is not None
    assert about_heat is not None
    assert about_cells is not None
    assert plain.effects == about_heat.effects == (SeriesResistance(resistance_ohm=0.02),)
    assert about_cells.effects == (WeakCell(resistance_ohm=0.0201),)
    assert adopted(pack(), {"verdict": "none", "effects": []}) is None


def test_numbers_of_what_looks_alike_are_set_beside_the_truth() -> None:
    own = Number(effect="weak_cell", name="resistance_ohm", value=0.02, unit="Ohm")
    (number,) = sized(truth(numbers=(own,)), ALIKE)
    assert (number.true, number.found, number.std) == (0.02, 0.0201, 1e-3)
    (absent,) = sized(truth(numbers=(replace(own, effect="leakage"),)), ALIKE)
    assert absent.found is None


def test_voltages_of_cells_are_those_of_a_weak_cell_that_looks_like_what_was_named() -> None:
    """A resistance at the terminals would lower each of four cells by a quarter of it."""
    question = asked(0.0)
    own = question.held_out[0]
    true = replace(pack(), effects=(WeakCell(resistance_ohm=0.02),))
    cells_V = simulate(true, question.load(own)).cell_voltage_V.T
    both = Channel(
        recording=own.name,
        time_s=own.time_s,
        cell_voltage_V=cells_V,
        temperature_K=np.full(own.time_s.size, 298.15),
    )
    warm, weakest, others = opened(question, truth(channels=(both,)), ALIKE)
    assert (warm.channel, weakest.channel, others.channel) == (
        "temperature", "weakest cell", "other cells",
    )  # fmt: skip
    assert weakest.rms_before > 0.1
    assert weakest.rms_after == pytest.approx(0.0, abs=2e-3)
    assert others.rms_after == pytest.approx(0.0, abs=1e-6)


def test_a_channel_counts_by_what_was_named_not_by_what_looks_like_it() -> None:
    """A resistance was named, heat looks like it: which of them is asked for, nobody knew."""
    question = trials.asked(trials.OHM)
    truth = trials.true_of(trials.OHM, question)
    ohm = {"name": "resistance_ohm", "value": trials.OHM}
    heat = {"name": "heat_transfer_W_m2_K", "value": 5.0}
    verdict = {
        "verdict": "named",
        "effects": [
            {
                "id": "series_resistance", "probability": 1.0, "equivalent": ["self_heating"],
                "parameters": [ohm], "instead": {"self_heating": [heat]},
            }
        ],
    }  # fmt: skip
    (found,) = opened(question, truth, verdict)
    assert found.rms_named == pytest.approx(found.rms_before, abs=0.05)
    assert found.rms_after is not None
    assert abs(found.rms_after - found.rms_before) > 0.2
    assert predicted_rms(found) == found.rms_named
