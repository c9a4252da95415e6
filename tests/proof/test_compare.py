"""A verdict beside the truth."""

import pytest

from proof.compare import outcome
from proof.outcome import Named, Outcome
from proof.truth import Truth


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
REAL = truth(
    "real control", verdicts=("none", "unknown", "ambiguous"), effects=(), forbidden=("heat",)
)


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
        (REAL, "named", [("heat",)], Outcome.WRONG),
        (REAL, "named", [("x",)], Outcome.WRONG),
    ],
)
def test_outcome(true: Truth, said: str, lists: list[tuple[str, ...]], expected: Outcome) -> None:
    assert outcome(true, said, named(*lists)) is expected
