"""A pack file with what was named switched on."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from tests.twin.mismatch.recordings import flown
from twin.effects import CurrentGain, WeakCell
from twin.mismatch import MismatchError, Verdict, adopted_text, explain
from twin.mismatch.finding import Value
from twin.mismatch.hypothesis import HYPOTHESES
from twin.pack_file import effects_of, parse_pack_file

GAIN = [h for h in HYPOTHESES if h.id == "current_gain"]
PACK = """[pack]
name = "p"
cell = "lipo_2200"
series = 4
[twin]
physics = []
"""


def test_what_is_adopted_is_in_the_next_twin() -> None:
    finding = explain([flown([CurrentGain(gain=1.06)], seed=1)], hypotheses=GAIN)
    told = PACK + "[standard_errors]\ncurrent_gain.gain = 0.1\nleakage.current_A = 0.1\n"
    text = adopted_text(finding, parse_pack_file(told, name="p"), cell="lipo_2200")
    (effect,) = effects_of(adopted := parse_pack_file(text, name="adopted"))
    assert isinstance(effect, CurrentGain)
    assert effect.gain == finding.effects[0].parameters[0].value
    assert set(adopted.standard_errors) == {"leakage"}  # that of another gain is gone


@pytest.mark.parametrize("weak", ["[effects.weak_cell]", "[[effects.weak_cell]]"])
def test_of_several_weak_cells_the_one_that_was_fitted_is_adopted(weak: str) -> None:
    """The first; a calibration writes lists, a pilot may write a table."""
    several = weak.startswith("[[")
    first, second = WeakCell(cell=2, soc_offset=-0.01), WeakCell(cell=3, capacity_factor=0.9)
    text = PACK.replace("physics = []", 'physics = ["weak_cell"]')
    text += f"{weak}\ncell = 2\nsoc_offset = -0.01\n"
    text += f"{weak}\ncell = 3\ncapacity_factor = 0.9\n" if several else ""
    named = SimpleNamespace(
        pack_id="weak_cell",
        parameters=(Value(name="soc_offset", value=-0.05, std=0.01, unit="1"),),
    )
    finding: Any = SimpleNamespace(verdict=Verdict.NAMED, effects=(named,))
    adopted = adopted_text(finding, parse_pack_file(text, name="p"), cell="lipo_2200")
    expected = (replace(first, soc_offset=-0.05), *([second] if several else []))
    assert effects_of(parse_pack_file(adopted, name="adopted")) == expected


def test_nothing_is_adopted_where_nothing_was_named() -> None:
    finding = explain([flown(seed=1)], hypotheses=GAIN)
    with pytest.raises(MismatchError, match="nothing to adopt"):
        adopted_text(finding, parse_pack_file(PACK, name="p"), cell="lipo_2200")
