"""The twin beside PyBaMM's DFN, in one run: `python -m benchmarks.pybamm_replay [NAME...]`.

Both read the same BPX file and the same load. Error is against the limit of refined meshes in
tests/reference (its own error is in the README there); `--converge` solves the finest of those
meshes again, to time it. Times are of a warm solve: model built, code compiled, second call.
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from tests.reference.dfn import DEFAULT
from tests.reference.loads import ReferenceLoad, names
from tests.reference.make_reference import (
    CELLS,
    HERE,
    MESHES,
    TOLERANCE,
    difference_mV,
    solve,
)
from twin.builtin import load_cell
from twin.effects.self_heating import SelfHeating
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate

FloatArray = npt.NDArray[np.float64]
T = TypeVar("T")

PYBAMM_TOLERANCE = 1e-6  # near what its users leave it at (1e-4 relative, 1e-6 absolute); faster
REPEATS = 5  # of the twin; the median counts


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One load on one cell, and the solution both are measured against."""

    name: str
    load: ReferenceLoad
    thermal: str
    voltage_V: FloatArray
    temperature_K: FloatArray

    @classmethod
    def read(cls, name: str) -> "Case":
        """The stored case `cell-load-thermal`."""
        with np.load(HERE / f"{name}.npz") as file:
            load = ReferenceLoad(
                time_s=file["time_s"], current_A=file["current_A"], hold=bool(file["hold"])
            )
            return cls(name, load, name.split("-")[2], file["voltage_V"], file["temperature_K"])

    @property
    def cell(self) -> str:
        """Name of the built-in cell."""
        return self.name.split("-")[0]


def twin_pack(case: Case) -> Pack:
    """One cell as the reference has it: full, at rest, heat transfer from its BPX file."""
    document = json.loads((CELLS / f"{case.cell}.bpx.json").read_text(encoding="utf-8"))
    transfer = document["State"]["Thermal environment"]["Heat transfer coefficient [W.m-2.K-1]"]
    heated = case.thermal == "lumped"
    effects = (SelfHeating(heat_transfer_W_m2_K=transfer),) if heated else ()
    return Pack(cell=load_cell(case.cell), effects=effects)


def twin_load(load: ReferenceLoad) -> Load:
    """The same load for the twin."""
    between = Between.HOLD if load.hold else Between.LINEAR
    return Load(time_s=load.time_s, current_A=load.current_A, between=between)


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Result and wall time [s]."""
    start = time.perf_counter()
    return work(), time.perf_counter() - start


def row(case: Case, *, converge: bool) -> str:
    """One line of the table."""
    pack, load = twin_pack(case), twin_load(case.load)
    _, first_s = timed(lambda: simulate(pack, load))
    runs = [timed(lambda: simulate(pack, load).require()) for _ in range(REPEATS)]
    solution, twin_s = runs[0][0], statistics.median(seconds for _, seconds in runs)
    default = solve(
        case.cell, case.load, mesh=DEFAULT, thermal=case.thermal, tolerance=PYBAMM_TOLERANCE
    )
    twin_mV = difference_mV(solution.voltage_V, case.voltage_V)
    plain_mV = difference_mV(default.voltage_V, case.voltage_V)
    warmer_K = float(np.max(np.abs(solution.temperature_K - case.temperature_K)))
    converged = ""
    if converge:
        fine = solve(
            case.cell, case.load, mesh=MESHES[-1], thermal=case.thermal, tolerance=TOLERANCE
        )
        fine_mV = difference_mV(fine.voltage_V, case.voltage_V)
        converged = (
            f" | {fine_mV[0]:.3f} / {fine_mV[1]:.3f} | {fine.seconds:.1f} s "
            f"| {fine.seconds / twin_s:.0f}"
        )
    return (
        f"{case.name} | {twin_mV[0]:.3f} / {twin_mV[1]:.3f} | {warmer_K:.3f} "
        f"| {1e3 * twin_s:.0f} ms | {first_s:.1f} s | {plain_mV[0]:.2f} / {plain_mV[1]:.2f} "
        f"| {default.seconds:.2f} s | {default.seconds / twin_s:.0f}{converged}"
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
        print(row(Case.read(name), converge=chosen.converge), flush=True)


if __name__ == "__main__":
    main()
