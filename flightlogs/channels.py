"""Rows of a file -> `Channel`, values held from one clock to another, modes in force."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from flightlogs.log import Channel, FloatArray, ModeSpan
from flightlogs.stamps import increasing

FRESH_S = 0.5  # controllers log at 10 Hz while they are active: an older row is not in force


def channel(time_s: FloatArray, values: FloatArray, source: str) -> Channel | None:
    """The rows whose time advances as a channel; None if there is no known value among them."""
    kept = increasing(time_s)
    if not kept.any() or not np.isfinite(values[kept]).any():
        return None
    known = np.where(np.isfinite(values[kept]), values[kept], np.nan)
    return Channel(time_s=time_s[kept], values=known, source=source)


def held(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """The last value in force at each of `at_s`; NaN before the first and when it is stale."""
    known = np.isfinite(time_s)
    if not known.any():
        return np.full(at_s.shape, np.nan)
    t, v = time_s[known], values[known]
    order = np.argsort(t, kind="stable")
    last = np.searchsorted(t[order], at_s, side="right") - 1
    age_s = at_s - t[order][np.maximum(last, 0)]
    return np.where((last >= 0) & (age_s <= FRESH_S), v[order][np.maximum(last, 0)], np.nan)


def above_start(height_m: Channel | None) -> Channel | None:
    """The same heights, counted from the first known one."""
    if height_m is None:
        return None
    start = height_m.values[np.isfinite(height_m.values)][0]
    return replace(height_m, values=height_m.values - start)


def during(
    time_s: FloatArray, modes: Sequence[ModeSpan], names: frozenset[str]
) -> npt.NDArray[np.bool_]:
    """(n,) True where the mode in force is one of `names`."""
    starts = np.array([mode.start_s for mode in modes])
    chosen = np.array([False, *(mode.name in names for mode in modes)])
    return chosen[np.searchsorted(starts, time_s, side="right")]
