"""What a flight did to its pack: motions and segments in the twin's terms."""

from collections.abc import Mapping, Sequence

import numpy as np

from flightlogs.recording import Recording
from reports.flight import ASSESSED
from segment.profile import PeriodicProfile, TooLittle
from segment.segment import Basis, Motion, Segment
from twin.damage import (
    CannotCycle,
    Manoeuvre,
    Piece,
    Span,
    Study,
    Waveform,
    WaveformError,
    study,
)
from twin.load import Load
from twin.pack import Pack

Profiles = Mapping[Motion, PeriodicProfile | TooLittle]


def damage_of(
    recording: Recording,
    segments: Sequence[Segment],
    profiles: Profiles,
    drawn: tuple[Pack, Load],
    *,
    thorough: bool,
) -> tuple[Study | None, str]:
    """The study, or none and why; `drawn` is what the flight drew from, and its load."""
    manoeuvres = manoeuvres_of(recording, segments, profiles)
    if not manoeuvres:
        return None, "No motion lasted long enough for a profile, so none can be repeated."
    spans = [Span(name=s.motion.value, start_s=s.start_s, stop_s=s.stop_s) for s in segments]
    try:
        return study(*drawn, manoeuvres, spans, thorough=thorough), ""
    except CannotCycle as e:
        return None, f"The pack that stands for this one cannot be flown like this: {e}."


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
                pieces=tuple(
                    Piece(duration_s=s.duration_s, mean_A=s.load.mean_A, rms_A=s.load.rms_A)
                    for s in own
                ),
                off_mean_A=profile.fidelity.mean_A,
                off_rms_A=profile.fidelity.rms_A,
                speed_m_s=speed_m_s(recording, own),
            )
        )
    return tuple(out)


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
