"""A recording as a load: no charge is lost, and gaps are owned up to."""

import numpy as np
import pytest

from analyze.pack_choice import cell_of
from analyze.replaying import gap_steps, gaps_of, judged_of, replay
from analyze.start import pack_use
from flightlogs.holes import holes
from flightlogs.log import Interval
from tests.reports import example
from twin.solution import Status

CELL, _ = cell_of("lipo_2200")


def thinned(keep: np.ndarray):
    full = example.recording()
    names = ("time_s", "current_A", "voltage_V", "velocity_m_s", "velocity_setpoint_m_s", "in_air")
    return example.recording(**{name: getattr(full, name)[keep] for name in names})


def test_a_whole_recording_has_no_gaps() -> None:
    assert gaps_of(example.recording()).count == 0


def test_a_gap_is_counted_with_the_charge_that_bridges_it() -> None:
    keep = np.ones(example.T.size, dtype=bool)
    keep[101:116] = False  # 20.0 s to 23.2 s
    gaps = gaps_of(thinned(keep))
    i = example.CURRENT
    assert (gaps.count, gaps.total_s, gaps.longest_s) == pytest.approx((1, 3.2, 3.2))
    assert gaps.charge_C == pytest.approx(3.2 * (i[100] + i[116]) / 2)


def test_a_slow_logger_has_no_gaps_for_being_slow() -> None:
    assert not gap_steps(np.arange(0.0, 60.0, 2.0)).any()


def test_a_few_late_samples_are_no_gap() -> None:
    t = example.T.copy()
    t[50] += 0.15
    assert not gap_steps(np.delete(t, [80])).any()


@pytest.mark.parametrize(("step_s", "lost"), [(0.1, 8), (2.0, 3)])
def test_gaps_are_those_that_the_warning_counts(step_s: float, lost: int) -> None:
    time_s = step_s * np.arange(300)
    kept = time_s[np.arange(300) % 20 >= lost]
    flight = Interval(float(kept[0]), float(kept[-1]))
    assert gap_steps(kept).sum() == len(holes(kept, flight)) == 14


def test_the_replay_draws_the_recorded_charge_and_is_judged_in_flight() -> None:
    recording = example.recording()
    use = pack_use(recording, None, CELL, builtin=True)
    played = replay(recording, use, CELL)
    assert played.solution.status is Status.DONE
    drawn_C = played.load.charge_C()
    assert drawn_C == pytest.approx(sum(s.load.charge_C for s in example.segments()), rel=0.01)
    assert abs(played.solution.audit.charge_error_C) < 1e-9 * drawn_C
    assert played.judged.sum() == np.sum((example.T >= 10.0) & (example.T <= 56.0))
    np.testing.assert_array_equal(played.solution.time_s, recording.time_s)


def test_a_sample_without_a_voltage_is_not_judged() -> None:
    full = example.recording()
    seen = np.arange(example.T.size) % 2 == 0
    sparse = example.recording(voltage_V=np.where(seen, full.voltage_V, np.nan))
    np.testing.assert_array_equal(judged_of(sparse), judged_of(full) & seen)
