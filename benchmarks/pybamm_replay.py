"""The twin beside PyBaMM's DFN, in one run: `python -m benchmarks.pybamm_replay [NAME...]`.

Both read the same BPX file and the same load. Error is against the limit of refined meshes in
tests/reference (its own error is in the README there); `--converge` solves the finest of those
meshes again, to time it. PyBaMM's time is its integrator's alone, at its own default tolerances;
the twin's is a whole second call (the first also builds and compiles its kernel, or loads it).
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from tests.reference.dfn import DEFAULT
from tests.reference.loads import names
from tests.reference.make_reference import TOLERANCE, difference_mV, meshes, solve
from tests.reference.stored import Reference, twin_load, twin_pack
from twin.simulate import simulate

T = TypeVar("T")

REPEATS = 5  # of the twin; the median counts


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Result and wall time [s]."""
    start = time.perf_counter()
    return work(), time.perf_counter() - start


def row(name: str, *, converge: bool) -> str:
    """One line of the table."""
    case = Reference.read(name)
    thermal = "lumped" if case.heated else "isothermal"
    pack, load = twin_pack(case), twin_load(case.load)
    _, first_s = timed(lambda: simulate(pack, load))
    runs = [timed(lambda: simulate(pack, load).require()) for _ in range(REPEATS)]
    solution, twin_s = runs[0][0], statistics.median(seconds for _, seconds in runs)
    default = solve(case.cell, case.load, mesh=DEFAULT, thermal=thermal, tolerance=None)
    twin_mV = difference_mV(solution.voltage_V, case.voltage_V)
    plain_mV = difference_mV(default.voltage_V, case.voltage_V)
    warmer_K = float(np.max(np.abs(solution.temperature_K - case.temperature_K)))
    converged = ""
    if converge:
        mesh = meshes(case.cell, case.kind)[-1]
        fine = solve(case.cell, case.load, mesh=mesh, thermal=thermal, tolerance=TOLERANCE)
        fine_mV = difference_mV(fine.voltage_V, case.voltage_V)
        converged = (
            f" | {fine_mV[0]:.3f} / {fine_mV[1]:.3f} | {fine.solve_s:.1f} s "
            f"| {fine.solve_s / twin_s:.0f}"
        )
    return (
        f"{name} | {twin_mV[0]:.3f} / {twin_mV[1]:.3f} | {warmer_K:.3f} | {1e3 * twin_s:.0f} ms "
        f"| {first_s:.1f} s | {plain_mV[0]:.2f} / {plain_mV[1]:.2f} | {default.solve_s:.2f} s "
        f"| {default.solve_s / twin_s:.0f}{converged}"
    )


HEAD = (
    "case | twin rms / max mV | dT max K | twin | first call | PyBaMM default rms / max mV "
    "| its time | ratio"
)
HEAD_CONVERGED = " | PyBaMM fine rms / max mV | its time | ratio"


def main() -> None:
    """Print the table, a row as soon as it is known."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="cell-load-thermal; default: all")
    parser.add_argument("--converge", action="store_true", help="time the finest mesh too")
    chosen = parser.parse_args()
    print(HEAD + (HEAD_CONVERGED if chosen.converge else ""))
    for name in chosen.names or names():
        print(row(name, converge=chosen.converge), flush=True)


if __name__ == "__main__":
    main()
