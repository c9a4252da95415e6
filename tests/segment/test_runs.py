from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from segment.runs import (
    absorb_short,
    constant_runs,
    drop_short,
    fill_short,
    hysteresis,
    moving_average,
    pieces,
    runs,
)

masks = st.lists(st.booleans(), max_size=40).map(lambda x: np.array(x, dtype=bool))


@given(masks)
def test_runs_cover_exactly_the_true_samples_and_never_touch(mask):
    found = runs(mask)
    rebuilt = np.zeros(mask.size, dtype=bool)
    for a, b in found:
        assert a < b
        rebuilt[a:b] = True
    assert np.array_equal(rebuilt, mask)
    assert all(b < c for (_, b), (c, _) in pairwise(found))


@given(st.lists(st.integers(-4, 3), max_size=40))
def test_constant_runs_split_at_every_change_and_nowhere_else(values):
    found = constant_runs(np.array(values, dtype=int))
    assert [v for a, b in found for v in [values[a]] * (b - a)] == values
    assert all(values[a - 1] != values[a] for a, _ in found[1:])


def test_short_rests_are_filled_and_long_ones_are_not():
    t = np.arange(10.0)
    mask = np.array([0, 1, 0, 0, 1, 0, 0, 0, 1, 0], dtype=bool)
    assert fill_short(t, mask, 2.5).tolist() == [0, 1, 1, 1, 1, 0, 0, 0, 1, 0]


def test_a_rest_at_either_end_is_no_pause():
    t = np.arange(4.0)
    mask = np.array([0, 1, 1, 0], dtype=bool)
    assert fill_short(t, mask, 99.0).tolist() == mask.tolist()


def test_short_bursts_are_dropped_by_time_not_by_count():
    t = np.array([0.0, 0.1, 0.2, 0.3, 5.0, 10.0, 15.0])
    mask = np.array([0, 1, 1, 0, 1, 0, 0], dtype=bool)
    assert drop_short(t, mask, 1.0).tolist() == [0, 0, 0, 0, 1, 0, 0]


def test_hysteresis_starts_at_the_release_level_of_a_stretch_that_engages():
    x = np.array([0.0, 0.3, 0.6, 0.3, 0.0, 0.3, 0.3, 0.0, np.nan, 0.6])
    assert hysteresis(x, 0.2, 0.5).tolist() == [0, 1, 1, 1, 0, 0, 0, 0, 0, 1]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=30))
def test_hysteresis_is_symmetric_in_time(values):
    x = np.array(values)
    assert np.array_equal(hysteresis(x, 0.3, 0.6)[::-1], hysteresis(x[::-1], 0.3, 0.6))


def test_moving_average_is_the_mean_of_the_samples_in_reach():
    t = np.arange(5) * 0.5
    x = np.array([0.0, 1.0, 2.0, np.nan, 4.0])
    assert moving_average(t, x, 1.0).tolist() == [0.5, 1.0, 1.5, 3.0, 4.0]


def test_moving_average_leaves_a_straight_line_alone_inside():
    t = np.arange(50) * 0.1
    x = np.column_stack([3 * t, -t])
    got = moving_average(t, x, 1.0)
    assert got[5:-5] == pytest.approx(x[5:-5], abs=1e-12)


def test_moving_average_knows_nothing_where_nothing_was_measured():
    t = np.arange(5.0)
    x = np.array([1.0, np.nan, np.nan, np.nan, 1.0])
    assert np.isnan(moving_average(t, x, 2.0)[2])


def test_a_recording_is_cut_at_gaps_and_a_slow_recording_is_not_all_gaps():
    assert pieces(np.array([0.0, 0.1, 0.2, 2.0, 2.1]), 1.0) == [(0, 3), (3, 5)]
    assert pieces(np.array([0.0, 2.0, 4.0, 6.0]), 1.0) == [(0, 4)]
    assert pieces(np.zeros(0), 1.0) == []


def absorbed(codes, shortest=2.0):
    t = np.arange(len(codes)) * 1.0
    return absorb_short(t, np.array(codes), shortest, fixed=(-1,)).tolist()


def test_a_short_stretch_goes_to_the_neighbour_that_differs_less():
    assert absorbed([0, 0, 0, 1, 3, 3, 3]) == [0, 0, 0, 3, 3, 3, 3]  # a tie: to what moves
    assert absorbed([3, 3, 3, 0, 1, 1, 1]) == [3, 3, 3, 1, 1, 1, 1]
    assert absorbed([0, 0, 0, 3, 1, 1, 1]) == [0, 0, 0, 1, 1, 1, 1]


def test_a_stretch_between_two_alike_is_shared_in_the_middle():
    t = np.arange(12) * 0.5
    codes = np.array([1, 1, 1, 1, 3, 3, 2, 2, 2, 2, 2, 2])
    got = absorb_short(t, codes, 2.0, fixed=())
    assert got.tolist() == [1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2]


def test_fixed_stretches_neither_give_nor_take():
    assert absorbed([-1, 0, -1, 0, 0, 0]) == [-1, 0, -1, 0, 0, 0]


@settings(max_examples=60)
@given(st.lists(st.sampled_from([-1, 0, 1, 2, 3]), min_size=1, max_size=30))
def test_after_absorption_nothing_short_stands_beside_something_that_could_take_it(codes):
    got = absorbed(codes, shortest=3.0)
    assert [c == -1 for c in got] == [c == -1 for c in codes]
    parts = constant_runs(np.array(got))
    for k, (a, b) in enumerate(parts):
        ends = min(b, len(got) - 1) - a
        beside = [got[parts[j][0]] for j in (k - 1, k + 1) if 0 <= j < len(parts)]
        assert got[a] == -1 or ends >= 3 or all(c == -1 for c in beside)
