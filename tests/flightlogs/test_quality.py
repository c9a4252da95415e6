"""Samples at which a current sensor shows less than flows."""

import numpy as np

from flightlogs.quality import unsaturated


def test_after_a_sensor_was_at_its_end_nothing_counts_for_a_while() -> None:
    t = np.arange(0.0, 60.0, 0.5)
    current_A = np.minimum(10.0 + 4.0 * np.sin(t) + 0.1 * np.cos(7.0 * t), 13.0)
    at_end = current_A == current_A.max()
    assert at_end.sum() > 3
    counts = unsaturated(t, current_A)
    assert not counts[at_end].any()
    last_s = t[at_end][-1]
    assert not counts[(t > last_s) & (t <= last_s + 5.0)].any()
    assert counts[t < t[at_end][0]].all()
    assert unsaturated(t, 10.0 + 4.0 * np.sin(t)).all()
