"""Stamps as real logs have them: held, stray, stepped, on another clock; repaired, counted."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlogs import clock

EPOCH_S = 1.7e9
PERIODS_S = (0.02, 0.1, 0.2, 0.5)
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def interleaved(duration_s: float = 30.0, start_s: float = 100.0) -> tuple[Floats, Ints]:
    """Four topics at their own rates in time order, as a logger writes them."""
    stamps = [start_s + np.arange(0, duration_s, p) + 1e-3 * k for k, p in enumerate(PERIODS_S)]
    owner = np.repeat(np.arange(len(PERIODS_S)), [s.size for s in stamps])
    order = np.argsort(np.concatenate(stamps), kind="stable")
    return np.concatenate(stamps)[order], owner[order]


def holds(got: clock.Repair, topic: Ints) -> None:
    """What every result promises."""
    kept = np.isfinite(got.time_s)
    assert np.all(got.time_s[kept] >= 0)
    assert 0 <= int((~kept).sum()) - got.strays <= np.unique(topic).size
    for k in np.unique(topic):
        assert np.all(np.diff(got.time_s[kept & (topic == k)]) > 0)


def test_good_stamps_are_only_shifted_to_zero() -> None:
    stamp, topic = interleaved()
    got = clock.repair(stamp, topic)
    np.testing.assert_allclose(got.time_s, stamp - stamp.min(), atol=1e-9)
    assert got.warnings() == ()
    assert not got.held.any()


@settings(max_examples=60, deadline=None)
@given(
    damage=st.lists(st.tuples(st.integers(0, 2000), st.floats(0, 2e9, allow_nan=False)), max_size=6)
)
def test_damaged_stamps_cost_themselves_only(damage: list[tuple[int, float]]) -> None:
    stamp, topic = interleaved()
    bad = stamp.copy()
    for place, value in damage:
        bad[place % stamp.size] = value
    got = clock.repair(bad, topic)
    holds(got, topic)
    touched = np.isin(np.arange(stamp.size), [place % stamp.size for place, _ in damage])
    sound = np.isfinite(got.time_s) & ~touched & ~got.held
    shift = got.time_s[sound] - stamp[sound]
    assert np.ptp(shift) < 1e-6
    assert sound.sum() >= stamp.size - 20


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), scale=st.sampled_from([1e-3, 1.0, 1e3, 1e10]))
def test_noise_for_stamps_still_gives_a_clock(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    topic = rng.integers(0, 4, 200)
    holds(clock.repair(rng.uniform(0, scale, 200), topic), topic)


@settings(max_examples=20, deadline=None)
@given(offset_s=st.floats(-1e6, 1e9))
def test_the_zero_of_the_stamps_does_not_matter(offset_s: float) -> None:
    stamp, topic = interleaved()
    stamp[500] += 40.0
    a, b = clock.repair(stamp, topic), clock.repair(stamp + offset_s, topic)
    np.testing.assert_allclose(a.time_s, b.time_s, atol=1e-5)
    assert (a.strays, a.jumps) == (b.strays, b.jumps)


@pytest.mark.parametrize("back_s", [3.0, 68.9, 99.0])
def test_a_step_back_is_closed_up(back_s: float) -> None:
    stamp, topic = interleaved()
    stepped = np.where(np.arange(stamp.size) < 1000, stamp, stamp - back_s)
    got = clock.repair(stepped, topic)
    holds(got, topic)
    assert got.jumps == 1
    assert [w.code for w in got.warnings()][-1] == "clock_jumped"
    assert np.nanmax(got.time_s) == pytest.approx(30.0, abs=0.6)
    assert got.strays < 60  # what overlaps because the length of the pause is not known


def test_a_clock_set_to_the_epoch_is_closed_up() -> None:
    stamp, topic = interleaved()
    got = clock.repair(np.where(np.arange(stamp.size) < 1000, stamp, stamp + EPOCH_S), topic)
    holds(got, topic)
    assert got.jumps == 1
    assert np.nanmax(got.time_s) == pytest.approx(30.0, abs=0.6)


def test_a_topic_on_the_epoch_is_put_beside_the_others() -> None:
    stamp, topic = interleaved()
    got = clock.repair(np.where(topic == 2, stamp + EPOCH_S, stamp), topic)
    holds(got, topic)
    assert got.shifted_topics == 1
    mine = (topic == 2) & np.isfinite(got.time_s)
    assert mine.sum() >= 149
    np.testing.assert_allclose(got.time_s[mine], stamp[mine] - 100.0, atol=0.1)


def test_a_value_from_before_the_log_stands_at_zero_and_is_marked() -> None:
    stamp, topic = interleaved()
    stamp, topic = np.concatenate([[3.0], stamp]), np.concatenate([[9], topic])
    got = clock.repair(stamp, topic)
    assert got.held.tolist() == [True] + [False] * (stamp.size - 1)
    assert got.time_s[:2].tolist() == [0.0, 0.0]
    assert got.warnings() == ()


def test_topic_after_topic_in_the_file_is_no_step_of_the_clock() -> None:
    stamp, topic = interleaved()
    order = np.argsort(topic, kind="stable")
    got = clock.repair(stamp[order], topic[order])
    np.testing.assert_allclose(got.time_s, stamp[order] - 100.0, atol=1e-9)
    assert got.warnings() == ()


def test_a_single_stamp_far_ahead_is_left_out() -> None:
    stamp, topic = interleaved()
    got = clock.repair(np.append(stamp, 1194.0), np.append(topic, 3))
    assert got.strays == 1
    assert np.isnan(got.time_s[-1])


def test_many_stamps_years_ahead_are_left_out() -> None:
    stamp, topic = interleaved()
    places = np.arange(7, stamp.size, 97)
    bad = stamp.copy()
    bad[places] = EPOCH_S + 1e6 * np.arange(places.size)
    got = clock.repair(bad, topic)
    holds(got, topic)
    assert got.strays == places.size
    assert np.nanmax(got.time_s) == pytest.approx(30.0, abs=0.5)


def test_a_long_pause_between_two_flights_stays() -> None:
    stamp, topic = interleaved()
    got = clock.repair(np.where(stamp > 115, stamp + 363, stamp), topic)
    assert got.warnings() == ()
    assert np.nanmax(got.time_s) == pytest.approx(393, abs=0.5)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_hardly_any_record_is_no_problem(n: int) -> None:
    got = clock.repair(np.arange(n, dtype=float), np.zeros(n, dtype=np.int64))
    assert got.time_s.tolist() == list(range(n))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 30), max_size=25))
def test_the_longest_increase_is_one_and_none_is_longer(values: list[int]) -> None:
    got = clock.longest_increase([float(v) for v in values])
    chosen = [values[i] for i in got]
    assert got == sorted(set(got))
    assert all(a < b for a, b in pairwise(chosen))
    best = [1] * len(values)  # by the obvious quadratic rule
    for i in range(len(values)):
        best[i] = 1 + max((best[j] for j in range(i) if values[j] < values[i]), default=0)
    assert len(got) == max(best, default=0)
