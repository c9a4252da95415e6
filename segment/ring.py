"""Stitching stretches of a current into a ring: no cross-fade, every sample was recorded."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from segment.runs import FloatArray

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ring:
    """Samples in a circle: the first follows the last.

    Attributes:
        current_A: (n,).
        joints: indices of samples that did not follow the one before them in the recording.
    """

    current_A: FloatArray
    joints: IntArray


def uniform(time_s: FloatArray, values: FloatArray, period_s: float) -> FloatArray:
    """(m,) samples every `period_s`, each the recorded one nearest in time, unchanged."""
    n = int(np.floor((time_s[-1] - time_s[0]) / period_s + 0.5)) + 1
    at = time_s[0] + np.arange(n) * period_s
    right = np.clip(np.searchsorted(time_s, at), 1, time_s.size - 1)
    nearer = at - time_s[right - 1] <= time_s[right] - at
    return np.asarray(values[np.where(nearer, right - 1, right)])


def stitch(parts: Sequence[FloatArray], trim: int) -> Ring:
    """Parts in order, last to first again, cut where level and slope match best.

    At each joint up to `trim` samples (at most a quarter of the part) are left out on either side.
    """
    head = [0] * len(parts)
    tail = [p.size for p in parts]
    for k, part in enumerate(parts):
        after = (k + 1) % len(parts)
        tail[k], head[after] = _best_joint(part, parts[after], trim)
    kept = [p[a:b] for p, a, b in zip(parts, head, tail, strict=True)]
    joints = np.cumsum([0] + [p.size for p in kept[:-1]])
    return Ring(current_A=np.concatenate(kept), joints=joints.astype(np.int64))


def _best_joint(before: FloatArray, after: FloatArray, trim: int) -> tuple[int, int]:
    """(stop, start): `before[:stop]` is best followed by `after[start:]`.

    What would have come next, `before[stop]`, is to be like `after[start]`, and `before[stop - 1]`
    like `after[start - 1]`: level and slope at once.
    """
    u = min(trim, before.size // 4)
    v = min(trim, after.size // 4)
    if u < 1 or v < 2:
        return before.size, 0
    stops = np.arange(before.size - u, before.size)
    starts = np.arange(1, v)
    cost = np.abs(before[stops][:, None] - after[starts][None, :])
    cost = cost + np.abs(before[stops - 1][:, None] - after[starts - 1][None, :])
    i, j = np.unravel_index(int(np.argmin(cost)), cost.shape)
    return int(stops[i]), int(starts[j])


def window(ring: Ring, start: int, n: int) -> tuple[FloatArray, float]:
    """(n,) samples from `start` on around the ring, and the largest jump at a seam or joint."""
    size = ring.current_A.size
    wave = np.take(ring.current_A, np.arange(start, start + n), mode="wrap")
    inner = (ring.joints - start) % size
    inner = inner[(inner > 0) & (inner < n)]
    jumps = np.abs(wave[inner] - wave[inner - 1])
    seam = abs(float(wave[0] - wave[-1])) if n < size or 0 in (ring.joints - start) % size else 0.0
    return wave, float(max([seam, *jumps.tolist()]))


def seam_costs(ring: Ring, lengths: IntArray, starts: IntArray) -> FloatArray:
    """(lengths, starts) mismatch of level and slope if the ring is cut to that window."""
    x = ring.current_A
    after = (starts[None, :] + lengths[:, None]) % x.size
    return np.asarray(np.abs(x[after] - x[starts]) + np.abs(x[after - 1] - x[starts - 1]))


def window_means(values: FloatArray, lengths: IntArray, starts: IntArray) -> FloatArray:
    """(lengths, starts) mean of that window around the ring, no longer than the ring."""
    total = np.concatenate([[0.0], np.cumsum(np.concatenate([values, values]))])
    ends = starts[None, :] + lengths[:, None]
    return np.asarray((total[ends] - total[starts]) / lengths[:, None])
