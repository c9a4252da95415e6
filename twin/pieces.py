"""A load cut into pieces, each a length of time over which the current runs straight."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from twin.load import Between, Load

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """A load of one cell, cut for the kernel.

    Attributes:
        start_A: (m,) current at the start of each piece.
        stop_A: (m,) at its end.
        length_s: (m,) 0 where the current jumps.
        sample: (m,) the load's sample at whose time the piece ends, or that it leads to.
    """

    start_A: FloatArray
    stop_A: FloatArray
    length_s: FloatArray
    sample: npt.NDArray[np.int64]


@lru_cache(maxsize=16)  # while a number of the cell is fitted, the same again and again
def cut_into_pieces(load: Load, divisor: float) -> Pieces:
    """`load` as pieces no longer than its `longest_step_s`, currents divided by `divisor`."""
    current = load.current_A / divisor
    dt = np.diff(load.time_s)
    parts = np.maximum(np.ceil(dt / load.longest_step_s - 1e-9), 1).astype(int)
    hold = load.between is Between.HOLD
    ends = current[:-1] if hold else current[1:]
    sample = np.repeat(np.arange(1, current.size), parts)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    nth = np.arange(sample.size) - first
    before, after = np.repeat(current[:-1], parts), np.repeat(ends, parts)
    share = np.repeat(1.0 / parts, parts)
    start = before + (after - before) * (nth * share)
    stop = before + (after - before) * ((nth + 1) * share)
    length = np.repeat(dt / parts, parts)
    jump_at = np.flatnonzero(np.diff(current)) + 1 if hold else np.array([], dtype=int)
    where = np.searchsorted(sample, jump_at, side="right")
    start = np.insert(start, where, current[jump_at - 1])
    stop = np.insert(stop, where, current[jump_at])
    length = np.insert(length, where, 0.0)
    sample = np.insert(sample, where, jump_at)
    return Pieces(
        np.concatenate([[0.0], start]),
        np.concatenate([[current[0]], stop]),
        np.concatenate([[0.0], length]),
        np.concatenate([[0], sample]),
    )


def sample_ends(pieces: Pieces, done: int) -> npt.NDArray[np.int64]:
    """(n,) piece that answers each sample, where all its pieces are among the first `done`."""
    sample = pieces.sample[:done]
    whole = sample < pieces.sample[done] if done < pieces.sample.size else sample >= 0
    return np.flatnonzero(np.diff(sample[whole], append=-1))
