"""Periodic profiles: for each motion a current that can be repeated for thousands of cycles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flightlogs.recording import Recording
from segment.fidelity import RMS_WEIGHT, Character, badness, character, compare, periodic_character
from segment.profile import Fidelity, PeriodicProfile, TooLittle
from segment.ring import Ring, seam_costs, stitch, uniform, window, window_means
from segment.runs import FloatArray
from segment.segment import Basis, Motion, Segment

MOST_STARTS = 3000  # windows begin at every sample of a ring shorter than this
PROFILED = (Motion.HOVER, Motion.VERTICAL, Motion.HORIZONTAL, Motion.MIXED)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileMaker:
    """How a period is chosen.

    Attributes:
        shortest_s: of a period, where there is more than that to choose from.
        longest_s: of a period.
        least_samples: the 1st percentile needs a hundred.
        least_s: of all segments of the motion.
        trims_s: at most this much is left out at either side of a stitch, to match level and slope
            (each is tried: a longer one makes a better stitch, and loses more of the transients).
        gain_limit: largest relative change of the distance from the mean, to keep the RMS.
        rms_tolerance: a smaller relative deviation of the RMS is left as it is: heat to 0.2 %.
        candidates: windows that are compared in full.
    """

    shortest_s: float = 20.0
    longest_s: float = 60.0
    least_samples: int = 100
    least_s: float = 10.0
    trims_s: tuple[float, ...] = (1.0, 0.4, 0.0)
    gain_limit: float = 0.05
    rms_tolerance: float = 1e-3
    candidates: int = 60


def periodic_profiles(
    recording: Recording,
    segments: Sequence[Segment],
    maker: ProfileMaker | None = None,
) -> Mapping[Motion, PeriodicProfile | TooLittle]:
    """A profile for each motion, or the reason why there is none.

    The segments of a motion are stitched into a ring (samples as recorded, cut where level and
    slope match). Of all stretches of the ring between `shortest_s` and `longest_s` the one is
    taken whose mean, RMS, percentiles, ripple spectrum and ramp rates are closest to the segments'.
    It is then shifted and scaled by the little that is left of the mean's and the RMS's deviation.
    """
    maker = maker or ProfileMaker()
    return {motion: _profile(recording, segments, motion, maker) for motion in PROFILED}


def _profile(
    recording: Recording, segments: Sequence[Segment], motion: Motion, maker: ProfileMaker
) -> PeriodicProfile | TooLittle:
    own = [s for s in segments if s.motion is motion]
    known = [s for s in own if s.basis is not Basis.NONE]
    period_s = float(np.median(np.diff(recording.time_s)))
    parts = [_samples(recording, s, period_s) for s in known]
    parts = [p for p in parts if p.size >= 2]
    source_s, count = sum(s.duration_s for s in known), sum(p.size for p in parts)
    if source_s < maker.least_s or count < maker.least_samples:
        reason = (
            f"{source_s:.1f} s of {motion.value} motion in {len(known)} segments "
            f"({count} samples); a profile needs {maker.least_s:g} s and "
            f"{maker.least_samples} samples"
        )
        untold_s = sum(s.duration_s for s in own) - source_s
        if untold_s:
            untold = f"For {untold_s:.1f} s neither velocity nor command tells what was flown"
            reason = f"{reason}. {untold}" if known else untold
        return TooLittle(motion=motion, source_s=source_s + untold_s, reason=reason)
    source = character(parts, period_s)
    rings = [stitch(parts, round(trim_s / period_s)) for trim_s in maker.trims_s]
    wave, fidelity = _best(rings, source, period_s, maker)
    return PeriodicProfile(
        motion=motion,
        period_s=wave.size * period_s,
        time_s=np.asarray(np.arange(wave.size) * period_s, dtype=np.float64),
        current_A=wave,
        source_s=source_s,
        segments=len(known),
        fidelity=fidelity,
    )


def _samples(recording: Recording, segment: Segment, period_s: float) -> FloatArray:
    inside = (recording.time_s >= segment.start_s) & (recording.time_s < segment.stop_s)
    if inside.sum() < 2:
        return np.zeros(0)
    return uniform(recording.time_s[inside], recording.current_A[inside], period_s)


def _best(
    rings: Sequence[Ring], source: Character, period_s: float, maker: ProfileMaker
) -> tuple[FloatArray, Fidelity]:
    made = [
        _corrected(*window(ring, start, n), source, period_s, maker)
        for ring in rings
        for start, n in _candidates(ring, source, period_s, maker)
    ]
    return min(made, key=lambda m: badness(m[1], source))


def _corrected(
    raw_A: FloatArray, seam_A: float, source: Character, period_s: float, maker: ProfileMaker
) -> tuple[FloatArray, Fidelity]:
    """`raw_A` with the source's mean and, where it matters and the limit lets it, its RMS."""
    spread_A, shift_A = float(raw_A.std()), source.mean_A - float(raw_A.mean())
    off_A = float(np.hypot(source.mean_A, spread_A)) - source.rms_A
    gain, limit = 1.0, maker.gain_limit
    if spread_A > 0 and abs(off_A) > maker.rms_tolerance * source.rms_A:
        gain = float(np.clip(source.spread_A / spread_A, 1 - limit, 1 + limit))
    wave = source.mean_A + gain * (raw_A + shift_A - source.mean_A)
    fidelity = compare(periodic_character(wave, period_s), source, gain * seam_A)
    return wave, replace(fidelity, shift_A=shift_A, gain=gain)


def _candidates(
    ring: Ring, source: Character, period_s: float, maker: ProfileMaker
) -> list[tuple[int, int]]:
    """(start, samples) of the windows worth a full comparison: right mean and RMS, a good seam."""
    size = ring.current_A.size
    low, longest = round(maker.shortest_s / period_s), int(maker.longest_s / period_s)
    if size <= low:
        return [(0, size)]
    whole = [(0, size)] if size <= longest else []
    lengths = np.unique(np.linspace(low, min(longest, size - 1), 80).astype(np.int64))
    starts = np.arange(0, size, max(size // MOST_STARTS, 1), dtype=np.int64)
    mean = window_means(ring.current_A, lengths, starts)
    square = window_means(ring.current_A**2, lengths, starts)
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    beyond = np.maximum(np.abs(spread - source.spread_A) - maker.gain_limit * spread, 0.0)
    cost = (
        np.abs(mean - source.mean_A) + RMS_WEIGHT * beyond + 0.5 * seam_costs(ring, lengths, starts)
    )
    rows, best = np.argmin(cost, axis=0), np.min(cost, axis=0)
    blocks = np.array_split(np.arange(starts.size), maker.candidates)  # spread over the ring
    chosen = [int(block[np.argmin(best[block])]) for block in blocks if block.size]
    return whole + [(int(starts[k]), int(lengths[rows[k]])) for k in chosen]
