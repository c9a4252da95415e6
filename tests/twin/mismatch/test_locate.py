"""Where twin and recording differ."""

import numpy as np

from twin.mismatch.locate import change_points


def test_change_points_of_levels() -> None:
    means = np.concatenate([np.zeros(30), np.full(20, 1.0), np.zeros(10)])
    noisy = means + 0.1 * np.random.default_rng(0).standard_normal(60)
    assert change_points(noisy, np.full(60, 100.0), 12.0) == [0, 30, 50, 60]
    assert change_points(np.zeros(60), np.full(60, 100.0), 12.0) == [0, 60]
