"""A cell's truth in PyBaMM's terms, and its Doyle-Fuller-Newman model's answer to a current."""

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt
import pybamm
from scipy.optimize import brentq

from proof.simulated.cell_truth import CellTruth

FloatArray = npt.NDArray[np.float64]

SIDES = ("Negative", "Positive")
POINTS: Mapping[str, Mapping[str, int]] = {
    "lipo_2200": {"x_n": 12, "x_s": 6, "x_p": 12, "r_n": 40, "r_p": 40},
    "lg_m50": {"x_n": 42, "x_s": 6, "x_p": 38, "r_n": 40, "r_p": 80},
}
"""Cells of one thickness, or nearly, in the three layers: on 20, 6 and 20 points, half as thick in
the separator, the LG M50 is 0.45 mV from the twin at 1C, on 21, 3 and 19 0.18, on these 0.08."""
TOLERANCE = 1e-4
"""0.02 to 0.07 mV a cell from 1e-8, in two thirds of the time of 1e-5."""
EQUATIONS = 3  # of the model as it is built here: raise it where the same truth has another answer
FROM_OKANE = (
    "SEI", "Bulk solvent", "Ratio of lithium moles", "plating", "stripping", "plated",
    "Lithium metal partial", "Dead lithium", "Poisson", "Young", "partial molar",
    "free of deformation", "volume change", "crack", "Paris", "LAM", "critical stress",
    "thermal expansion",
)  # fmt: skip
"""Words in the names of the parameters that come from OKane2022; the rest is the file's."""
HYSTERESIS_DECAY = 25.0  # per stoichiometry
FEATURE_AT, FEATURE_WIDTH = 0.5, 0.02  # stoichiometry of the positive electrode


def options(truth: CellTruth) -> dict[str, str]:
    """PyBaMM's, for what is switched on."""
    chosen = {"thermal": "isothermal" if truth.heat_transfer_W_m2_K is None else "lumped"}
    if truth.film_ohm_m2:
        chosen |= {"SEI": "constant", "SEI film resistance": "distributed"}
    if truth.contact_ohm:
        chosen |= {"contact resistance": "true"}
    if truth.plated_mol_m3 is not None:
        chosen |= {"lithium plating": "reversible"}
    if truth.half_gap_V is not None:
        chosen |= {"open-circuit potential": "one-state hysteresis"}
    if truth.double_layer_F_m2 is not None:
        chosen |= {"surface form": "differential"}
    return chosen


def values_of(truth: CellTruth) -> pybamm.ParameterValues:
    """PyBaMM's parameters, without a current."""
    file = resources.files("twin") / "cells" / f"{truth.cell}.bpx.json"
    with resources.as_file(file) as path, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the readers, about themselves
        values = pybamm.ParameterValues.create_from_bpx(str(path))
    new = okane() | {
        "Initial temperature [K]": truth.start_K,
        "Ambient temperature [K]": truth.ambient_K,
        "Total heat transfer coefficient [W.m-2.K-1]": truth.heat_transfer_W_m2_K or 0.0,
        "Contact resistance [Ohm]": truth.contact_ohm,
        "Initial plated lithium concentration [mol.m-3]": truth.plated_mol_m3 or 0.0,
        "SEI resistivity [Ohm.m]": truth.film_ohm_m2 / 5e-9,
        "Initial SEI thickness [m]": 5e-9,
    }
    for side in SIDES:
        capacity = f"{side} electrode double-layer capacity [F.m-2]"
        new[capacity] = truth.double_layer_F_m2 or 0.0
    values.update(new, check_already_exists=False)
    for name, factor in truth.scaled:
        values[name] = _times(values[name], factor)
    _set_material(truth, values)
    _set_potentials(truth, values)
    return values


def _set_material(truth: CellTruth, values: pybamm.ParameterValues) -> None:
    """Less of it, and how much lithium is where at the start."""
    full, empty = _rest_voltages(values)
    windows = [_window(values, side) for side in SIDES]
    for side, left in zip(SIDES, truth.material_left, strict=True):
        values[f"{side} electrode active material volume fraction"] *= left
    sizes = [_lattice(values, side) for side in SIDES]
    inventory = truth.lithium_left * sum(
        w[0] * size for w, size in zip(windows, sizes, strict=True)
    )
    ends = [_at_rest(values, voltage, inventory, sizes) for voltage in (full, empty)]
    for k, side in enumerate(SIDES):
        at_start = ends[1][k] + truth.soc * (ends[0][k] - ends[1][k])
        most = values[f"Maximum concentration in {side.lower()} electrode [mol.m-3]"]
        values[f"Initial concentration in {side.lower()} electrode [mol.m-3]"] = at_start * most


def _set_potentials(truth: CellTruth, values: pybamm.ParameterValues) -> None:
    """Branches, and the bump."""
    if truth.feature_V:
        name = "Positive electrode OCP [V]"
        values[name] = partial(_with_feature, values[name], truth.feature_V)
    for k, side in enumerate(SIDES if truth.half_gap_V is not None else ()):
        assert truth.half_gap_V is not None
        gap, middle = truth.half_gap_V[k], values[f"{side} electrode OCP [V]"]
        new = {
            f"{side} electrode lithiation OCP [V]": partial(_shifted, middle, -gap),
            f"{side} electrode delithiation OCP [V]": partial(_shifted, middle, gap),
            f"{side} particle lithiation hysteresis decay rate": HYSTERESIS_DECAY,
            f"{side} particle delithiation hysteresis decay rate": HYSTERESIS_DECAY,
            # as a charge leaves them
            f"Initial hysteresis state in {side.lower()} electrode": (-1.0, 1.0)[k],
        }
        values.update(new, check_already_exists=False)


