"""Cells that nobody knows: the numbers of Table I drawn at random, as BPX files.

Drawn, each on its own: the numbers of RANGES, how full the negative electrode is when charged, and
how far below the cut-off a charged cell rests (a charger stops at some small current).
Everything else follows, so that the cell is one that could be built and cycled:
  active material 1 - porosity - filler, and from it the specific area a = 3 eps_s / R: the area is
    the dependent number (spheres leave no choice, and BPX has no other);
  transport efficiency by the built-in cell's exponent, B = eps ** b;
  the other three ends of the stoichiometry windows: the rest voltage when charged, the built-in
    cell's open-circuit voltage at 0 %, and both windows hold the same charge. So of the four ends
    two are free.
Drawn again where that cannot be met, or where the charge is not within RATED of what is printed on
the cell.
"""

import copy
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import brentq

from twin.at_rest import open_circuit_V
from twin.builtin import builtin_text, load_cell
from twin.cell import Cell, Electrode
from twin.constants import FARADAY_C_mol

SIDES = ("negative", "positive")
FULLEST = (0.80, 0.92)  # stoichiometry of the charged negative electrode
SAG_V = 0.03  # of a charged cell's rest voltage, at most
RATED = 0.08  # of the nominal capacity: what a pack of this label may hold more or less
EDGE = 0.003, 0.97  # no electrode goes beyond: the potentials are not known there
RANGES: Mapping[str, tuple[str, float]] = {
    "negative.particle_radius_m": ("factor", 1.4),
    "positive.particle_radius_m": ("factor", 1.4),
    "negative.conductivity_S_m": ("factor", 2.0),
    "positive.conductivity_S_m": ("factor", 2.0),
    "negative.porosity": ("shift", 0.05),
    "separator.porosity": ("shift", 0.06),
    "positive.porosity": ("shift", 0.05),
    "negative.filler": ("shift", 0.03),
    "positive.filler": ("shift", 0.03),
    "negative.diffusivity_factor": ("factor", 2.0),
    "positive.diffusivity_factor": ("factor", 2.0),
    "electrolyte.diffusivity_factor": ("factor", 1.4),
    "electrolyte.initial_concentration_mol_m3": ("factor", 1.2),
    "negative.rate_constant_mol_m2_s": ("factor", 2.5),
    "positive.rate_constant_mol_m2_s": ("factor", 2.5),
}
"""Name -> how far from the built-in cell at most: a factor either way, uniform in the logarithm, or
a shift either way, uniform (fillers below zero are mirrored). The rate constant is the reference
exchange current over Faraday's constant."""


