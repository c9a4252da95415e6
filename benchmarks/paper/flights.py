"""The paper's two airframes on flights like theirs, recorded, cut and made periodic.

Motors that go from 10 to 100 A and means of 16 to 22 A (arXiv 2603.12791) ask for a livelier S500
than that of the sample logs: strokes at 8 m/s up and 10 m/s along, thrust of 3.5 times the weight.
It cannot follow the strokes down, so its autopilot commands a climb for SETTLING_s after them: the
flight is cut where the plan says instead of where the command does, and that while is left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analyze.assessing import manoeuvres_of
from flightlogs.recording import Recording
from sample_logs.airframe import LIGHT, S500, Airframe
from sample_logs.instruments import AutopilotFlaws
from sample_logs.plan import Leg, hover
from sample_logs.recorded import to_recording
from sample_logs.synthetic import Truth, fly
from segment import PeriodicProfile, Segment, periodic_profiles
from segment.segment import Basis, Motion
from segment.statistics import load_statistics
from twin.damage import Manoeuvre

SEED = 5
SETTLING_s = 10.0
AIRFRAMES: Mapping[str, Airframe] = {
    "s500": replace(S500, acceleration_m_s2=9.0, thrust_to_weight=3.5),
    "light": replace(LIGHT, acceleration_m_s2=9.0, thrust_to_weight=4.0),
}
UP_m_s, ALONG_m_s = 8.0, {"s500": 10.0, "light": 12.0}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flown:
    """A flight as far as the assessment needs it."""

    name: str
    recording: Recording
    segments: tuple[Segment, ...]
    profiles: Mapping[Motion, PeriodicProfile]
    manoeuvres: tuple[Manoeuvre, ...]


def flown(name: str) -> Flown:
    """Of one of AIRFRAMES: hover, strokes up and down, strokes to and fro, each twice."""
    strokes = (
        Leg(motion=Motion.VERTICAL, strokes=10, stroke_s=2.5, speed_m_s=UP_m_s),
        hover(20.0),
        Leg(motion=Motion.HORIZONTAL, strokes=8, stroke_s=4.0, speed_m_s=ALONG_m_s[name]),
        hover(20.0),
    )
    flight = fly(AIRFRAMES[name], seed=SEED, plan=(hover(20.0), *strokes, *strokes))
    recording = to_recording(flight, seed=SEED, flaws=AutopilotFlaws(battery_period_s=0.1))
    segments = tuple(_segment(recording, span) for span in flight.truth)
    profiles = periodic_profiles(recording, segments)
    return Flown(
        name=name,
        recording=recording,
        segments=segments,
        profiles={m: p for m, p in profiles.items() if isinstance(p, PeriodicProfile)},
        manoeuvres=manoeuvres_of(recording, segments, profiles),
    )


def _segment(recording: Recording, span: Truth) -> Segment:
    """As planned, a hover without its first SETTLING_s."""
    start_s = span.start_s + (SETTLING_s if span.motion is Motion.HOVER else 0.0)
    t = recording.time_s
    inside = (t >= start_s) & (t < span.stop_s)
    return Segment(
        motion=span.motion,
        start_s=start_s,
        stop_s=span.stop_s,
        basis=Basis.SETPOINT,
        load=load_statistics(t[inside], recording.current_A[inside], recording.voltage_V[inside]),
    )


def words(of: Flown) -> str:
    """Its currents."""
    said = [
        f"{m.name} {m.waveform.mean_A:.1f} A (up to {np.max(m.waveform.current_A):.0f} A)"
        for m in of.manoeuvres
    ]
    return f"{of.name}: " + ", ".join(said)
