"""The row of a flight in `fleet.parquet`: each number under its name, in its unit."""

from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from analyze.output import write_fleet
from reports.fleet import Fleet
from tests.reports import example
from tests.reports.mismatch_example import pair
from tests.reports.test_fleet import flight
from twin.calibrate.flight import NotFitted

STUDY = example.study(thorough=False)


def stored(folder: Path, **changes: object) -> dict:
    """The row of one flight."""
    flown = flight("a", 1, **changes)
    write_fleet(folder, Fleet(flights=(flown,), failures=(), passed_over=0, version="0"))
    (row,) = pq.read_table(folder / "fleet.parquet").to_pylist()
    return row


def test_what_was_fitted_lost_and_left_out_is_in_the_row(tmp_path: Path) -> None:
    pack = replace(example.fitted_pack(), capacity_C=2.05 * 3600)
    row = stored(tmp_path, pack=pack, damage=STUDY, mismatch=pair())
    assert row["capacity_ah"] == pytest.approx(2.05)
    assert row["capacity_std_ah"] == pytest.approx(0.06)
    assert row["pulse_ohm"] == pytest.approx(0.0412)
    assert (row["mismatch"], row["mismatch_effects"]) == ("named", "self_heating+series_resistance")
    flown = STUDY.attribution
    lost_C = sum(
        cost.loss.inventory_C
        for span, cost in zip(flown.spans, flown.costs, strict=True)
        if span.name != "ground"
    )
    assert row["lithium_lost_mah"] == pytest.approx(lost_C / 3.6)
    assert lost_C > 0
    assert row["charge_ah"] == pytest.approx(
        sum(s.load.charge_C for s in example.segments()) / 3600
    )
    assert (row["hover_s"], row["vertical_s"], row["horizontal_s"]) == (16.0, 8.0, 14.0)


def test_what_was_not_told_is_null_in_the_row(tmp_path: Path) -> None:
    fitting = replace(example.fitted_pack().fitting, outcome=NotFitted("it was a hop"))
    row = stored(tmp_path, pack=replace(example.pack(), fitting=fitting))
    for name in (
        "capacity_std_ah",
        "pulse_ohm",
        "lithium_lost_mah",
        "mismatch",
        "mismatch_effects",
    ):
        assert row[name] is None, name
    assert row["capacity_ah"] == pytest.approx(2.2)
