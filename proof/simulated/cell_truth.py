"""What one cell truly is, in PyBaMM's terms, and its DFN's answer to a current."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt
import pybamm
from scipy.optimize import brentq

FloatArray = npt.NDArray[np.float64]

SIDES = ("Negative", "Positive")
POINTS: Mapping[str, Mapping[str, int]] = {  # README.md: what is left of the error
    "lipo_2200": {"x_n": 12, "x_s": 6, "x_p": 12, "r_n": 40, "r_p": 40},
    "lg_m50": {"x_n": 20, "x_s": 6, "x_p": 20, "r_n": 40, "r_p": 80},
}
TOLERANCE = 1e-5
FROM_OKANE = (
    "SEI", "Bulk solvent", "Ratio of lithium moles", "plating", "stripping", "plated",
    "Lithium metal partial", "Dead lithium", "Poisson", "Young", "partial molar",
    "free of deformation", "volume change", "crack", "Paris", "LAM", "critical stress",
    "thermal expansion",
)  # fmt: skip
"""Words in the names of the parameters that come from OKane2022; the rest is the file's."""
HYSTERESIS_DECAY = 25.0  # per stoichiometry
FEATURE_AT, FEATURE_WIDTH = 0.5, 0.02  # stoichiometry of the positive electrode


@dataclass(frozen=True, slots=True, kw_only=True)
class CellTruth:
    """A cell as it is; the defaults are the cell of the file. Its `repr` says all there is.

    Attributes:
        cell: built-in BPX file.
        soc: at the start, of the window between the file's voltages at rest.
        start_K: temperature at the start; without heat it is that of the air.
        ambient_K: of the air.
        heat_transfer_W_m2_K: to the air; None is isothermal.
        scaled: PyBaMM parameter (number or function) and what it is multiplied with.
        lithium_left: cyclable lithium of the full cell over that of the file.
        material_left: active material of the two electrodes over that of the file, lost when full.
        film_ohm_m2: of a film on the negative particles.
        contact_ohm: in series.
        plated_mol_m3: metallic lithium at the start, which strips reversibly; None: no plating.
        half_gap_V: between the branches of the two electrodes; None: no hysteresis.
        double_layer_F_m2: in both electrodes; None: none.
        feature_V: height of a bump in the positive open-circuit potential.
    """

    cell: str
    soc: float
    start_K: float
    ambient_K: float
    heat_transfer_W_m2_K: float | None = None
    scaled: tuple[tuple[str, float], ...] = ()
    lithium_left: float = 1.0
    material_left: tuple[float, float] = (1.0, 1.0)
    film_ohm_m2: float = 0.0
    contact_ohm: float = 0.0
    plated_mol_m3: float | None = None
    half_gap_V: tuple[float, float] | None = None
    double_layer_F_m2: float | None = None
    feature_V: float = 0.0

    def options(self) -> dict[str, str]:
        """PyBaMM's, for what is switched on."""
        chosen = {"thermal": "isothermal" if self.heat_transfer_W_m2_K is None else "lumped"}
        if self.film_ohm_m2:
            chosen |= {"SEI": "constant", "SEI film resistance": "distributed"}
        if self.contact_ohm:
            chosen |= {"contact resistance": "true"}
        if self.plated_mol_m3 is not None:
            chosen |= {"lithium plating": "reversible"}
        if self.half_gap_V is not None:
            chosen |= {"open-circuit potential": "one-state hysteresis"}
        if self.double_layer_F_m2 is not None:
            chosen |= {"surface form": "differential"}
        return chosen

    def values(self) -> pybamm.ParameterValues:
        """PyBaMM's parameters, without a current."""
        file = resources.files("twin") / "cells" / f"{self.cell}.bpx.json"
        with resources.as_file(file) as path, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the readers, about themselves
            values = pybamm.ParameterValues.create_from_bpx(str(path))
        new = okane() | {
            "Initial temperature [K]": self.start_K,
            "Ambient temperature [K]": self.ambient_K,
            "Total heat transfer coefficient [W.m-2.K-1]": self.heat_transfer_W_m2_K or 0.0,
            "Contact resistance [Ohm]": self.contact_ohm,
            "Initial plated lithium concentration [mol.m-3]": self.plated_mol_m3 or 0.0,
            "SEI resistivity [Ohm.m]": self.film_ohm_m2 / 5e-9,
            "Initial SEI thickness [m]": 5e-9,
        }
        for side in SIDES:
            capacity = f"{side} electrode double-layer capacity [F.m-2]"
            new[capacity] = self.double_layer_F_m2 or 0.0
        values.update(new, check_already_exists=False)
        for name, factor in self.scaled:
            values[name] = _times(values[name], factor)
        self._set_material(values)
        self._set_potentials(values)
        return values

    def _set_material(self, values: pybamm.ParameterValues) -> None:
        """Less of it, and how much lithium is where at the start."""
        full, empty = _rest_voltages(values)
        windows = [_window(values, side) for side in SIDES]
        for side, left in zip(SIDES, self.material_left, strict=True):
            values[f"{side} electrode active material volume fraction"] *= left
        sizes = [_lattice(values, side) for side in SIDES]
        inventory = self.lithium_left * sum(
            w[0] * size for w, size in zip(windows, sizes, strict=True)
        )
        ends = [_at_rest(values, voltage, inventory, sizes) for voltage in (full, empty)]
        for k, side in enumerate(SIDES):
            at_start = ends[1][k] + self.soc * (ends[0][k] - ends[1][k])
            most = values[f"Maximum concentration in {side.lower()} electrode [mol.m-3]"]
            values[f"Initial concentration in {side.lower()} electrode [mol.m-3]"] = at_start * most

    def _set_potentials(self, values: pybamm.ParameterValues) -> None:
        """Branches, and the bump."""
        if self.feature_V:
            name = "Positive electrode OCP [V]"
            values[name] = partial(_with_feature, values[name], self.feature_V)
        for k, side in enumerate(SIDES if self.half_gap_V is not None else ()):
            assert self.half_gap_V is not None
            gap, middle = self.half_gap_V[k], values[f"{side} electrode OCP [V]"]
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
        model = pybamm.lithium_ion.DFN(truth.options())
        model.events = []
        values = truth.values()
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