class Impossible(ValueError):
    """These numbers make no cell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """A hidden cell.

    Attributes:
        bpx: its BPX document.
        numbers: all that differs from the built-in cell, by the kernel's names, factors relative
            to it; and `filler`, the volume share of what is neither pore nor active.
    """

    bpx: dict[str, Any]
    numbers: dict[str, float]


def draw(cell_name: str, seed: int) -> Truth:
    """The cell of this seed, near the built-in one."""
    random = np.random.default_rng(seed)
    while True:
        try:
            numbers = _draw(load_cell(cell_name), random)
            fullest, sag_V = random.uniform(*FULLEST), random.uniform(0.0, SAG_V)
            return truth(cell_name, numbers, fullest=fullest, sag_V=sag_V)
        except Impossible:
            continue


def known(cell: Cell) -> dict[str, float]:
    """The numbers of RANGES as a cell has them."""
    out: dict[str, float] = {}
    for name in RANGES:
        part, field = name.split(".")
        if field.endswith("_factor"):
            out[name] = 1.0
        elif field == "filler":
            side: Electrode = getattr(cell, part)
            out[name] = 1 - side.porosity - side.specific_area_m2_m3 * side.particle_radius_m / 3
        else:
            out[name] = getattr(getattr(cell, part), field)
    return out


def _draw(cell: Cell, random: np.random.Generator) -> dict[str, float]:
    out = {}
    for name, value in known(cell).items():
        kind, width = RANGES[name]
        share = random.uniform(-1.0, 1.0)
        out[name] = value * width**share if kind == "factor" else abs(value + share * width)
    return out


def truth(cell_name: str, numbers: Mapping[str, float], *, fullest: float, sag_V: float) -> Truth:
    """The built-in cell with the numbers of RANGES; Impossible if they make none."""
    cell = load_cell(cell_name)
    active = {s: 1 - numbers[f"{s}.porosity"] - numbers[f"{s}.filler"] for s in SIDES}
    windows = _windows(cell, active, fullest=fullest, sag_V=sag_V)
    derived: dict[str, float] = {}
    for side in SIDES:
        derived[f"{side}.specific_area_m2_m3"] = (
            3 * active[side] / numbers[f"{side}.particle_radius_m"]
        )
        low, high = windows[side]
        derived |= {f"{side}.stoichiometry_min": low, f"{side}.stoichiometry_max": high}
    for part in ("negative", "separator", "positive"):
        known_part = getattr(cell, part)
        exponent = math.log(known_part.transport_efficiency) / math.log(known_part.porosity)
        derived[f"{part}.transport_efficiency"] = numbers[f"{part}.porosity"] ** exponent
    every = {**numbers, **derived}
    return Truth(bpx=_document(cell_name, every), numbers=every)


def _windows(
    cell: Cell, active: Mapping[str, float], *, fullest: float, sag_V: float
) -> dict[str, tuple[float, float]]:
    """Ends (empty, full for the negative) of both stoichiometry windows."""
    u_n, u_p = (_potential(getattr(cell, s)) for s in SIDES)
    full_V, empty_V = (open_circuit_V(cell, soc) for soc in (1.0, 0.0))
    least, most = EDGE
    low_p = _root(lambda y: u_p(y) - u_n(fullest) - full_V + sag_V, least, most)
    per_unit_C = {
        s: FARADAY_C_mol * e.max_concentration_mol_m3 * e.thickness_m * cell.area_m2 * active[s]
        for s, e in ((s, getattr(cell, s)) for s in SIDES)
    }
    ratio = per_unit_C["negative"] / per_unit_C["positive"]
    deepest = min(fullest - least, (most - low_p) / ratio)
    drop = _root(lambda d: u_p(low_p + ratio * d) - u_n(fullest - d) - empty_V, 0.3, deepest)
    capacity_C = drop * per_unit_C["negative"]
    if abs(capacity_C / cell.nominal_capacity_C - 1) > RATED:
        raise Impossible(f"{capacity_C / 3600:.2f} Ah")
    return {"negative": (fullest - drop, fullest), "positive": (low_p, low_p + ratio * drop)}


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    if not (low < high and function(low) * function(high) < 0):
        raise Impossible("no such open-circuit voltage")
    return float(brentq(function, low, high, xtol=1e-12))


def _potential(side: Electrode) -> Callable[[float], float]:
    return lambda x: float(ca.evalf(side.ocp_V(ca.SX(x))))


def _document(cell_name: str, numbers: Mapping[str, float]) -> dict[str, Any]:
    """The built-in cell's BPX document with other numbers."""
    document: dict[str, Any] = copy.deepcopy(json.loads(builtin_text(cell_name)))
    document["Header"]["Title"] += ", varied at random"
    parts = document["Parameterisation"]
    for part in ("Negative electrode", "Separator", "Positive electrode"):
        block, prefix = parts[part], part.split()[0].lower()
        block["Porosity"] = numbers[f"{prefix}.porosity"]
        block["Transport efficiency"] = numbers[f"{prefix}.transport_efficiency"]
        if prefix == "separator":
            continue
        for field, ours in FIELDS.items():
            block[field] = numbers[f"{prefix}.{ours}"]
        block["Diffusivity [m2.s-1]"] *= numbers[f"{prefix}.diffusivity_factor"]
    salt = parts["Electrolyte"]
    factor = numbers["electrolyte.diffusivity_factor"]
    salt["Diffusivity [m2.s-1]"] = f"{factor!r} * ({salt['Diffusivity [m2.s-1]']})"
    start = document["State"]["Initial conditions"]
    start["Initial electrolyte concentration [mol.m-3]"] = numbers[
        "electrolyte.initial_concentration_mol_m3"
    ]
    return document


FIELDS = {
    "Conductivity [S.m-1]": "conductivity_S_m",
    "Minimum stoichiometry": "stoichiometry_min",
    "Maximum stoichiometry": "stoichiometry_max",
    "Particle radius [m]": "particle_radius_m",
    "Surface area per unit volume [m-1]": "specific_area_m2_m3",
    "Reaction rate constant [mol.m-2.s-1]": "rate_constant_mol_m2_s",
}
"""BPX field of an electrode -> the kernel's name."""
