"""The ageing DFN in PyBaMM: the cell of a BPX file with O'Kane's degradation on top."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pybamm

from proof.simulated.dfn import okane
from tests.reference.dfn import Mesh

FloatArray = npt.NDArray[np.float64]

SEI = {"SEI": "solvent-diffusion limited", "SEI film resistance": "none"}
CRACKS = {
    "particle mechanics": ("swelling and cracking", "none"),
    "stress-induced diffusion": ("false", "false"),
}
ALL = {
    "SEI": "solvent-diffusion limited",
    "SEI film resistance": "distributed",
    "SEI porosity change": "true",
    "lithium plating": "partially reversible",
    "lithium plating porosity change": "true",
    "particle mechanics": ("swelling and cracking", "swelling only"),
    "SEI on cracks": "true",
    "loss of active material": "stress-driven",
    "stress-induced diffusion": ("false", "false"),
}
EFFECTS: Mapping[str, Mapping[str, Any]] = {
    "sei": SEI,
    "film": SEI | {"SEI film resistance": "distributed"},
    "plating": {
        "SEI": "constant",
        "SEI film resistance": "none",
        "lithium plating": "partially reversible",
    },
    "cracking": CRACKS,
    "crack_sei": SEI | CRACKS | {"SEI on cracks": "true"},
    "lam": {
        "particle mechanics": "swelling only",
        "loss of active material": "stress-driven",
        "stress-induced diffusion": ("false", "false"),
    },
    "all": ALL,
    "negative": ALL
    | {
        "particle mechanics": ("swelling and cracking", "none"),
        "loss of active material": ("stress-driven", "none"),
    },
    "stress_diffusion": ALL | {"stress-induced diffusion": ("true", "true")},
}
"""What is switched on, by the name it has in the cases; PyBaMM's options for it."""


@dataclass(frozen=True, slots=True, eq=False)
class AgeingAnswer:
    """What PyBaMM says at the samples: each output (n,), and its integrator's seconds."""

    outputs: Mapping[str, FloatArray]
    solve_s: float


def parameters(file: Path, *, charge: float) -> pybamm.ParameterValues:
    """The file's cell at a state of charge (0 to 1), with the degradation of O'Kane 2022."""
    values = pybamm.ParameterValues.create_from_bpx(str(file), target_soc=charge)
    values.update(okane(), check_already_exists=False)
    return values


def solve_ageing(
    file: Path,
    time_s: FloatArray,
    current_A: FloatArray,
    *,
    charge: float,
    effects: str,
    thermal: str,
    mesh: Mesh,
    tolerance: tuple[float, float] | None,
) -> AgeingAnswer:
    """One load from a rested cell; the current runs straight between the samples.

    Args:
        file: BPX.
        time_s: (n,) samples.
        current_A: (n,) discharge positive.
        charge: state of charge at the start.
        effects: a key of EFFECTS.
        thermal: "isothermal" or "lumped".
        mesh: as for the plain model.
        tolerance: relative and absolute; None is PyBaMM's own.
    """
    model = pybamm.lithium_ion.DFN(dict(EFFECTS[effects]) | {"thermal": thermal})
    model.events = []
    values = parameters(file, charge=charge)
    steady = np.ptp(current_A) == 0
    values["Current function [A]"] = (
        float(current_A[0])
        if steady
        else pybamm.Interpolant(time_s, current_A, pybamm.t, interpolator="linear")
    )
    points = dict.fromkeys(("x_n", "x_s", "x_p"), mesh.layer)
    points |= {"r_n": mesh.particle, "r_p": mesh.particle}
    submesh = dict(model.default_submesh_types)
    if mesh.graded:
        for domain in (
            "negative electrode", "separator", "positive electrode",
            "negative particle", "positive particle",
        ):  # fmt: skip
            submesh[domain] = pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh)
    limits = {} if tolerance is None else {"rtol": tolerance[0], "atol": tolerance[1]}
    sim = pybamm.Simulation(
        model,
        parameter_values=values,
        var_pts=points,
        submesh_types=submesh,
        solver=pybamm.IDAKLUSolver(**limits, options={"max_num_steps": 10**6}),
    )
    stops = time_s[[0, -1]] if steady else time_s
    solution = sim.solve(stops, t_interp=time_s)
    return AgeingAnswer(_outputs(solution, values), float(solution.solve_time.value))


def _outputs(solution: pybamm.Solution, values: pybamm.ParameterValues) -> dict[str, FloatArray]:
    """Named as in the stored files."""

    def over_time(name: str) -> FloatArray:
        if name not in solution.all_models[0].variables:
            return np.zeros(solution.t.size)
        return np.broadcast_to(np.asarray(solution[name].entries, float), solution.t.shape).copy()

    thickness = values["Negative electrode thickness [m]"]
    area = values["Electrode height [m]"] * values["Electrode width [m]"]
    volume = float(thickness * area)

    def at_separator(name: str) -> FloatArray:
        return np.asarray(solution[name](t=solution.t, x=thickness), float).ravel()

    plating_V = np.asarray(solution["Negative electrode surface potential difference [V]"].entries)
    film = solution["Negative electrode SEI film overpotential [V]"].entries
    av, gone = "Volume-averaged negative", "Loss of lithium"
    solid, lost = "active material volume fraction", "loss of active material in"
    return {
        "voltage_V": over_time("Terminal voltage [V]"),
        "temperature_K": over_time("Volume-averaged cell temperature [K]"),
        "sei_mol": over_time(f"{gone} to negative SEI [mol]"),
        "crack_sei_mol": over_time(f"{gone} to negative SEI on cracks [mol]"),
        "plated_mol": over_time(f"{av} lithium plating concentration [mol.m-3]") * volume,
        "dead_mol": over_time(f"{av} dead lithium concentration [mol.m-3]") * volume,
        "trapped_negative_mol": over_time(f"{gone} due to {lost} negative electrode [mol]"),
        "trapped_positive_mol": over_time(f"{gone} due to {lost} positive electrode [mol]"),
        "particles_mol": over_time("Total lithium in particles [mol]"),
        "electrolyte_mol": over_time("Total lithium in electrolyte [mol]"),
        "active_negative": over_time(f"X-averaged negative electrode {solid}"),
        "active_positive": over_time(f"X-averaged positive electrode {solid}"),
        "crack_mean_m": over_time("X-averaged negative particle crack length [m]"),
        "crack_separator_m": at_separator("Negative particle crack length [m]"),
        "porosity_mean": over_time("X-averaged negative electrode porosity"),
        "porosity_separator": at_separator("Negative electrode porosity"),
        "sei_thickness_m": over_time("X-averaged negative SEI thickness [m]"),
        "plating_overpotential_V": (plating_V + film).min(axis=0),
    }
