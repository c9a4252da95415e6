"""The CSV files of a flight: what stands in them, and that the twin reads a profile back."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from reports.tables import profile_csv, segments_csv
from segment.segment import Basis, LoadStatistics, Motion, Segment
from tests.reports import example
from twin.load import Between
from twin.load_csv import read_load_csv

LOAD = LoadStatistics(
    charge_C=288.0, energy_J=4550.4, mean_A=18.0, rms_A=18.018, p99_A=18.5, ripple_A=0.35
)
SEGMENT = Segment(motion=Motion.HOVER, start_s=14.0, stop_s=30.1234, basis=Basis.STICKS, load=LOAD)


def test_a_segment_is_a_row_whose_columns_say_quantity_and_unit() -> None:
    (row,) = csv.DictReader(io.StringIO(segments_csv([SEGMENT])))
    assert row == {
        "motion": "hover",
        "start_s": "14.000",
        "stop_s": "30.123",
        "basis": "sticks",
        "charge_C": "288",
        "energy_J": "4550.4",
        "mean_A": "18",
        "rms_A": "18.018",
        "p99_A": "18.5",
        "ripple_A": "0.35",
    }


def test_segments_stand_in_their_order_and_an_unmeasured_energy_is_empty() -> None:
    dark = replace(SEGMENT, load=replace(LOAD, energy_J=float("nan")))
    rows = list(csv.DictReader(io.StringIO(segments_csv([*example.segments(), dark]))))
    assert [(r["motion"], float(r["start_s"]), float(r["stop_s"])) for r in rows[:-1]] == [
        (motion.value, start, stop) for motion, start, stop, _ in example.SPANS
    ]
    assert (rows[-1]["energy_J"], rows[-1]["charge_C"]) == ("", "288")


def test_a_profile_is_read_by_the_twin_as_the_load_that_it_is() -> None:
    profile = example.profile()
    text = profile_csv(profile)
    assert text.startswith("time_s,current_A\n")
    table = read_load_csv(io.StringIO(text), name="profile_hover.csv")
    assert table.remarks == ()
    load = table.load(between=Between.LINEAR, ambient_K=298.15)
    six_digits = {"rtol": 5e-6, "atol": 1e-12}
    np.testing.assert_allclose(load.time_s, profile.time_s, **six_digits)
    np.testing.assert_allclose(load.current_A, profile.current_A, **six_digits)
    assert load.charge_C() == pytest.approx(np.trapezoid(profile.current_A, profile.time_s))
