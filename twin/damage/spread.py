"""How uncertain a motion's damage is, since no two of its segments are alike.

To first order damage follows two numbers of the current: its mean M, with the slope that constant
currents show, and its swing (mean square / M**2 - 1), which is 0 for a constant current and makes
all of the excess over it. So every segment has an influence on the damage of the whole, by how far
its mean and its mean square lie from the motion's; the spread of the influences over the segments
is the error of their mean. What the waveform misses of the segments' mean and mean square counts
likewise. Source: the influence function of a smooth function of means (Hampel, J. Am. Stat. Assoc.
69, 383 (1974), doi:10.1080/01621459.1974.10482962).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.damage.waveform import Waveform

LEAST_SWING = 1e-6  # a steadier current is constant: nothing of its excess is its swing's


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A segment of a motion.

    Attributes:
        duration_s: of it.
        mean_A: over time.
        rms_A: likewise.
    """

    duration_s: float
    mean_A: float
    rms_A: float


def relative_std(
    waveform: Waveform,
    pieces: Sequence[Piece],
    off_A: tuple[float, float],
    slope: float,
    excess: float,
) -> float:
    """Of damage, over the damage of a constant current at the same mean.

    Args:
        waveform: of the motion.
        pieces: its segments; with fewer than two nothing is known of their spread: NaN.
        off_A: mean and root mean square of the waveform less those of the segments.
        slope: d ln damage / d ln current of constant currents; 0 for what is compared at one mean.
        excess: damage over that of a constant current at the same mean, less 1.
    """
    if len(pieces) < 2:
        return float("nan")
    weight = np.array([p.duration_s for p in pieces])
    weight /= weight.sum()
    mean = np.array([p.mean_A for p in pieces])
    square = np.array([p.rms_A**2 for p in pieces])
    away = _influence(waveform, mean - weight @ mean, square - weight @ square, slope, excess)
    uneven = float(weight @ weight)  # 1 / n for segments that last equally long
    spread = float(weight**2 @ away**2) / (1 - uneven)
    rms_A = float(np.sqrt(waveform.square_A2))
    missed = _influence(waveform, np.array(off_A[0]), np.array(2 * rms_A * off_A[1]), slope, excess)
    return float(np.sqrt(spread + float(missed) ** 2))


def _influence(
    waveform: Waveform, mean_A: np.ndarray, square_A2: np.ndarray, slope: float, excess: float
) -> np.ndarray:
    """Relative change of damage with the mean and the mean square."""
    own_A = waveform.mean_A
    swing = square_A2 / own_A**2 - 2 * waveform.square_A2 * mean_A / own_A**3
    per_swing = excess / waveform.swing if waveform.swing > LEAST_SWING else 0.0
    return np.asarray(slope * mean_A / own_A + per_swing * swing)
