"""Make the reference solutions: `python -m tests.reference.make_reference [NAME...]`.

Each load is solved with PyBaMM's DFN on three meshes, each 1.5 times finer than the one before.
The scheme is of second order, so the last two give the limit (Richardson); how far that limit lies
from the one of the first two bounds its own error and is stored with it.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybamm

from tests.reference.dfn import DEFAULT, Answer, Mesh, solve_hold, solve_linear
from tests.reference.loads import LOADS, ReferenceLoad, names
from tests.reference.stored import cell_file

FloatArray = npt.NDArray[np.float64]

HERE = Path(__file__).parent
TOLERANCE = 1e-8  # a hundredfold tighter one changes less than a microvolt (README)
REFINEMENT = 1.5
COARSEST = {  # of three meshes; a load of 6000 samples affords less
    ("lg_m50", "2C"): Mesh(layer=24, particle=72),
    ("lg_m50", "3C"): Mesh(layer=60, particle=60),
    ("lg_m50", "pulses"): Mesh(layer=24, particle=72),
    ("lg_m50", "flight"): Mesh(layer=12, particle=40),
    ("lipo_2200", "2C"): Mesh(layer=8, particle=24),
    ("lipo_2200", "pulses"): Mesh(layer=8, particle=24),
    ("lipo_2200", "flight"): Mesh(layer=8, particle=24),
    ("uneven", "2C"): Mesh(layer=8, particle=36),
    ("uneven", "flight"): Mesh(layer=8, particle=36),
}


def meshes(cell: str, kind: str) -> list[Mesh]:
    """Coarse to fine."""
    first = COARSEST[cell, kind]
    return [
        Mesh(
            layer=round(first.layer * REFINEMENT**k), particle=round(first.particle * REFINEMENT**k)
        )
        for k in range(3)
    ]


def solve(
    cell: str, load: ReferenceLoad, *, mesh: Mesh, thermal: str, tolerance: float | None
) -> Answer:
    """One load on one mesh."""
    method = solve_hold if load.hold else solve_linear
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyBaMM's own, about its own defaults
        return method(
            cell_file(cell),
            load.time_s,
            load.current_A,
            mesh=mesh,
            thermal=thermal,
            tolerance=tolerance,
        )


def limit(coarse: FloatArray, fine: FloatArray) -> FloatArray:
    """Where a second-order scheme is heading (Richardson)."""
    return fine + (fine - coarse) / (REFINEMENT**2 - 1)


def difference_mV(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Root mean square and largest difference [mV]."""
    d = 1e3 * (a - b)
    return float(np.sqrt(np.mean(d**2))), float(np.max(np.abs(d)))


def make(name: str) -> str:
    """Solve one case, write its file, return its row of the README's table."""
    cell, kind, thermal = name.split("-")
    load = LOADS[cell, kind]
    runs = [
        solve(cell, load, mesh=mesh, thermal=thermal, tolerance=TOLERANCE)
        for mesh in (DEFAULT, *meshes(cell, kind))
    ]
    default, *refined = runs
    voltage = [m.voltage_V for m in refined]
    best = limit(voltage[1], voltage[2])
    own = difference_mV(limit(voltage[0], voltage[1]), best)
    finest, plain = difference_mV(voltage[2], best), difference_mV(default.voltage_V, best)
    temperature = limit(refined[1].temperature_K, refined[2].temperature_K)
    np.savez_compressed(
        HERE / f"{name}.npz",
        time_s=load.time_s,
        current_A=load.current_A,
        hold=load.hold,
        voltage_V=best,
        temperature_K=temperature,
        own_error_rms_mV=own[0],
        own_error_max_mV=own[1],
    )
    return (
        f"| {name} | {load.time_s.size} | {load.time_s[-1]:.0f} | {best.min():.3f} "
        f"| {temperature.max() - 273.15:.2f} | {own[0]:.4f} / {own[1]:.4f} "
        f"| {finest[0]:.3f} / {finest[1]:.3f} | {plain[0]:.2f} / {plain[1]:.2f} "
        f"| {default.solve_s:.1f} / {refined[2].solve_s:.0f} |"
    )


if __name__ == "__main__":
    sys.stdout.write(f"PyBaMM {pybamm.__version__}, numpy {np.__version__}\n")
    for chosen in sys.argv[1:] or names():
        sys.stdout.write(make(chosen) + "\n")
        sys.stdout.flush()
