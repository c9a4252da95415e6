"""What a flight did to its pack: motions and segments in the twin's terms."""

from collections.abc import Mapping, Sequence

import numpy as np

from analyze.pack_choice import PackChoice
from flightlogs.recording import Recording
from reports.flight import ASSESSED
from segment.profile import PeriodicProfile, TooLittle
from segment.segment import Basis, Motion, Segment
from twin.calibrate.doubt import draws
from twin.calibrate.table import CalibrationError
from twin.damage import (
    CannotCycle,
    Manoeuvre,
    Others,
    Piece,
    Span,
    Study,
    Waveform,
    WaveformError,
    ageing_drawn,
    study,
)
from twin.load import Load
from twin.pack import Pack

OTHERS = 6
Profiles = Mapping[Motion, PeriodicProfile | TooLittle]


def damage_of(  # noqa: PLR0913
    recording: Recording,
    segments: Sequence[Segment],
    profiles: Profiles,
    drawn: tuple[Pack, Load],
    *,
    thorough: bool,
    pack: PackChoice | None = None,
) -> tuple[Study | None, str]:
    """The study, or none and why.

    `drawn` is what the flight drew from, and its load; `pack` the pack file, if there is one.
    """
    manoeuvres = manoeuvres_of(recording, segments, profiles)
    if not manoeuvres:
        return None, _none_to_repeat(segments, profiles)
    try:
        others = others_of(drawn[0], pack) if thorough else None
        spans = spans_of(segments)
        return study(*drawn, manoeuvres, spans, thorough=thorough, others=others), ""
    except CannotCycle as e:
        return None, f"The pack that stands for this one cannot be flown like this: {e}."
    except CalibrationError as e:
        return None, f"What is not known of the pack cannot be told: {e}."


def _none_to_repeat(segments: Sequence[Segment], profiles: Profiles) -> str:
    """Why no motion has a profile that can be repeated."""
    told = [profiles[motion] for motion in ASSESSED if motion in profiles]
    why = [p.reason for p in told if isinstance(p, TooLittle) and p.source_s]
    mixed = [s for s in segments if s.motion is Motion.MIXED and s.basis is Basis.NONE]
    if mixed:
        untold_s = sum(s.duration_s for s in mixed)
        why.append(f"for {untold_s:.1f} s neither velocity nor command tells what was flown")
    said = "; ".join(why) or "none was flown that discharges the pack"
    return f"No motion can be repeated: {said}."


def others_of(pack: Pack, choice: PackChoice | None) -> Others:
    """Packs that may be `pack` as well, by the fits beside its pack file, else by priors."""
    cell, life = (choice.cell_doubt, choice.life_doubt) if choice else (None, None)
    packs = ageing_drawn(pack, lambda own: draws(own, OTHERS, cell=cell, aged=life))
    return Others(packs=packs, of_cell=cell is not None, of_life=life is not None)


def spans_of(segments: Sequence[Segment]) -> list[Span]:
    """The segments in order; a take-off or landing could not have come at another moment."""
    return [
        Span(
            name=s.motion.value,
            start_s=s.start_s,
            stop_s=s.stop_s,
            movable=s.motion not in (Motion.GROUND, Motion.TAKEOFF, Motion.LANDING),
        )
        for s in segments
    ]


def manoeuvres_of(
    recording: Recording, segments: Sequence[Segment], profiles: Profiles
) -> tuple[Manoeuvre, ...]:
    """The motions that are judged and have a profile that discharges the pack."""
    out = []
    for motion in ASSESSED:
        profile = profiles.get(motion)
        if not isinstance(profile, PeriodicProfile):
            continue
        own = [s for s in segments if s.motion is motion and s.basis is not Basis.NONE]
        try:
            waveform = Waveform(
                current_A=profile.current_A, sample_s=profile.period_s / profile.current_A.size
            )
        except WaveformError:  # a motion on the ground station's power, or a current sensor at zero
            continue
        out.append(
            Manoeuvre(
                name=motion.value,
                waveform=waveform,
                pieces=tuple(piece(recording, s, waveform.sample_s) for s in own),
                speed_m_s=speed_m_s(recording, own),
            )
        )
    return tuple(out)


def piece(recording: Recording, segment: Segment, sample_s: float) -> Piece:
    """A segment's current, sampled evenly, with the mean that it had."""
    count = max(round(segment.duration_s / sample_s), 1)
    times = segment.start_s + segment.duration_s * (np.arange(count) + 0.5) / count
    current_A = np.interp(times, recording.time_s, recording.current_A)
    shift_A = segment.load.mean_A - float(current_A.mean())
    return Piece(current_A=current_A + shift_A, sample_s=segment.duration_s / count)


def speed_m_s(recording: Recording, segments: Sequence[Segment]) -> float | None:
    """Mean length of the velocity over the segments; None where it was not measured."""
    if recording.velocity_m_s is None:
        return None
    t = recording.time_s
    inside = np.zeros(t.size, dtype=bool)
    for s in segments:
        inside |= (t >= s.start_s) & (t < s.stop_s)
    speed = np.linalg.norm(recording.velocity_m_s[inside], axis=1)
    known = speed[np.isfinite(speed)]
    return float(known.mean()) if known.size else None
