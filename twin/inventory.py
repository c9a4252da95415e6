"""The state of a rested cell, and where the lithium of a state is."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from twin.degradation import DegradationSymbols
from twin.layout import Layout

FloatArray = npt.NDArray[np.float64]

SIDES = (("n", "negative"), ("p", "positive"))


def initial_state(
    layout: Layout, soc: float, temperature_K: float, values: Mapping[str, float]
) -> FloatArray:
    """A rested cell: uniform at `soc` of the stoichiometry window, no current."""
    state = np.zeros(layout.size)
    for (key, side), charge in zip(SIDES, (soc, 1.0 - soc), strict=True):
        low, high = (values[f"{side}.stoichiometry_{end}"] for end in ("min", "max"))
        modes = state[layout.slice_of(f"modes_{key}")]
        modes[: layout.layer(side).size] = low + charge * (high - low)
        surface_m2 = values["area_m2"] * values[f"{side}.thickness_m"]
        surface_m2 *= values[f"{side}.specific_area_m2_m3"]
        state[layout.slice_of(f"answer_{key}")] = (1 if key == "n" else -1) / surface_m2
    state[layout.slice_of("salt")] = values["electrolyte.initial_concentration_mol_m3"]
    state[layout.slice_of("temperature_K")] = temperature_K
    if layout.ageing:
        film, crack_film = DegradationSymbols.first_films(values)
        first = {"film": film, "crack_film": crack_film, "left_n": 1.0, "left_p": 1.0}
        first |= {"crack_m": values["cracking.initial_length_m"]}
        first |= {"porosity": values["negative.porosity"]}
        for name, value in first.items():
            state[layout.slice_of(name)] = value
    return state


def lithium_mol(layout: Layout, state: FloatArray, values: Mapping[str, float]) -> dict[str, float]:
    """Where the lithium of one cell is [mol]."""
    area = values["area_m2"]

    def total(name: str, of: str) -> float:
        nodes = layout.layer(of).size
        amount = layout.layer(of).weight @ state[layout.slice_of(name)][:nodes]
        return float(area * values[f"{of}.thickness_m"] * amount)

    out = {}
    for key, side in SIDES:
        layer = layout.layer(side)
        solid = values[f"{side}.specific_area_m2_m3"] * values[f"{side}.particle_radius_m"] / 3
        held = values[f"{side}.max_concentration_mol_m3"] * solid
        held *= area * values[f"{side}.thickness_m"]
        mean = state[layout.slice_of(f"modes_{key}")][: layer.size]
        left = state[layout.slice_of(f"left_{key}")] if layout.ageing else 1.0
        out[side] = float(held * (layer.weight @ (mean * left)))
        if layout.ageing:
            trapped = state[layout.slice_of(f"trapped_{key}")]
            out[f"trapped_{side}"] = float(held * (layer.weight @ trapped))
    out["electrolyte"] = _dissolved_mol(layout, state, values)
    if layout.ageing:
        names = {"film": "sei", "crack_film": "sei_on_cracks", "plated": "plated", "dead": "dead"}
        out |= {said: total(name, "negative") for name, said in names.items()}
    return out


def _dissolved_mol(layout: Layout, state: FloatArray, values: Mapping[str, float]) -> float:
    salt, dissolved = state[layout.slice_of("salt")], 0.0
    for name, span in layout.layers().items():
        porosity = np.array(values[f"{name}.porosity"])
        if layout.ageing and name == "negative":
            porosity = state[layout.slice_of("porosity")]
        weight = layout.layer(name).weight * values[f"{name}.thickness_m"]
        dissolved += float(values["area_m2"] * weight @ (porosity * salt[span]))
    return dissolved
