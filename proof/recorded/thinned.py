"""Recordings as they are given: up to where a flight ends, and with fewer samples.

Fewer, since a verdict simulates each of them thousands of times.
"""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from proof.recorded.measured import RealTest

FloatArray = npt.NDArray[np.float64]

FLOWS = 0.5  # of the largest current: the discharge has begun
JUMP_A = 0.5
RAW_S, MIXED_S = 3.0, 0.25  # after a jump


def until(test: RealTest, share: float) -> RealTest:
    """Up to that share of the charge that it drew in all."""
    return test.part(slice(0, int(np.searchsorted(test.drawn_C, share * test.drawn_C[-1])) + 1))


def every(test: RealTest, step_s: float) -> RealTest:
    """A steady discharge from its first sample under load, samples about `step_s` apart.

    Those of the first minute are kept: there the voltage bends most.
    """
    start = int(np.argmax(test.current_A > FLOWS * test.current_A.max()))
    time_s = test.time_s[start:] - test.time_s[start]
    size = max(1, round(step_s / float(np.median(np.diff(time_s)))))
    early = int(np.searchsorted(time_s, 60.0)) if size > 1 else 0
    rows = np.union1d(np.arange(0, early, max(size // 2, 1)), np.arange(early, time_s.size, size))
    return _chosen(test, start + rows)


def spaced(test: RealTest, step_s: float) -> RealTest:
    """Samples at least `step_s` apart; the last before a jump of the current, all of RAW_S after.

    The first of those, of MIXED_S, have no voltage: it is neither that of before nor of after,
    where a logger filters or reads in the middle of a jump.
    """
    jumps = np.abs(np.diff(test.current_A)) > JUMP_A
    before = np.append(jumps, False)
    kept = before | np.insert(jumps, 0, False)
    at_s = np.append(-np.inf, test.time_s[before])
    since_s = test.time_s - at_s[np.searchsorted(at_s, test.time_s) - 1]  # the last jump before
    kept |= since_s < RAW_S
    last = 0
    kept[[0, -1]] = True
    for k, t in enumerate(test.time_s.tolist()):
        kept[k] |= t - test.time_s[last] >= step_s
        last = k if kept[k] else last
    voltage_V = np.where(since_s < MIXED_S, np.nan, test.voltage_V)
    return _chosen(replace(test, voltage_V=voltage_V), np.flatnonzero(kept))


def binned(test: RealTest, step_s: float) -> RealTest:
    """Means over spans of about `step_s`, of the current as of the voltage; the charge stays."""
    size = max(1, round(step_s / float(np.median(np.diff(test.time_s)))))
    whole = test.time_s.size // size * size

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(values[:whole].reshape(-1, size).mean(axis=1), dtype=float)

    time_s = mean(test.time_s)
    return replace(
        test,
        time_s=time_s - time_s[0],
        current_A=mean(test.current_A),
        voltage_V=mean(test.voltage_V),
        temperature_K=None if test.temperature_K is None else mean(test.temperature_K),
    )


def _chosen(test: RealTest, rows: npt.NDArray[np.int64]) -> RealTest:
    temperature_K = None if test.temperature_K is None else test.temperature_K[rows]
    return replace(
        test,
        time_s=test.time_s[rows] - test.time_s[rows[0]],
        current_A=test.current_A[rows],
        voltage_V=test.voltage_V[rows],
        temperature_K=temperature_K,
    )
