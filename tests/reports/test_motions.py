"""Segments of one motion together: each counts by how long it lasted."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from reports.motions import motion_loads
from reports.parts.flight import LoadPart
from reports.results import result_of
from segment.segment import Basis, LoadStatistics, Motion, Segment
from tests.reports import example


def hover(start_s: float, stop_s: float, mean_A: float, rms_A: float, ripple_A: float) -> Segment:
    charge_C = mean_A * (stop_s - start_s)
    load = LoadStatistics(
        charge_C=charge_C,
        energy_J=15.0 * charge_C,
        mean_A=mean_A,
        rms_A=rms_A,
        p99_A=1.2 * mean_A,
        ripple_A=ripple_A,
    )
    return Segment(
        motion=Motion.HOVER, start_s=start_s, stop_s=stop_s, basis=Basis.SETPOINT, load=load
    )


PARTS = (hover(0.0, 10.0, 10.0, 12.0, 1.0), hover(20.0, 50.0, 20.0, 21.0, 2.0))
CURRENT_A = np.where(example.T < 15.0, 10.0, 20.0) + 0.01 * example.T


def test_segments_add_up_weighed_by_their_durations_and_rms_by_squares() -> None:
    hovered = motion_loads(example.recording(current_A=CURRENT_A), PARTS)[Motion.HOVER]
    assert (hovered.segments, hovered.time_s) == (2, 40.0)
    load = hovered.load
    assert load.charge_C == pytest.approx(700.0)
    assert load.energy_J == pytest.approx(10500.0)
    assert load.mean_A == pytest.approx(17.5)
    assert load.rms_A == pytest.approx(((10 * 12.0**2 + 30 * 21.0**2) / 40) ** 0.5)
    assert load.ripple_A == pytest.approx(((10 * 1.0**2 + 30 * 2.0**2) / 40) ** 0.5)
    inside = (example.T < 10.0) | ((example.T >= 20.0) & (example.T < 50.0))
    assert load.p99_A == pytest.approx(np.quantile(CURRENT_A[inside], 0.99))


@pytest.mark.parametrize(
    "of",
    [lambda r: r.motions.hover, lambda r: r.segments[0]],
    ids=["motion", "segment"],
)
def test_the_result_has_each_number_of_a_load_under_its_name(of: Callable) -> None:
    one = replace(PARTS[1], start_s=0.0)
    report = example.report(
        recording=example.recording(current_A=np.full(example.T.size, 24.0)), segments=(one,)
    )
    part = of(result_of(report))
    assert isinstance(part, LoadPart)
    assert {name: getattr(part, name) for name in LoadPart.model_fields} == pytest.approx(
        {
            "charge_ah": 600.0 / 3600,
            "energy_wh": 9000.0 / 3600,
            "mean_current_a": 20.0,
            "rms_current_a": 21.0,
            "p99_current_a": 24.0,
            "ripple_a": 2.0,
        }
    )
