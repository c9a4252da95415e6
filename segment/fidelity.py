"""How alike two currents are: what a periodic profile keeps of the segments it was made from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from segment.profile import Fidelity
from segment.runs import FloatArray, moving_average
from segment.statistics import RIPPLE_WINDOW_s

FRAME_s = 3.2  # of the spectrum: resolves 0.3 Hz
MOST_STEPS = 5000
PERCENTS = (1.0, 50.0, 99.0)
RMS_WEIGHT = 10.0  # heat goes with the square of the current: no percentile is worth an error there
SEAM_WEIGHT = 3.0  # met at every repetition


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Character:
    """What is kept of a current that was sampled every `period_s`.

    Attributes:
        mean_A: average.
        rms_A: root mean square.
        spread_A: standard deviation.
        percentile_A: (3,) at PERCENTS.
        amplitude: (m,) amplitude spectrum of the ripple, any scale.
        steps_A: sorted differences of successive samples.
    """

    mean_A: float
    rms_A: float
    spread_A: float
    percentile_A: FloatArray
    amplitude: FloatArray
    steps_A: FloatArray


def character(parts: Sequence[FloatArray], period_s: float) -> Character:
    """Of stretches sampled every `period_s`; steps and ripple are taken within a stretch only."""
    all_A = np.concatenate(parts)
    return Character(
        mean_A=float(all_A.mean()),
        rms_A=float(np.sqrt(np.mean(all_A**2))),
        spread_A=float(all_A.std()),
        percentile_A=np.percentile(all_A, PERCENTS),
        amplitude=_ripple_amplitude(parts, period_s),
        steps_A=_thinned(np.sort(np.concatenate([np.diff(p) for p in parts]))),
    )


def _thinned(values: FloatArray) -> FloatArray:
    """Every k-th of sorted values: their distribution function to 1 / MOST_STEPS."""
    return values[:: max(values.size // MOST_STEPS, 1)]


def periodic_character(wave_A: FloatArray, period_s: float) -> Character:
    """Of one period of a waveform that repeats."""
    n = wave_A.size
    around = max(round((FRAME_s + RIPPLE_WINDOW_s) / period_s), 1)
    longer = np.resize(wave_A, n + around)
    whole = character([longer], period_s)
    return Character(
        mean_A=float(wave_A.mean()),
        rms_A=float(np.sqrt(np.mean(wave_A**2))),
        spread_A=float(wave_A.std()),
        percentile_A=np.percentile(wave_A, PERCENTS),
        amplitude=whole.amplitude,
        steps_A=np.sort(np.diff(wave_A, append=wave_A[:1])),
    )


def _ripple_amplitude(parts: Sequence[FloatArray], period_s: float) -> FloatArray:
    """Root of the power spectrum of the ripple, averaged over half-overlapping Hann frames."""
    n = max(round(FRAME_s / period_s), 4)
    frames = []
    for part in parts:
        time_s = np.asarray(np.arange(part.size) * period_s, dtype=np.float64)
        ripple = np.asarray(part - moving_average(time_s, part, RIPPLE_WINDOW_s))
        padded = ripple if ripple.size >= n else np.pad(ripple, (0, n - ripple.size))
        frames += [padded[k : k + n] for k in range(0, padded.size - n + 1, n // 2)]
    power = np.abs(np.fft.rfft(np.array(frames) * np.hanning(n), axis=1)) ** 2
    return np.asarray(np.sqrt(power.mean(axis=0)))


def ks_distance(a: FloatArray, b: FloatArray) -> float:
    """Greatest distance of the two empirical distribution functions; `a`, `b` sorted."""
    at = np.concatenate([a, b])
    share_a = np.searchsorted(a, at, side="right") / a.size
    share_b = np.searchsorted(b, at, side="right") / b.size
    return float(np.abs(share_a - share_b).max())


def compare(profile: Character, source: Character, seam_A: float) -> Fidelity:
    """Deviations of `profile` from `source`."""
    scale = float(np.sqrt(np.mean(source.amplitude**2)))
    off = float(np.sqrt(np.mean((profile.amplitude - source.amplitude) ** 2)))
    low, middle, high = (profile.percentile_A - source.percentile_A).tolist()
    return Fidelity(
        mean_A=profile.mean_A - source.mean_A,
        rms_A=profile.rms_A - source.rms_A,
        percentile_A=(low, middle, high),
        ripple_spectrum=off / scale if scale > 0 else 0.0,
        ramp_rate=ks_distance(profile.steps_A, source.steps_A),
        seam_A=seam_A,
        usual_step_A=float(np.percentile(np.abs(source.steps_A), 99)),
    )


def badness(fidelity: Fidelity, source: Character) -> float:
    """One number to choose by: the deviations in units of the source's own spread, added.

    A jump counts as far as it exceeds those within the recording; what was done to the samples
    counts like the deviations that it mended.
    """
    f, spread = fidelity, max(source.spread_A, 1e-3)
    levels = [RMS_WEIGHT * f.mean_A, RMS_WEIGHT * f.rms_A, *f.percentile_A, f.shift_A]
    jump = SEAM_WEIGHT * max(f.seam_A - f.usual_step_A, 0.0)
    level = (float(np.sum(np.abs(levels))) + jump) / spread
    return level + f.ripple_spectrum + f.ramp_rate + abs(f.gain - 1)
