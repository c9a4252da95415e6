"""The state of a rested cell, and where the lithium of a state is."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from twin.degradation import DegradationSymbols
from twin.layout import Layout

FloatArray = npt.NDArray[np.float64]

SIDES = (("n", "negative"), ("p", "positive"))
FILMS = {"film": "sei", "crack_film": "sei_on_cracks", "plated": "plated", "dead": "dead"}
"""In the state, per volume of the negative electrode -> in the balance."""


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
        if layout.hysteretic:
            start = values[f"ocv_hysteresis.{side}_start"]
            state[layout.slice_of(f"hysteresis_{key}")] = start
    state[layout.slice_of("salt")] = values["electrolyte.initial_concentration_mol_m3"]
    state[layout.slice_of("temperature_K")] = temperature_K
    if layout.ageing:
        film, crack_film = DegradationSymbols.first_films(values)
        first = {"film": film, "crack_film": crack_film, "left_n": 1.0, "left_p": 1.0}
        first |= {"crack_m": values["cracking.initial_length_m"]}
        first |= {"porosity": values["negative.porosity"]}
        first |= {"plated": values["plating.strength"] * values["plating.initial_mol_m3"]}
        for name, value in first.items():
            state[layout.slice_of(name)] = value
    return state


class Lithium:
    """Where the lithium of one cell is: the sums, with all that a state does not change worked out.

    Raises KeyError if `values` are not those of a cell on `layout`.
    """

    def __init__(self, layout: Layout, values: Mapping[str, float]) -> None:
        self._layout = layout
        self._held: dict[str, FloatArray] = {}
        self._pores = np.zeros(layout.nodes)
        for key, side in SIDES:
            layer = layout.layer(side)
            solid = values[f"{side}.specific_area_m2_m3"] * values[f"{side}.particle_radius_m"] / 3
            volume_m3 = layer.weight * (values["area_m2"] * values[f"{side}.thickness_m"])
            self._held[key] = volume_m3 * (values[f"{side}.max_concentration_mol_m3"] * solid)
        for name, span in layout.layers().items():
            volume_m3 = (
                layout.layer(name).weight * values["area_m2"] * values[f"{name}.thickness_m"]
            )
            if layout.ageing and name == "negative":
                self._volume_m3 = volume_m3
            else:
                self._pores[span] += volume_m3 * values[f"{name}.porosity"]

    def mol(self, state: FloatArray) -> dict[str, float]:
        """Name -> amount [mol]."""
        layout, out = self._layout, {}
        for key, side in SIDES:
            held = self._held[key]
            mean = state[layout.slice_of(f"modes_{key}")][: held.size]
            if layout.ageing:
                mean = mean * state[layout.slice_of(f"left_{key}")]
                out[f"trapped_{side}"] = held @ state[layout.slice_of(f"trapped_{key}")]
            out[side] = held @ mean
        salt = state[layout.slice_of("salt")]
        out["electrolyte"] = self._pores @ salt
        if layout.ageing:
            volume = self._volume_m3
            pores = volume * state[layout.slice_of("porosity")]
            out["electrolyte"] += pores @ salt[: volume.size]
            for name, said in FILMS.items():
                out[said] = volume @ state[layout.slice_of(name)]
        return {name: float(mol) for name, mol in out.items()}
