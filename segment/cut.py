"""`cut`: a recording into segments of one motion each."""

from dataclasses import replace

import numpy as np

from flightlogs.recording import Recording
from flightlogs.resample import straight
from segment.command import BASES, Command, commanded
from segment.detector import GROUND, MOTIONS, UNKNOWN, MotionDetector
from segment.runs import IntArray, constant_runs, pieces
from segment.segment import Basis, Segment
from segment.statistics import load_statistics


def cut(recording: Recording, detector: MotionDetector | None = None) -> tuple[Segment, ...]:
    """Segments in time order, disjoint, half-open; together they cover all recorded time.

    A segment starts at the time of its first sample and stops where the next one starts (the last
    one: at the last sample), so charges add up to the recording's. Nothing is known inside a gap
    longer than `detector.gap_s`: the segment before it stops at its last sample, the one behind
    starts anew. Where no velocity is known the motion is MIXED with Basis.NONE; the ground is told
    by the in-air flag, trimmed by height and current (Basis.NONE). For the energy the voltage runs
    straight between the samples at which it was measured.
    """
    detector = detector or MotionDetector()
    command = commanded(recording, detector.sticks)
    airborne = detector.airborne.find(recording)
    recording = replace(recording, voltage_V=straight(recording.time_s, recording.voltage_V))
    out: list[Segment] = []
    for a, b in pieces(recording.time_s, detector.gap_s):
        if b - a >= 2:
            codes = detector.label(recording.time_s[a:b], command.velocity_m_s[a:b], airborne[a:b])
            out += [
                _segment(recording, command, int(codes[start]), a + start, min(a + stop, b - 1))
                for start, stop in constant_runs(codes)
                if start < b - a - 1  # a lone last sample has no duration
            ]
    return tuple(out)


def _segment(recording: Recording, command: Command, code: int, first: int, last: int) -> Segment:
    """Of samples `first` to `last`, both included; `last` is where the next segment starts."""
    part = slice(first, last + 1)
    return Segment(
        motion=MOTIONS[code],
        start_s=float(recording.time_s[first]),
        stop_s=float(recording.time_s[last]),
        basis=_basis(command.basis()[first:last], code),
        load=load_statistics(
            recording.time_s[part], recording.current_A[part], recording.voltage_V[part]
        ),
    )


def _basis(ranks: IntArray, code: int) -> Basis:
    """What most of the samples rest on."""
    if code in (UNKNOWN, GROUND):
        return Basis.NONE
    return BASES[int(np.bincount(ranks, minlength=len(BASES)).argmax())]
