"""Make the reference with hysteresis: `python -m tests.reference.make_hysteresis`.

PyBaMM's DFN with `"open-circuit potential": "one-state hysteresis"` from the BPX file of
`hysteresis.py`, on three meshes as in `make_reference.py`.
"""

import json
import sys
import warnings

import numpy as np
import numpy.typing as npt
import pybamm

from tests.reference.dfn import Mesh
from tests.reference.hysteresis import HERE, START_SOC, THERMAL, load, text
from tests.reference.make_reference import REFINEMENT, TOLERANCE, difference_mV, limit

FloatArray = npt.NDArray[np.float64]

COARSEST = Mesh(layer=12, particle=40)


def solve(mesh: Mesh, thermal: str, potential: str) -> tuple[FloatArray, FloatArray]:
    """Voltage and temperature at the samples; `potential` is PyBaMM's option."""
    model = pybamm.lithium_ion.DFN({"thermal": thermal, "open-circuit potential": potential})
    model.events = []
    values = pybamm.ParameterValues.create_from_bpx_obj(json.loads(text()), target_soc=START_SOC)
    t, current = load().time_s, load().current_A
    values["Current function [A]"] = pybamm.Interpolant(t, current, pybamm.t)
    submesh = dict(model.default_submesh_types)
    for layer in ("electrode", "particle"):
        for side in ("negative", "positive"):
            submesh[f"{side} {layer}"] = pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh)
    submesh["separator"] = pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh)
    points = dict.fromkeys(("x_n", "x_s", "x_p"), mesh.layer)
    points |= {"r_n": mesh.particle, "r_p": mesh.particle}
    solver = pybamm.IDAKLUSolver(rtol=TOLERANCE, atol=TOLERANCE, options={"max_num_steps": 10**6})
    solution = pybamm.Simulation(
        model, parameter_values=values, var_pts=points, submesh_types=submesh, solver=solver
    ).solve(t, t_interp=t)
    names = ("Terminal voltage [V]", "Volume-averaged cell temperature [K]")
    voltage, temperature = (np.asarray(solution[name].entries) for name in names)
    return voltage, temperature


def make(thermal: str) -> str:
    """Solve, write the file, return the row of the README's table."""
    meshes = [
        Mesh(
            layer=round(COARSEST.layer * REFINEMENT**k),
            particle=round(COARSEST.particle * REFINEMENT**k),
        )
        for k in range(3)
    ]
    runs = [solve(mesh, thermal, "one-state hysteresis") for mesh in meshes]
    (first, second, third), temperature = zip(*runs, strict=True)
    best = limit(second, third)
    own = difference_mV(limit(first, second), best)
    plain, _ = solve(meshes[-1], thermal, "single")
    np.savez_compressed(
        HERE / f"hysteresis-{thermal}.npz",
        current_A=load().current_A,
        voltage_V=best,
        temperature_K=limit(*temperature[1:]),
        without_V=plain,
        own_error_rms_mV=own[0],
        own_error_max_mV=own[1],
    )
    finest, bare = difference_mV(third, best), difference_mV(plain, best)
    return (
        f"| {thermal} | {best.min():.3f} | {temperature[-1].max() - 273.15:.2f} "
        f"| {own[0]:.4f} / {own[1]:.4f} | {finest[0]:.3f} / {finest[1]:.3f} "
        f"| {bare[0]:.1f} / {bare[1]:.1f} |"
    )


if __name__ == "__main__":
    sys.stdout.write(f"PyBaMM {pybamm.__version__}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyBaMM's own, about its own defaults
        for case in sys.argv[1:] or THERMAL:
            sys.stdout.write(make(case) + "\n")
            sys.stdout.flush()
