"""Switching events and levels -> spans on the log's clock."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from flightlogs.log import FloatArray, Interval, ModeSpan

IN_AIR_THROTTLE = 0.15  # below it no multirotor hovers; idle after arming is about 0.1
DIP_S = 3.0  # a fast descent may idle this long
BURST_S = 2.0  # a spin-up test is shorter than a flight


def spans_of(time_s: FloatArray, on: npt.NDArray[np.bool_], end_s: float) -> tuple[Interval, ...]:
    """Spans in which a state held.

    Args:
        time_s: (n,) when the state was logged, not decreasing.
        on: (n,) the state from then until the next entry.
        end_s: where the last state ends.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(int)))
    times = np.append(time_s, max(end_s, time_s[-1]) if time_s.size else end_s)
    pairs = zip(times[edges[::2]], times[edges[1::2]], strict=True)
    return tuple(Interval(float(a), float(b)) for a, b in pairs if b > a)


def switched(
    time_s: FloatArray, on: npt.NDArray[np.bool_], *, start_s: float, end_s: float
) -> tuple[Interval, ...]:
    """Spans from switching events; before the first event the state was the opposite of it."""
    if not time_s.size:
        return ()
    states = np.concatenate([[not on[0]], on])
    return spans_of(np.concatenate([[start_s], time_s]), states, end_s)


def overlap(spans: Sequence[Interval], within: Sequence[Interval]) -> tuple[Interval, ...]:
    """The parts of `spans` that lie inside `within`."""
    cut = [
        Interval(max(a.start_s, b.start_s), min(a.stop_s, b.stop_s)) for a in spans for b in within
    ]
    return tuple(s for s in cut if s.duration_s > 0)


def mode_spans(time_s: FloatArray, names: Sequence[str], end_s: float) -> tuple[ModeSpan, ...]:
    """Modes from the times at which each was reported; repeats are joined."""
    starts = [i for i in range(len(names)) if i == 0 or names[i] != names[i - 1]]
    stops = [float(time_s[i]) for i in starts[1:]] + [end_s]
    spans = zip((float(time_s[i]) for i in starts), stops, (names[i] for i in starts), strict=True)
    return tuple(ModeSpan(a, b, name) for a, b, name in spans if b > a)


def flying_by_throttle(
    time_s: FloatArray, throttle: FloatArray, threshold: float, end_s: float
) -> tuple[Interval, ...]:
    """Spans with more throttle than any landed multirotor needs; short dips and bursts ignored."""
    known = np.isfinite(throttle)
    return without_dips(spans_of(time_s[known], throttle[known] > threshold, end_s))


def without_dips(spans: Sequence[Interval]) -> tuple[Interval, ...]:
    """Spans in time order, joined across short dips; what is then a short burst is left out."""
    joined: list[Interval] = []
    for span in spans:
        if joined and span.start_s - joined[-1].stop_s < DIP_S:
            joined[-1] = Interval(joined[-1].start_s, span.stop_s)
        else:
            joined.append(span)
    return tuple(s for s in joined if s.duration_s >= BURST_S)