def solve(
    truth: CellTruth,
    time_s: FloatArray,
    current_A: FloatArray,
    *,
    finer: int = 1,
    tolerance: float = TOLERANCE,
) -> tuple[FloatArray, FloatArray]:
    """Voltage (n,) and temperature (n,) [K] of the cell; the current runs straight between samples.

    `finer` times the points of POINTS in every direction. Raises pybamm.SolverError where the cell
    cannot give the current.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyBaMM's own, about its own defaults
        model = pybamm.lithium_ion.DFN(options(truth))
        model.events = []
        if truth.heat_transfer_W_m2_K is not None:
            _warm(model, _left_out_W_m3(model, truth))
        values = values_of(truth)
        values["Current function [A]"] = pybamm.Interpolant(time_s, current_A, pybamm.t)
        graded = pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh)  # the skin of a particle is thin
        submesh = dict(model.default_submesh_types)
        submesh |= {f"{side.lower()} particle": graded for side in SIDES}
        solution = pybamm.Simulation(
            model,
            parameter_values=values,
            var_pts={name: finer * n for name, n in POINTS[truth.cell].items()},
            submesh_types=submesh,
            solver=pybamm.IDAKLUSolver(
                rtol=tolerance, atol=tolerance, options={"max_num_steps": 10**6}
            ),
        ).solve(time_s, t_interp=time_s)
    names = ("Voltage [V]", "Volume-averaged cell temperature [K]")
    voltage, temperature = (np.asarray(solution[name].entries, dtype=float) for name in names)
    return voltage, temperature


def _left_out_W_m3(model: pybamm.BaseModel, truth: CellTruth) -> list[pybamm.Symbol]:
    """Heats of the negative electrode that PyBaMM 26.10 leaves out of its sum, each > 0.

    Of plating and stripping, and of a film on the particles: current times overpotential, as of any
    reaction or resistance (Bernardi, Pawlikowski, Newman, J. Electrochem. Soc. 132, 5 (1985)).
    """
    side, current = "Negative electrode ", "volumetric interfacial current density [A.m-3]"
    plating, told = side + "lithium plating ", model.variables
    heats = []
    if truth.plated_mol_m3 is not None:
        heats.append(told[plating + current] * told[plating + "reaction overpotential [V]"])
    if truth.film_ohm_m2:
        heats.append(-told[side + current] * told[side + "SEI film overpotential [V]"])
    return heats


def _warm(model: pybamm.BaseModel, heats_W_m3: list[pybamm.Symbol]) -> None:
    """Adds heats of the negative electrode to the lumped temperature of `model`."""
    param = model.param
    volume_m3 = param.n.L * param.n_electrodes_parallel * param.L_y * param.L_z
    capacity_J_K = (
        param.V_cell * model.variables["Volume-averaged effective heat capacity [J.K-1.m-3]"]
    )
    temperature = model.variables["Volume-averaged cell temperature [K]"]
    for heat_W_m3 in heats_W_m3:
        model.rhs[temperature] += pybamm.x_average(heat_W_m3) * volume_m3 / capacity_J_K


def okane() -> dict[str, Any]:
    """Of degradation and mechanics, which a BPX file does not have, from OKane2022."""
    known = pybamm.ParameterValues("OKane2022")
    return {k: known[k] for k in known if any(word in k for word in FROM_OKANE)}


def _times(value: Any, factor: float) -> Any:
    return partial(_scaled, value, factor) if callable(value) else value * factor


def _scaled(function: Callable[..., Any], factor: float, *arguments: Any) -> Any:
    return factor * function(*arguments)


def _shifted(function: Callable[..., Any], volts: float, x: Any) -> Any:
    return function(x) + volts


def _with_feature(function: Callable[..., Any], volts: float, x: Any) -> Any:
    return function(x) + volts * pybamm.exp(-(((x - FEATURE_AT) / FEATURE_WIDTH) ** 2))


def _window(values: pybamm.ParameterValues, side: str) -> tuple[float, float]:
    """Stoichiometry full and empty, in the file."""
    low, high = (values[f"{side} electrode {end} stoichiometry"] for end in ("minimum", "maximum"))
    return (high, low) if side == "Negative" else (low, high)


def _lattice(values: pybamm.ParameterValues, side: str) -> float:
    """Places for lithium per coated area [mol/m2]."""
    return float(
        values[f"{side} electrode active material volume fraction"]
        * values[f"{side} electrode thickness [m]"]
        * values[f"Maximum concentration in {side.lower()} electrode [mol.m-3]"]
    )


def _rest_V(values: pybamm.ParameterValues, x: float, y: float) -> float:
    negative, positive = (values[f"{side} electrode OCP [V]"] for side in SIDES)
    return float((positive(pybamm.Scalar(y)) - negative(pybamm.Scalar(x))).evaluate())


def _rest_voltages(values: pybamm.ParameterValues) -> tuple[float, float]:
    x, y = (_window(values, side) for side in SIDES)
    return _rest_V(values, x[0], y[0]), _rest_V(values, x[1], y[1])


def _at_rest(
    values: pybamm.ParameterValues, volts: float, inventory: float, sizes: list[float]
) -> tuple[float, float]:
    """Stoichiometries of both electrodes where a cell of so much lithium rests at `volts`."""

    def y(x: float) -> float:
        return (inventory - x * sizes[0]) / sizes[1]

    # between an empty and a full lattice of either electrode
    low = max(1e-4, (inventory - 0.9999 * sizes[1]) / sizes[0])
    high = min(0.9999, (inventory - 1e-4 * sizes[1]) / sizes[0])
    x = brentq(lambda x: _rest_V(values, x, y(x)) - volts, low, high, xtol=1e-10)
    return x, y(x)
