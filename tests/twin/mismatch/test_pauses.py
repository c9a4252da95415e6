"""Where a logger paused, and what may have flowed there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from twin.load import Between, Load
from twin.mismatch.pauses import filled, pauses


def gusty(memory_s: float, *, seconds: float = 4000.0, seed: int = 1) -> Load:
    """At 10 Hz, gusts that forget in `memory_s`."""
    time_s = np.arange(0.0, seconds, 0.1)
    keep = np.exp(-0.1 / memory_s)
    white = np.random.default_rng(seed).standard_normal(time_s.size)
    gusts_A = 3.0 * np.sqrt(1 - keep**2) * lfilter([1.0], [1.0, -keep], white)
    return Load(time_s=time_s, current_A=20.0 + gusts_A)


def paused(load: Load, *spans: tuple[float, float]) -> Load:
    """Without the samples in between."""
    t = load.time_s
    kept = np.all([(t <= start) | (t >= end) for start, end in spans], axis=0)
    return replace(load, time_s=t[kept], current_A=load.current_A[kept])


@pytest.mark.parametrize("memory_s", [0.3, 2.0])
@pytest.mark.parametrize("length_s", [2.0, 12.0])
def test_a_charge_that_nobody_saw_is_as_large_as_others_were(
    memory_s: float, length_s: float
) -> None:
    """150 pauses in a long flight against what flowed there: within a quarter."""
    whole = gusty(memory_s)
    starts = np.arange(13.0, 3990.0, 26.0)
    seen = paused(whole, *((s, s + length_s) for s in starts))
    at = np.isin(whole.time_s, seen.time_s)
    off_C = np.diff(whole.drawn_C()[at] - seen.drawn_C())
    holes = pauses(seen)
    assert len(holes) == starts.size
    true_C = np.sqrt(np.mean([off_C[h.after] ** 2 for h in holes]))
    said_C = np.sqrt(np.mean([np.mean(h.off_C(seen) ** 2) for h in holes]))
    assert said_C == pytest.approx(true_C, rel=0.25)


def test_what_is_filled_in_begins_and_ends_where_the_recording_does() -> None:
    seen = paused(gusty(1.0, seconds=200.0), (50.0, 58.0), (120.0, 125.0))
    holes = pauses(seen)
    assert [round(h.length_s, 3) for h in holes] == [8.0, 5.0]
    way, at = filled(seen, holes, np.random.default_rng(1))
    assert np.array_equal(way.time_s[at], seen.time_s)
    assert np.array_equal(way.current_A[at], seen.current_A)
    assert np.allclose(np.diff(way.time_s), 0.1)
    inside = np.setdiff1d(np.arange(way.time_s.size), at)
    assert np.std(way.current_A[inside]) == pytest.approx(3.0, rel=0.5)
    drawn_C = np.diff(way.drawn_C()[at] - seen.drawn_C())
    assert np.flatnonzero(np.abs(drawn_C) > 1e-9).tolist() == [h.after for h in holes]


def test_a_pause_longer_than_every_run_is_a_shorter_stretch_drawn_out() -> None:
    seen = paused(gusty(1.0, seconds=100.0), (20.0, 80.0))
    (hole,) = pauses(seen)
    assert hole.first.size > 10
    way, _ = filled(seen, [hole], np.random.default_rng(1))
    assert np.all(np.diff(way.time_s) > 0.0)
    assert np.isfinite(hole.off_C(seen)).all()


def test_what_is_no_pause() -> None:
    """Programmed steps, a logger that is late, a cycler that logs changes, hardly any samples."""
    gust = gusty(1.0, seconds=100.0)
    hole = paused(gust, (50.0, 60.0))
    assert len(pauses(hole)) == 1
    assert pauses(replace(hole, between=Between.HOLD)) == ()
    assert pauses(paused(gust, (50.0, 50.5))) == ()
    edges_s = np.arange(30.0, 1200.0, 30.0)
    time_s = np.unique([*edges_s - 1.0, *edges_s - 0.5, *edges_s, *edges_s + 0.5])
    assert pauses(Load(time_s=time_s, current_A=np.sin(time_s))) == ()
    assert pauses(Load(time_s=time_s[:2], current_A=time_s[:2])) == ()
