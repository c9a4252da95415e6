"""What a run may still be expected to reach, from the levels it has come to slice by slice.

`levels` are those of its first batch and after each slice. Gains are those of the last quarter of
the slices and of the quarter before: one slice without luck does not decide over a long run.
"""

from collections.abc import Sequence
from math import inf


def expected(levels: Sequence[float], again: float) -> float:
    """Level after `again` times as many slices, if it goes on falling along a straight line.

    For a run that converges an optimistic guess, which its next slices correct; how far the line is
    believed depends on how long the run has been watched. Without a slice everything is possible.
    """
    slices = len(levels) - 1
    if slices < 1:
        return -inf
    window = max(1, slices // 4)
    return levels[-1] - again * slices * (levels[-1 - window] - levels[-1]) / window


def remaining(levels: Sequence[float]) -> float:
    """Fall still to come, if its gains go on as a geometric series (Aitken's extrapolation).

    Infinite while they do not shrink, and before there are two of them.
    """
    window = max(1, (len(levels) - 1) // 4)
    if len(levels) <= 2 * window:
        return inf
    gain = levels[-1 - window] - levels[-1]
    before = levels[-1 - 2 * window] - levels[-1 - window]
    if gain == 0.0:
        return 0.0
    return gain**2 / (before - gain) if before > gain else inf
