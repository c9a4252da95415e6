"""Channels on other times: straight between samples that are close enough, NaN elsewhere."""

import numpy as np
import numpy.typing as npt

from flightlogs.log import FloatArray, Interval

BRIDGED_S = 0.5  # voltage and velocity follow a manoeuvre within half a second
BRIDGED_PERIODS = 2.5  # a slow channel is bridged across one lost sample
NEVER_BRIDGED_S = 3.0  # whatever the rate: a motion begins and ends in less


def bridged_s(time_s: FloatArray) -> float:
    """Longest step of these (n,) sample times across which a straight line is drawn."""
    if time_s.size < 2:
        return 0.0
    usual = float(np.median(np.diff(time_s)))
    return min(max(BRIDGED_S, BRIDGED_PERIODS * usual), NEVER_BRIDGED_S)


def resample(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """Values of a channel at other times.

    Args:
        time_s: (n,) strictly increasing.
        values: (n,) or (n, k); what is NaN stays unknown up to the neighbouring samples.
        at_s: (m,).

    Returns:
        (m,) or (m, k); NaN before, after and across steps longer than `bridged_s`.
    """
    if values.ndim > 1:
        return np.column_stack([resample(time_s, column, at_s) for column in values.T])
    if not time_s.size:
        return np.full(at_s.shape, np.nan)
    out = np.interp(at_s, time_s, values, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(time_s, at_s), 1, max(time_s.size - 1, 1))
    if time_s.size > 1:
        step = time_s[after] - time_s[after - 1]
        on_sample = (at_s == time_s[after]) | (at_s == time_s[after - 1])
        out[(step > bridged_s(time_s)) & ~on_sample] = np.nan
    return out


def straight(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """(n,) with what is NaN straight between the finite ones beside it, if these are close."""
    known = np.isfinite(values)
    return resample(time_s[known], values[known], time_s)


def nearest(time_s: FloatArray, at_s: FloatArray) -> npt.NDArray[np.bool_]:
    """(m,) True for those of the times `at_s` that are the nearest to one of `time_s` (n,)."""
    out = np.zeros(at_s.shape, dtype=bool)
    if at_s.size:
        after = np.clip(np.searchsorted(at_s, time_s), 1, max(at_s.size - 1, 1))
        late = at_s[np.minimum(after, at_s.size - 1)] - time_s < time_s - at_s[after - 1]
        out[np.minimum(after - 1 + late, at_s.size - 1)] = True
    return out


def within(at_s: FloatArray, spans: tuple[Interval, ...]) -> npt.NDArray[np.bool_]:
    """(m,) True inside any of the half-open spans."""
    inside = np.zeros(at_s.shape, dtype=bool)
    for span in spans:
        inside |= (at_s >= span.start_s) & (at_s < span.stop_s)
    return inside


def charge_C(time_s: FloatArray, current_A: FloatArray) -> float:
    """Integral of a current, straight between all samples, gaps included."""
    return float(np.trapezoid(current_A, time_s)) if time_s.size > 1 else 0.0
