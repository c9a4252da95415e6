"""`PeriodicProfile`: one motion's current as a waveform that repeats without a seam."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from segment.segment import Motion

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fidelity:
    """How a profile differs from the segments it was made from (profile - segments).

    Attributes:
        mean_A: of the time average.
        rms_A: of the root mean square.
        percentile_A: (1, 50, 99) percentiles.
        ripple_spectrum: relative RMS difference of the ripple's amplitude spectrum.
        ramp_rate: Kolmogorov-Smirnov distance of the two distributions of dI/dt, 0..1.
        seam_A: largest jump between samples that did not follow each other in the recording,
            where the waveform repeats and where it was stitched.
        usual_step_A: 99th percentile of the jumps between samples that did: what `seam_A` is to be
            compared with.
        shift_A: was added to the recorded samples to keep the mean.
        gain: their distance from the mean was multiplied by this to keep the RMS.
    """

    mean_A: float
    rms_A: float
    percentile_A: tuple[float, float, float]
    ripple_spectrum: float
    ramp_rate: float
    seam_A: float
    usual_step_A: float = float("nan")
    shift_A: float = 0.0
    gain: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeriodicProfile:
    """One period of one motion's current; sample n follows sample n - 1, sample 0 follows the last.

    Attributes:
        motion: which one.
        period_s: length of the period; n samples spaced period_s / n.
        time_s: (n,) from 0.
        current_A: (n,) discharge positive.
        source_s: total duration of the segments it was made from.
        segments: how many there were.
        fidelity: the deviations from those segments.
    """

    motion: Motion
    period_s: float
    time_s: FloatArray
    current_A: FloatArray
    source_s: float
    segments: int
    fidelity: Fidelity


@dataclass(frozen=True, slots=True, kw_only=True)
class TooLittle:
    """A motion that has no profile.

    Attributes:
        motion: which one.
        source_s: total duration of its segments, whatever decided them; 0 if it was not flown.
        reason: in words, with the numbers.
    """

    motion: Motion
    source_s: float
    reason: str
