"""Arithmetic on masks and samples in time; plain arrays in, plain arrays out."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]


def runs(mask: npt.ArrayLike) -> list[tuple[int, int]]:
    """Half-open index ranges [a, b) in which `mask` (n,) is true, in order."""
    padded = np.concatenate([[False], np.asarray(mask, dtype=bool), [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def constant_runs(values: npt.ArrayLike) -> list[tuple[int, int]]:
    """Half-open index ranges that split (n,) integer `values` wherever the value changes."""
    v = np.asarray(values)
    if v.size == 0:
        return []
    edges = np.concatenate([[0], np.flatnonzero(v[1:] != v[:-1]) + 1, [v.size]])
    return [(int(a), int(b)) for a, b in pairwise(edges)]


def span_s(time_s: FloatArray, a: int, b: int) -> float:
    """Time that samples [a, b) stand for: up to the next sample, or to the last one there is."""
    return float(time_s[min(b, time_s.size - 1)] - time_s[a])


def fill_short(time_s: FloatArray, mask: BoolArray, shortest_s: float) -> BoolArray:
    """`mask` with false stretches between two true ones filled if shorter than `shortest_s`."""
    out = mask.copy()
    for a, b in runs(~mask):
        if a > 0 and b < mask.size and span_s(time_s, a, b) < shortest_s:
            out[a:b] = True
    return out


def drop_short(time_s: FloatArray, mask: BoolArray, shortest_s: float) -> BoolArray:
    """`mask` without true stretches shorter than `shortest_s`."""
    out = mask.copy()
    for a, b in runs(mask):
        if span_s(time_s, a, b) < shortest_s:
            out[a:b] = False
    return out


def hysteresis(values: FloatArray, release: npt.ArrayLike, engage: npt.ArrayLike) -> BoolArray:
    """Where `values` exceeds `release` in a stretch that somewhere exceeds `engage`.

    Symmetric in time: a stretch starts where the value first leaves the release level, not where
    it reaches the engage level. NaN exceeds nothing.

    Args:
        values: (n,).
        release: () or (n,) lower threshold.
        engage: () or (n,) upper threshold.
    """
    above, strong = values > np.asarray(release), values > np.asarray(engage)
    out = np.zeros(values.shape, dtype=bool)
    for a, b in runs(above):
        out[a:b] = bool(strong[a:b].any())
    return out


def moving_average(time_s: FloatArray, values: FloatArray, window_s: float) -> FloatArray:
    """Mean of the samples within `window_s` / 2 of each sample (edges included); NaN not counted.

    No phase shift; NaN where the window holds no measured sample.

    Args:
        time_s: (n,) strictly increasing.
        values: (n,) or (n, k).
        window_s: full width; below the sampling period the samples come back unchanged.
    """
    half = window_s / 2 * (1 + 1e-9)  # samples spaced exactly half a window apart belong to it
    first = np.searchsorted(time_s, time_s - half, side="left")
    last = np.searchsorted(time_s, time_s + half, side="right")
    flat = values.reshape(values.shape[0], -1)
    known = np.isfinite(flat)
    total = _cumulative(np.where(known, flat, 0.0))
    count = _cumulative(known.astype(float))
    n = count[last] - count[first]
    mean = (total[last] - total[first]) / np.where(n > 0, n, 1.0)
    return np.where(n > 0, mean, np.nan).reshape(values.shape)


def _cumulative(rows: FloatArray) -> FloatArray:
    return np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])


def pieces(time_s: FloatArray, longest_gap_s: float) -> list[tuple[int, int]]:
    """Half-open index ranges without a step longer than `longest_gap_s`.

    Where the usual (median) step is itself long, three of them make a gap.
    """
    if time_s.size < 2:
        return [(0, time_s.size)] if time_s.size else []
    step = np.diff(time_s)
    gap = step > max(longest_gap_s, 3 * float(np.median(step)))
    edges = np.concatenate([[0], np.flatnonzero(gap) + 1, [time_s.size]])
    return [(int(a), int(b)) for a, b in pairwise(edges)]


def absorb_short(
    time_s: FloatArray, codes: IntArray, shortest_s: float, fixed: Sequence[int]
) -> IntArray:
    """Motion codes without stretches shorter than `shortest_s`, shortest first.

    A code is a set of bits, one an axis that moves. A short stretch goes to the neighbour that
    differs in fewer bits; at a tie to the one that moves (more bits), at a further tie each
    neighbour gets half of it. Codes in `fixed` neither give nor take; a stretch between two of
    them stays.
    """
    out = codes.copy()
    while True:
        short = [
            (span_s(time_s, a, b), a, b)
            for a, b in constant_runs(out)
            if out[a] not in fixed and span_s(time_s, a, b) < shortest_s
        ]
        for _, a, b in sorted(short):
            if _give_away(out, a, b, fixed):
                break
        else:
            return out


def _give_away(codes: IntArray, a: int, b: int, fixed: Sequence[int]) -> bool:
    """Give [a, b) to its neighbours in place; False if there is none that may take it."""
    own = int(codes[a])
    left = int(codes[a - 1]) if a > 0 else None
    right = int(codes[b]) if b < codes.size else None
    takers = [c for c in (left, right) if c is not None and c not in fixed]
    if not takers:
        return False
    rank = [((c ^ own).bit_count(), -c.bit_count()) for c in takers]
    if len(takers) == 2 and rank[0] == rank[1]:
        middle = (a + b) // 2
        codes[a:middle], codes[middle:b] = takers
    else:
        codes[a:b] = takers[int(rank.index(min(rank)))]
    return True
