"""How uncertain a motion's damage is, since no two of its segments are alike.

Each segment is flown by itself, from full to the cut-off, as the motion's waveform is: how their
ratios differ tells by how much that of the motion would, had other segments been flown. Their mean
current and its mean square do not tell it: where one reaction gains by peaks what another loses,
the sum hardly follows them, and yet the sum differs from segment to segment.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.damage.error import UNKNOWN_ERROR, Error, together
from twin.damage.waveform import Waveform, WaveformError

FloatArray = npt.NDArray[np.float64]

MOST = 6  # groups of segments: each is flown by itself
NUMERICAL = 1e-3  # of a ratio, standard deviation: what the steps of a charge leave of it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A segment of a motion.

    Attributes:
        current_A: (n,) every sample stands for as long as another.
        sample_s: from sample to sample.
    """

    current_A: FloatArray
    sample_s: float


def grouped(pieces: Sequence[Piece]) -> tuple[Waveform, ...]:
    """One waveform a segment; of more than MOST segments, several one after the other.

    Segments that draw nothing are left out.
    """
    sums = [pieces[k::MOST] for k in range(min(MOST, len(pieces)))]
    out = []
    for group in sums:
        current_A = np.concatenate([p.current_A for p in group])
        try:
            out.append(Waveform(current_A=current_A, sample_s=group[0].sample_s))
        except WaveformError:
            continue
    return tuple(out)


def error_of(value: float, groups: Sequence[float], seconds: Sequence[float]) -> Error:
    """Of the `value` of a motion's waveform, by those of its `groups`, which last `seconds`.

    The spread of the groups, and by how much the waveform differs from their mean. With fewer than
    two groups nothing is known.
    """
    if len(groups) < 2:
        return UNKNOWN_ERROR
    weight, of = np.array(seconds) / sum(seconds), np.array(groups)
    mean = float(weight @ of)
    uneven = float(weight @ weight)  # 1 / n for groups that last equally long
    spread = np.sqrt(weight**2 @ (of - mean) ** 2 / (1 - uneven))
    return together(
        Error(std=float(spread), freedom=1 / uneven - 1),
        Error(std=abs(value - mean)),
        Error(std=NUMERICAL * abs(value)),
    )
