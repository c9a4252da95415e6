"""Repair of a file's clock, and spans from switching states, on plain arrays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs.log import Interval
from flightlogs.spans import flying_by_throttle, mode_spans, overlap, spans_of, switched
from flightlogs.stamps import file_clock, increasing, is_spike, is_stray, without_steps

T = np.arange(0.0, 60.0, 0.1)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(1e-3, 300.0), min_size=9, max_size=60))
def test_a_sequence_in_order_is_left_alone_whatever_its_pauses(steps: list[float]) -> None:
    time_s = np.cumsum(steps)
    assert not is_spike(time_s).any()
    np.testing.assert_array_equal(without_steps(time_s)[0], time_s)
    assert increasing(time_s).all()


@pytest.mark.parametrize("off_s", [-5.0, 5.0, -1e6, 1e6])
def test_one_damaged_stamp_is_found(off_s: float) -> None:
    time_s = T + off_s * (np.arange(T.size) == 300)
    np.testing.assert_array_equal(np.flatnonzero(is_spike(time_s)), [300])


@pytest.mark.parametrize("place", [0, 299, 599])
def test_a_stamp_years_off_is_found_at_the_ends_too(place: int) -> None:
    time_s = T + 1e9 * (np.arange(T.size) == place)
    np.testing.assert_array_equal(np.flatnonzero(is_stray(time_s)), [place])


def test_a_lasting_step_back_is_closed_up_and_counted() -> None:
    mended, steps = without_steps(T - 20 * (T >= 30))
    assert steps == 1
    np.testing.assert_allclose(np.diff(mended)[np.diff(mended) > 0], 0.1)
    assert np.diff(mended).min() >= 0


def test_records_without_a_stamp_have_the_time_of_the_last_one_before() -> None:
    clock = file_clock({"A": (np.array([10, 20, 30]), np.array([1.0, 2.0, 3.0]))})
    np.testing.assert_array_equal(clock.at(np.array([5, 10, 19, 99])), [1, 1, 1, 3])
    np.testing.assert_array_equal(clock.between(np.array([10, 15, 30])), [1, 1.5, 3])
    np.testing.assert_array_equal(clock.of(np.array([20])), [2])


def test_rows_that_do_not_advance_are_dropped() -> None:
    time_s = np.array([1.0, np.nan, 2.0, 2.0, 1.5, 3.0])
    np.testing.assert_array_equal(increasing(time_s), [True, False, True, False, False, True])


def test_spans_run_from_switching_on_to_switching_off_or_the_end() -> None:
    on = np.array([False, True, True, False, True])
    assert spans_of(np.arange(5.0), on, 9.0) == (Interval(1.0, 3.0), Interval(4.0, 9.0))
    assert spans_of(np.zeros(0), np.zeros(0, dtype=bool), 9.0) == ()


def test_before_its_first_event_a_state_was_the_opposite() -> None:
    off = switched(np.array([4.0]), np.array([False]), start_s=0.0, end_s=9.0)
    assert off == (Interval(0.0, 4.0),)
    assert switched(np.array([4.0]), np.array([True]), start_s=0.0, end_s=9.0) == (
        Interval(4.0, 9.0),
    )


def test_overlap_keeps_what_lies_in_both() -> None:
    flown = (Interval(0.0, 5.0), Interval(6.0, 9.0))
    assert overlap(flown, (Interval(4.0, 7.0),)) == (Interval(4.0, 5.0), Interval(6.0, 7.0))


def test_repeated_modes_are_one_span() -> None:
    spans = mode_spans(np.array([0.0, 1.0, 2.0]), ["A", "A", "B"], 5.0)
    assert [(m.start_s, m.stop_s, m.name) for m in spans] == [(0, 2, "A"), (2, 5, "B")]


def test_a_dip_of_the_throttle_does_not_end_a_flight_and_a_burst_is_none() -> None:
    throttle = np.where((T > 10) & (T < 40), 0.4, 0.0)
    throttle[(T > 20) & (T < 22)] = 0.05
    throttle[(T > 50) & (T < 51)] = 0.5
    (flight,) = flying_by_throttle(T, throttle, 0.15, T[-1])
    assert (flight.start_s, flight.stop_s) == (pytest.approx(10.1), pytest.approx(40.0))
