"""Drawings: nothing a person could see is lost, and equal input gives equal bytes."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from reports import plots
from tests.reports import example

VALUES = hnp.arrays(
    float, st.integers(1, 400), elements=st.one_of(st.floats(-1e3, 1e3), st.just(np.nan))
)


@given(values=VALUES)
@settings(max_examples=100)
def test_each_column_keeps_its_lowest_and_highest_sample(values: np.ndarray) -> None:
    t = np.arange(values.size, dtype=float)
    columns = 10
    kept_t, kept = plots.decimate(t, values, columns)
    assert set(kept_t) <= set(t)
    assert np.all(np.diff(kept_t) > 0)
    if values.size > 4 * columns:
        assert kept_t.size <= 5 * columns
        edges = np.linspace(t[0], t[-1], columns + 1)[1:-1]
        for part, shown in zip(
            np.split(values, np.searchsorted(t, edges)),
            np.split(kept, np.searchsorted(kept_t, edges)),
            strict=True,
        ):
            assert np.isnan(part).any() == np.isnan(shown).any()
            if np.isfinite(part).any():
                assert np.nanmin(shown) == np.nanmin(part)
                assert np.nanmax(shown) == np.nanmax(part)


def test_no_line_is_drawn_across_a_gap() -> None:
    t, y = plots.broken_at_gaps(np.array([0.0, 1.0, 9.0, 10.0]), np.arange(4.0), gap_s=2.0)
    np.testing.assert_array_equal(t, [0.0, 1.0, 5.0, 9.0, 10.0])
    np.testing.assert_array_equal(y, [0.0, 1.0, np.nan, 2.0, 3.0])


def drawn(name: str = "a") -> str:
    canvas, axes = plots.panels([1.0, 1.0])
    plots.shade(axes, example.segments())
    plots.line(axes[0], example.T, example.CURRENT, plots.MEASURED, "sensor")
    plots.line(axes[1], example.T, np.full(example.T.size, np.nan), plots.MEASURED, "nothing")
    plots.legend(axes[0])
    plots.motion_key(canvas, example.segments())
    return plots.to_svg(canvas, name)


def test_the_same_drawing_has_the_same_bytes_and_no_date() -> None:
    assert drawn() == drawn()
    assert not re.search(r"20\d\d-\d\d-\d\d|<metadata", drawn())


def test_two_drawings_share_no_id_and_refer_only_to_their_own() -> None:
    ids = {}
    for name in ("a", "b"):
        svg = drawn(name)
        ET.fromstring(svg)
        found = re.findall(r'\bid="([^"]*)"', svg)
        assert len(found) == len(set(found))
        refers = set(re.findall(r'(?:href="#|url\(#)([^")]*)', svg))
        assert refers <= set(found)
        ids[name] = set(found)
    assert not ids["a"] & ids["b"]


def test_what_was_never_measured_is_not_drawn() -> None:
    assert "nothing" not in drawn()


@pytest.mark.parametrize("motion", list(plots.Motion))
def test_every_motion_has_a_colour_and_a_name(motion: plots.Motion) -> None:
    assert len(plots.rgb(motion)) == 3
    assert plots.motion_name(motion)


def test_motions_are_told_apart_by_their_colour() -> None:
    assert len(set(plots.MOTION_COLOUR.values())) == len(plots.Motion)
