"""Something known put into a recording of a real cell, whose twin errs as real twins do."""

from dataclasses import replace
from pathlib import Path

import pytest

from proof.recorded.shipped import put_into
from proof.recorded.trials import recorded
from proof.trial import NoTrial
from twin.effects import SeriesResistance
from twin.mismatch import HYPOTHESES
from twin.mismatch.fit import fit, refit
from twin.mismatch.split import split

SHARED = Path(__file__).parents[3] / "shared"  # recordings on the machine of who works on this
OHM = 0.027


def test_a_level_that_is_off_all_along_costs_more_than_one_sample(tmp_path: Path) -> None:
    """An LG M50 at 0 degC: squares find the resistance, a loss that tames one sample 40 mOhm."""
    put_into(tmp_path)
    (told_right,) = (t for t in recorded(SHARED, tmp_path) if t.name == "trial-h39")
    try:
        question, _ = told_right.make()
    except NoTrial as e:
        pytest.skip(str(e))
    both = (
        [
            replace(f, voltage_V=f.voltage_V - OHM * f.load.current_A)
            for f in question.flights(given)
        ]
        for given in (question.fitted, question.held_out)
    )
    data = split(*both, slow_V=question.floor_V)
    there = fit(data.squared, [h for h in HYPOTHESES if h.id == "series_resistance"])
    found = refit(data, there)
    own = (e.resistance_ohm for e in question.pack.effects if isinstance(e, SeriesResistance))
    ohm = found.problem.values(found.q)["series_resistance"]["resistance_ohm"] - sum(own)
    assert ohm == pytest.approx(OHM, abs=5e-3)
