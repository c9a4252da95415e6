"""What the judge reads is what was asked, to the last digit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyze.checks import checked_pack
from analyze.workbench.drawn import Ask, read_drawn
from proof.question import PACK, Question
from tests.proof import trials
from twin.builtin import load_cell
from twin.effects import CurrentGain, SelfHeating, SeriesResistance
from twin.pack import Pack

PACKS = [
    Pack(cell=load_cell("lipo_2200"), series=4, initial_soc=0.93, initial_K=285.3,
         heat_transfer_W_m2_K=21.0),
    Pack(
        cell=replace(load_cell("lg_m50"), name="another", area_m2=0.11), series=1, parallel=3,
        capacity_C=3 * 3600.0, initial_soc=0.61, initial_K=299.0, heat_transfer_W_m2_K=17.3,
        effects=(SelfHeating(heat_transfer_W_m2_K=17.3), SeriesResistance(resistance_ohm=0.012),
                 CurrentGain(gain=1.02)),
    ),
]  # fmt: skip


@pytest.mark.parametrize("pack", PACKS, ids=["as it is", "calibrated"])
def test_files_say_all_that_the_question_says(pack: Pack, tmp_path: Path) -> None:
    base = trials.asked(0.0)
    gone = base.fitted[0].voltage_V.copy()
    gone[3:5] = np.nan
    question = Question(
        pack=pack, ambient_K=288.15, fitted=(replace(base.fitted[0], voltage_V=gone),),
        held_out=base.held_out, builtin="lipo_2200" if pack is PACKS[0] else "",
    )  # fmt: skip
    question.write(tmp_path)
    (flight,) = question.flights(question.fitted)
    choice = checked_pack(tmp_path / PACK)
    ask = Ask(
        source=tmp_path / "flight-1.csv", pack=tmp_path / PACK, out=tmp_path, between="linear",
        sensor=None, battery=None,
    )  # fmt: skip
    drawn = read_drawn(ask, choice)
    assert np.array_equal(drawn.load.time_s, flight.load.time_s)
    assert np.array_equal(drawn.load.current_A, flight.load.current_A)
    assert drawn.load.ambient_K == pytest.approx(flight.load.ambient_K, abs=1e-9)
    assert np.array_equal(drawn.recorded_V, flight.voltage_V, equal_nan=True)
    assert drawn.pack.effects == flight.pack.effects
    for name in ("series", "parallel", "initial_soc", "initial_K", "heat_transfer_W_m2_K"):
        assert getattr(drawn.pack, name) == pytest.approx(getattr(flight.pack, name), abs=1e-9)
    mine, theirs = flight.pack.cell_parameters(), drawn.pack.cell_parameters()
    assert theirs == pytest.approx(mine, rel=1e-9)


def test_options_name_every_recording_and_the_floor() -> None:
    question = replace(trials.asked(0.0), floor_V=0.0123)
    options = question.options()
    assert options[:3] == ("flight-1.csv", "--holdout", "held-out.csv")
    assert options[options.index("--floor-mv") + 1] == "12.3"
