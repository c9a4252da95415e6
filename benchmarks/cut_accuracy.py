"""How well cutting finds the truth of synthetic flights.

    python -m benchmarks.cut_accuracy [SEEDS]

For both airframes and each source of the command: the share of the time with the true motion, and
the error of the boundaries (nearest one between the same two motions).
"""

import sys

import numpy as np

from sample_logs.airframe import LIGHT, S500
from sample_logs.recorded import to_recording
from sample_logs.synthetic import fly
from segment import cut
from tests.segment.judged import MISSED_s, judge

CASES = {
    "velocity setpoints": (("setpoint",), False),
    "position setpoints": (("position",), False),
    "sticks": (("sticks",), False),
    "altitude mode": (("setpoint",), True),
    "measured velocity": ((), False),
}


def main(seeds: int) -> None:
    """Print a line for each airframe and case."""
    print(f"{seeds} flights of 300 s each; boundaries in s")
    for airframe in (S500, LIGHT):
        for name, (logged, altitude_mode) in CASES.items():
            right, errors = [], []
            for seed in range(seeds):
                flight = fly(airframe, seed=seed, altitude_mode=altitude_mode)
                segments = cut(to_recording(flight, seed=seed, logged=logged))
                found = judge(flight.truth, segments)
                right.append(found.right)
                errors += found.boundaries_s
            missed = sum(e >= MISSED_s for e in errors)
            print(
                f"{airframe.name:6}{name:20} time right {np.mean(right):.1%} "
                f"(worst {min(right):.1%})   boundary median {np.median(errors):.2f}, "
                f"90th percentile {np.percentile(errors, 90):.2f}, missed {missed} of {len(errors)}"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
