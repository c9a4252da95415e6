"""Make the ageing references: `python -m tests.reference.make_ageing [NAME...]`.

As `make_reference`: three meshes, each 1.5 times finer than the one before, and the limit of the
last two; how far it lies from the limit of the first two bounds the error of each output.
"""

import sys
import warnings

import numpy as np
import pybamm

from tests.reference.ageing import AGEING_LOADS, HERE, OUTPUTS, AgeingOutputs, ageing_names
from tests.reference.ageing_dfn import AgeingAnswer, solve_ageing
from tests.reference.dfn import DEFAULT, Mesh
from tests.reference.make_reference import CELLS, REFINEMENT, limit

MESHES = [
    Mesh(layer=round(20 * REFINEMENT**k), particle=round(60 * REFINEMENT**k)) for k in range(3)
]
SLOW_MESHES = [
    Mesh(layer=round(12 * REFINEMENT**k), particle=round(40 * REFINEMENT**k)) for k in range(3)
]
LOST = OUTPUTS[2:8]  # where lithium goes
TOLERANCE = (1e-8, 1e-10)  # with 1e-12 the rest does not run (README)


def solve(name: str, mesh: Mesh, tolerance: tuple[float, float] | None) -> AgeingAnswer:
    """One case on one mesh."""
    _, kind, effects, thermal = name.split("-")
    charge, load = AGEING_LOADS[kind]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyBaMM's own, about its own defaults
        return solve_ageing(
            CELLS / "lg_m50.bpx.json",
            load.time_s,
            load.current_A,
            charge=charge,
            effects=effects,
            thermal=thermal,
            mesh=mesh,
            tolerance=tolerance,
        )


def make(name: str) -> str:
    """Solve one case, write its file, return its row of the README's table."""
    _, kind, _, thermal = name.split("-")
    charge, load = AGEING_LOADS[kind]
    default = solve(name, DEFAULT, None)
    slow = kind in ("flight", "ten", "fifty", "flown") or thermal == "lumped"
    meshes = SLOW_MESHES if slow else MESHES
    coarse, middle, fine = [solve(name, mesh, TOLERANCE) for mesh in meshes]
    best, own, plain = {}, {}, {}
    for key in OUTPUTS:
        best[key] = limit(middle.outputs[key], fine.outputs[key])
        before = limit(coarse.outputs[key], middle.outputs[key])
        own[key] = float(np.max(np.abs(best[key] - before)))
        plain[key] = float(np.max(np.abs(best[key] - default.outputs[key])))
    np.savez_compressed(
        HERE / f"{name}.npz",
        time_s=load.time_s,
        current_A=load.current_A,
        charge=charge,
        **best,
        **{f"own_error_{key}": error for key, error in own.items()},
    )
    outputs = AgeingOutputs(**best)
    pieces = {key: 1e6 * float(best[key][-1]) for key in LOST if best[key].max() > 1e-12}
    shares = [max((e[k] / best[k].max() for k in pieces), default=0.0) for e in (own, plain)]
    cyclable = outputs.particles_mol + outputs.electrolyte_mol
    gap = np.max(np.abs(outputs.lost_mol() + cyclable - cyclable[0]))
    numbers = " | ".join(f"{pieces[key]:.6g}" if key in pieces else "" for key in LOST)
    return (
        f"| {name[7:]} | {best['voltage_V'][-1]:.4f} | {numbers} "
        f"| {1e3 * own['voltage_V']:.2g} / {1e3 * plain['voltage_V']:.2g} "
        f"| {100 * shares[0]:.1g} / {100 * shares[1]:.1g} | {1e12 * gap:.1g} "
        f"| {default.solve_s:.1f} / {fine.solve_s:.0f} |"
    )


if __name__ == "__main__":
    sys.stdout.write(f"PyBaMM {pybamm.__version__}, numpy {np.__version__}\n")
    for chosen in sys.argv[1:] or ageing_names():
        sys.stdout.write(make(chosen) + "\n")
        sys.stdout.flush()
