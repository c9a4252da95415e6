"""`Waveform`: a current that repeats without a seam, and the load it makes."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from twin.load import Load

FloatArray = npt.NDArray[np.float64]


class WaveformError(ValueError):
    """A waveform that cannot be repeated; the text says why."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Waveform:
    """One period; sample 0 follows the last, and the current runs straight between them.

    Attributes:
        current_A: (n,) of the pack, discharge positive.
        sample_s: from sample to sample.
    """

    current_A: FloatArray
    sample_s: float

    def __post_init__(self) -> None:
        if self.current_A.ndim != 1 or not self.current_A.size:
            raise WaveformError(f"current_A {self.current_A.shape}: expected samples in a row")
        if not np.isfinite(self.current_A).all() or not self.sample_s > 0:
            raise WaveformError("expected finite currents and sample_s above 0")
        if self.mean_A <= 0:
            raise WaveformError(f"mean current {self.mean_A:.3g} A: a flight discharges the pack")

    @property
    def period_s(self) -> float:
        """Length."""
        return self.sample_s * self.current_A.size

    @cached_property
    def mean_A(self) -> float:
        """Over time: every sample stands for as long as another."""
        return float(self.current_A.mean())

    def load(self, charge_C: float, ambient_K: float) -> Load:
        """Repeated until `charge_C` is drawn."""
        periods = int(np.ceil(charge_C / (self.mean_A * self.period_s)))
        current = np.append(np.tile(self.current_A, periods), self.current_A[0])
        times = np.asarray(self.sample_s * np.arange(current.size), dtype=float)
        return Load(time_s=times, current_A=current, ambient_K=ambient_K)

    def drawing(self, charge_C: float, ambient_K: float) -> Load:
        """Repeated, and ended where `charge_C` is drawn (the last sample's step taken as even)."""
        whole = self.load(charge_C, ambient_K)
        t, i = whole.time_s, whole.current_A
        drawn_C = np.insert(np.cumsum(np.diff(t) * (i[:-1] + i[1:]) / 2), 0, 0.0)
        last = int(np.argmax(drawn_C >= charge_C * (1 - 1e-12)))
        share = (charge_C - drawn_C[last - 1]) / (drawn_C[last] - drawn_C[last - 1])
        end = (
            np.array([t[last - 1], i[last - 1]]) * (1 - share)
            + np.array([t[last], i[last]]) * share
        )
        return replace(
            whole, time_s=np.append(t[:last], end[0]), current_A=np.append(i[:last], end[1])
        )


def limited(current_A: FloatArray, most_A: float, weights: FloatArray | None = None) -> FloatArray:
    """(n,) without currents above `most_A`; what is cut off at the top is flown below it.

    The charge stays what it was: samples below the limit are raised by a common share of their
    distance from it. `weights` (n,) are how long each sample lasts; None: all as long.

    Raises:
        WaveformError: the limit is not above the mean.
    """
    mean_A = float(np.average(current_A, weights=weights))
    if not most_A > mean_A:
        raise WaveformError(
            f"no current above {most_A:g} A is less than the mean, {mean_A:.2f} A, asks for"
        )
    room = np.maximum(most_A - current_A, 0.0)
    share = (most_A - mean_A) / float(np.average(room, weights=weights))
    return np.asarray(most_A - share * room)


def constant(current_A: float, sample_s: float) -> Waveform:
    """A current that does not change."""
    return Waveform(current_A=np.full(1, current_A), sample_s=sample_s)
