"""`Cell` -> BPX text: what `bpx_file.read_bpx` reads, and other tools."""

import json
from typing import Any

import casadi as ca
import numpy as np

from twin.bpx_function import Constant, Expression, Table
from twin.cell import Cell, Electrode, Function, Hysteresis

HEAT_J_K_kg = 1000.0
"""Specific heat capacity as it is written: of a `Cell` only its product with the mass is known."""


def write_bpx(cell: Cell, *, description: str) -> str:
    """The file of `cell`, BPX 1.0, as JSON; TypeError if a function is none that BPX has.

    The coated area is written as that of a single pair of electrodes. Density and specific heat
    capacity are such that the cell's heat capacity is right.
    """
    document = {
        "Header": {
            "BPX": "1.0.0",
            "Title": cell.name,
            "Description": description,
            "References": cell.source,
            "Model": "DFN",
        },
        "Parameterisation": {
            "Cell": _cell(cell),
            "Electrolyte": {
                "Cation transference number": cell.electrolyte.transference,
                "Diffusivity [m2.s-1]": _written(cell.electrolyte.diffusivity_m2_s),
                "Diffusivity activation energy [J.mol-1]":
                    cell.electrolyte.diffusivity_activation_J_mol,
                "Conductivity [S.m-1]": _written(cell.electrolyte.conductivity_S_m),
                "Conductivity activation energy [J.mol-1]":
                    cell.electrolyte.conductivity_activation_J_mol,
            },
            "Negative electrode": _electrode(cell.negative, cell.negative_hysteresis),
            "Separator": {
                "Thickness [m]": cell.separator.thickness_m,
                "Porosity": cell.separator.porosity,
                "Transport efficiency": cell.separator.transport_efficiency,
            },
            "Positive electrode": _electrode(cell.positive, cell.positive_hysteresis),
        },
        "State": {
            "Initial conditions": {
                "Initial state-of-charge": 1.0,
                "Initial temperature [K]": cell.reference_K,
                "Initial electrolyte concentration [mol.m-3]":
                    cell.electrolyte.initial_concentration_mol_m3,
            },
            "Thermal environment": {
                "Ambient temperature [K]": cell.reference_K,
                "Heat transfer coefficient [W.m-2.K-1]": 10.0,
            },
        },
    }  # fmt: skip
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def scaled(function: Function, factor: float) -> Function:
    """`factor` times a function as BPX writes them."""
    match function:
        case Constant(value=value):
            return Constant(factor * value)
        case Expression(text=text):
            return Expression(f"{factor!r} * ({text})")
        case Table(x=x, y=y):
            return Table(x, tuple(factor * value for value in y))
    raise TypeError(f"{function!r}: no function that BPX can write")


def plus(function: Function, added: Expression, row_every: float) -> Function:
    """A function as BPX writes them plus an expression.

    A table has rows at most `row_every` apart: straight lines between them, as other tools draw
    them, have to follow what is added.
    """
    match function:
        case Constant(value=value):
            return Expression(f"{value!r} + {added.text}")
        case Expression(text=text):
            return Expression(f"({text}) + {added.text}")
        case Table(x=x):
            rows = np.union1d(x, np.arange(x[0], x[-1], row_every))
            sums = ca.evalf(function(ca.SX(rows)) + added(ca.SX(rows)))
            return Table(tuple(rows.tolist()), tuple(sums.full().ravel().tolist()))
    raise TypeError(f"{function!r}: no function that BPX can write")


def _cell(cell: Cell) -> dict[str, Any]:
    return {
        "Electrode area [m2]": cell.area_m2,
        "External surface area [m2]": cell.cooling_area_m2,
        "Volume [m3]": cell.volume_m3,
        "Number of electrode pairs connected in parallel to make a cell": 1,
        "Lower voltage cut-off [V]": cell.lower_cut_off_V,
        "Upper voltage cut-off [V]": cell.upper_cut_off_V,
        "Nominal cell capacity [A.h]": cell.nominal_capacity_C / 3600.0,
        "Reference temperature [K]": cell.reference_K,
        "Density [kg.m-3]": cell.heat_capacity_J_K / (HEAT_J_K_kg * cell.volume_m3),
        "Specific heat capacity [J.K-1.kg-1]": HEAT_J_K_kg,
    }


def _electrode(e: Electrode, hysteresis: Hysteresis | None) -> dict[str, Any]:
    out: dict[str, Any] = {
        "Thickness [m]": e.thickness_m,
        "Porosity": e.porosity,
        "Transport efficiency": e.transport_efficiency,
        "Conductivity [S.m-1]": e.conductivity_S_m,
        "Minimum stoichiometry": e.stoichiometry_min,
        "Maximum stoichiometry": e.stoichiometry_max,
        "Maximum concentration [mol.m-3]": e.max_concentration_mol_m3,
        "Particle radius [m]": e.particle_radius_m,
        "Surface area per unit volume [m-1]": e.specific_area_m2_m3,
        "Diffusivity [m2.s-1]": _written(e.diffusivity_m2_s),
        "Diffusivity activation energy [J.mol-1]": e.diffusivity_activation_J_mol,
        "OCP [V]": _written(e.ocp_V),
        "Entropic change coefficient [V.K-1]": _written(e.entropic_V_K),
        "Reaction rate constant [mol.m-2.s-1]": e.rate_constant_mol_m2_s,
        "Reaction rate constant activation energy [J.mol-1]": e.rate_activation_J_mol,
    }
    if hysteresis is not None:
        out |= {
            "OCP (lithiation) [V]": _written(hysteresis.lithiation_V),
            "OCP (delithiation) [V]": _written(hysteresis.delithiation_V),
            "OCP hysteresis decay constant": hysteresis.decay,
        }
    return out


def _written(function: Function) -> float | str | dict[str, list[float]]:
    match function:
        case Constant(value=value):
            return value
        case Expression(text=text):
            return text
        case Table(x=x, y=y):
            return {"x": list(x), "y": list(y)}
    raise TypeError(f"{function!r}: no function that BPX can write")
