"""The DFN in PyBaMM, from a BPX file, on meshes of any fineness; at every sample of a load."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pybamm

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh:
    """Cells in each layer and in each particle; denser towards the ends, or PyBaMM's own.

    Attributes:
        layer: finite volumes in each electrode and in the separator.
        particle: finite volumes along the radius.
        graded: Chebyshev nodes instead of equal ones.
    """

    layer: int
    particle: int
    graded: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What PyBaMM says at the samples (n,), and the time its integrator took, building apart."""

    voltage_V: FloatArray
    temperature_K: FloatArray
    solve_s: float


DEFAULT = Mesh(layer=20, particle=20, graded=False)  # what PyBaMM takes when told nothing


def simulation(
    file: Path,
    current: pybamm.Interpolant | str | float,
    *,
    mesh: Mesh,
    thermal: str,
    tolerance: float | None,
    cut_offs: bool = False,
) -> pybamm.Simulation:
    """A full cell at rest in the file's ambient temperature; tolerance None is PyBaMM's own."""
    model = pybamm.lithium_ion.DFN({"thermal": thermal})
    if not cut_offs:
        model.events = []  # the loads stay inside them; looking for them costs steps
    values = pybamm.ParameterValues.create_from_bpx(str(file), target_soc=1.0)
    values["Current function [A]"] = current
    points = dict.fromkeys(("x_n", "x_s", "x_p"), mesh.layer)
    points |= {"r_n": mesh.particle, "r_p": mesh.particle}
    submesh = dict(model.default_submesh_types)
    if mesh.graded:
        for domain in (
            "negative electrode", "separator", "positive electrode",
            "negative particle", "positive particle",
        ):  # fmt: skip
            submesh[domain] = pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh)
    limits = {} if tolerance is None else {"rtol": tolerance, "atol": tolerance}
    solver = pybamm.IDAKLUSolver(**limits, options={"max_num_steps": 10**6})
    return pybamm.Simulation(
        model, parameter_values=values, var_pts=points, submesh_types=submesh, solver=solver
    )


def solve_linear(file: Path, time_s: FloatArray, current_A: FloatArray, **settings: Any) -> Answer:
    """The current runs straight between the samples."""
    current = pybamm.Interpolant(time_s, current_A, pybamm.t, interpolator="linear")
    sim = simulation(file, current, **settings)
    solution = sim.solve(time_s, t_interp=time_s)  # a stop at each sample: a kink there
    return Answer(*_outputs(solution), float(solution.solve_time.value))


def solve_hold(file: Path, time_s: FloatArray, current_A: FloatArray, **settings: Any) -> Answer:
    """The current holds from each sample to the next.

    Where it changes, the voltage of the sample is the one just after the change; so the last two
    currents must be equal.
    """
    sim = simulation(file, "[input]", **settings)
    sim.build(inputs={"Current function [A]": float(current_A[0])})
    change = np.append(np.flatnonzero(np.diff(current_A)) + 1, time_s.size - 1)
    voltage_V, temperature_K = np.empty(time_s.size), np.empty(time_s.size)
    solution, first, solve_s = None, 0, 0.0
    for last in change:
        span = time_s[first : last + 1] - time_s[first]
        solution = sim.solver.step(
            solution,
            sim.built_model,
            span[-1],
            t_eval=span[[0, -1]],
            t_interp=span,
            inputs={"Current function [A]": float(current_A[first])},
            save=False,
        )
        piece = slice(first, last + 1)
        voltage_V[piece], temperature_K[piece] = _outputs(solution)
        first, solve_s = last, solve_s + float(solution.solve_time.value)
    return Answer(voltage_V, temperature_K, solve_s)


def _outputs(solution: pybamm.Solution) -> tuple[FloatArray, FloatArray]:
    names = ("Terminal voltage [V]", "Volume-averaged cell temperature [K]")
    voltage, temperature = (np.asarray(solution[name].entries) for name in names)
    return voltage, temperature
