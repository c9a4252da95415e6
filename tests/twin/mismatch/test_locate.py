"""Where twin and recording differ."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.twin.mismatch.recordings import flown
from twin.mismatch.locate import change_points, spans
from twin.mismatch.noise import Noise
from twin.mismatch.wander import Wander


def test_change_points_of_levels() -> None:
    means = np.concatenate([np.zeros(30), np.full(20, 1.0), np.zeros(10)])
    noisy = means + 0.1 * np.random.default_rng(0).standard_normal(60)
    assert change_points(noisy, np.full(60, 100.0), 12.0) == [0, 30, 50, 60]
    assert change_points(np.zeros(60), np.full(60, 100.0), 12.0) == [0, 60]


@pytest.mark.parametrize("off_V", [0.0, 0.03])
def test_no_span_is_found_in_noise_that_was_filtered_and_one_beyond_it_is(off_V: float) -> None:
    flight = flown(seed=1)
    keep, n = np.exp(-0.1 / 0.5), flight.time_s.size
    random = np.random.default_rng(4)
    smooth_V = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], random.normal(0.0, 0.01, n))
    residual_V = smooth_V + random.normal(0.0, 3e-3, n)
    residual_V[400:600] += off_V
    smooth = Wander(size_V=0.01, forgets_s=0.5)
    found = spans(flight, residual_V, Noise(white_V=3e-3, slow_V=0.0, slow_s=1.0, smooth=smooth))
    assert len(found) == bool(off_V)
    for span in found:
        assert span.start_s == pytest.approx(40.0, abs=2.0)
        assert span.stop_s == pytest.approx(60.0, abs=2.0)
