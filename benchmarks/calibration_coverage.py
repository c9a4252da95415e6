"""Do the intervals of a calibration hold the truth as often as they say?

    python -m benchmarks.calibration_coverage [--cells 20]

Cells are drawn from the prior and measured by the twin itself (0.1C, 2C, pulses; 2 mV of noise):
there is no model error, so what is judged is fit and statistics alone.
"""

import argparse
import time

import numpy as np

from tests.twin.calibrate.synthetic import cell_pack, measured
from twin.calibrate.answer import answer
from twin.calibrate.checks import fitted
from twin.calibrate.run import fit, problem_of


def main() -> None:
    """Print a line a cell, then the coverage."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--cells", type=int, default=20)
    options.add_argument("--cell", default="lipo_2200")
    chosen = options.parse_args()
    pack, inside, errors = cell_pack(chosen.cell), [], []
    for seed in range(chosen.cells):
        tests, truth, blank = measured(pack, seed)
        begun = time.perf_counter()
        problem = problem_of(pack, tests)
        *_, last = fit(problem)
        problem = last.problem
        seconds = time.perf_counter() - begun
        told = answer(problem, last.q)
        whole = fitted(problem, last.q, tests)
        rms_mV = [1e3 * f.rms_V for f in whole]
        cell = [e for e in told.estimates if not e.name.startswith("start_V")]
        values = [p.value(q) for p, q in zip(blank.parameters, truth, strict=True)]
        values = [*values[: len(cell)], *blank.mapped(truth, 0).derived]
        held = [
            e.lower <= v <= e.upper for e, v in zip((*cell, *told.derived), values, strict=True)
        ]
        inside.append(held)
        errors.append(max(rms_mV))
        missed = [e.name for e, h in zip((*cell, *told.derived), held, strict=True) if not h]
        print(f"{seed:3d} {seconds:6.1f} s  rms mV {np.round(rms_mV, 2)}  {np.mean(held):4.0%}"
              f"  {', '.join(missed)}", flush=True)  # fmt: skip
    names = [*(e.name for e in cell), *(e.name for e in told.derived)]
    for name, share in zip(names, np.mean(inside, axis=0), strict=True):
        print(f"{name:45s} {share:5.0%}")
    print(f"90 % intervals that hold the truth: {np.mean(inside):.1%} of {np.size(inside)}")
    print(f"largest rms of any test: {max(errors):.2f} mV a cell")


if __name__ == "__main__":
    main()
