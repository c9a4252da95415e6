"""Motions at given times."""

import numpy as np

from segment import Basis, LoadStatistics, Motion, Segment, motions_at

LOAD = LoadStatistics(charge_C=0, energy_J=0, mean_A=0, rms_A=0, p99_A=0, ripple_A=0)


def test_each_time_has_the_motion_of_its_half_open_segment() -> None:
    cut = [
        Segment(motion=m, start_s=a, stop_s=b, basis=Basis.NONE, load=LOAD)
        for m, a, b in ((Motion.HOVER, 1.0, 3.0), (Motion.HORIZONTAL, 3.0, 4.0))
    ]
    at = motions_at(np.array([0.0, 1.0, 2.9, 3.0, 3.5, 4.0]), cut)
    assert at.tolist() == ["", "hover", "hover", "horizontal", "horizontal", ""]
    assert motions_at(np.array([0.0, 1.0]), []).tolist() == ["", ""]
