"""How many samples tell as much as one."""

import numpy as np
import pytest

from twin.correlation import correlation_time


def test_samples_of_white_noise_tell_each_their_own() -> None:
    assert correlation_time(np.random.default_rng(0).standard_normal(20_000)) < 1.1


def test_a_first_order_process_has_that_of_the_closed_form() -> None:
    """(1 + a) / (1 - a) exactly."""
    a, x = 0.8, np.zeros(200_000)
    steps = np.random.default_rng(3).standard_normal(x.size)
    for k in range(1, x.size):
        x[k] = a * x[k - 1] + steps[k]
    assert correlation_time(x) == pytest.approx((1 + a) / (1 - a), rel=0.1)


def test_what_is_off_all_along_says_the_same_in_every_sample() -> None:
    assert correlation_time(np.ones(1000)) > 250
    assert correlation_time(np.zeros(1000)) == correlation_time(np.zeros(0)) == 1.0
