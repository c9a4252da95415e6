"""How well a cut agrees with the truth of a synthetic flight."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

MISSED_s = 10.0


@dataclass(frozen=True)
class Judgement:
    right: float  # share of the time with the true motion
    boundaries_s: list[float]  # error of each true boundary; MISSED_s where there is none


def _labels(spans, at_s):
    out = np.full(at_s.size, "", dtype=object)
    for span in spans:
        out[(at_s >= span.start_s) & (at_s < span.stop_s)] = span.motion.value
    return out


def judge(truth, segments):
    at_s = np.arange(segments[0].start_s, segments[-1].stop_s, 0.01)
    found = [(a.motion, b.motion, b.start_s) for a, b in pairwise(segments)]
    errors = []
    for a, b in pairwise(truth):
        off = [abs(t - b.start_s) for x, y, t in found if (x, y) == (a.motion, b.motion)]
        errors.append(min([*off, MISSED_s]))
    return Judgement(float(np.mean(_labels(truth, at_s) == _labels(segments, at_s))), errors)
