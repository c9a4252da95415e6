"""What a residual may follow."""

import numpy as np
import pytest

from twin.mismatch.quantities import remembered


def test_a_memory_does_not_depend_on_where_the_samples_lie() -> None:
    """A current that begins after 10 s, sampled evenly and ever further apart."""
    even_s = np.arange(0.0, 200.0, 1.0)
    uneven_s = np.append(np.arange(0.0, 20.0), np.arange(20.0, 200.0, 15.0))
    even, uneven = (remembered(t, (t > 10.0) * 5.0, 30.0) for t in (even_s, uneven_s))
    assert uneven == pytest.approx(even[np.isin(even_s, uneven_s)], rel=1e-9)
    assert even[-1] == pytest.approx(5.0 * (1.0 - np.exp(-189.0 / 30.0)), rel=1e-9)
