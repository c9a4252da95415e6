"""The numbers of a cell that the kernel takes as inputs, by name: whatever may be fitted or age."""

from collections.abc import Iterable, Mapping
from dataclasses import fields

import casadi as ca
import numpy as np

from twin.bumps import bump_names
from twin.cell import Cell
from twin.effects import AGEING, AnyEffect, Mechanics, OcvHysteresis

SCALARS_OF_CELL = (
    "area_m2",
    "reference_K",
    "heat_capacity_J_K",
    "cooling_area_m2",
)


def ageing_parameters(
    effects: Iterable[AnyEffect] = (), mechanics: Mechanics | None = None
) -> dict[str, float]:
    """The same for the effects that age the cell; those not in `effects` have strength 0."""
    chosen = {type(e): e for e in effects}
    out: dict[str, float] = {}
    for kind in AGEING:
        effect = chosen.get(kind, kind(strength=0.0))
        out |= {f"{effect.id}.{f.name}": float(getattr(effect, f.name)) for f in fields(effect)}
    return out | mechanics_parameters(mechanics or Mechanics())


def mechanics_parameters(mechanics: Mechanics) -> dict[str, float]:
    """The elastic constants by name, e.g. `mechanics.negative_modulus_Pa`."""
    return {f"mechanics.{f.name}": getattr(mechanics, f.name) for f in fields(mechanics)}


def hysteresis_parameters(cell: Cell, effect: OcvHysteresis) -> dict[str, float]:
    """The same for hysteresis, e.g. `ocv_hysteresis.negative_start`.

    An electrode whose branches the cell's file has takes its decay from there and has no amplitude.
    """
    numbers = {f.name: float(getattr(effect, f.name)) for f in fields(effect)}
    for side in ("negative", "positive"):
        if (branches := cell.hysteresis(side)) is not None:
            del numbers[f"{side}_amplitude_V"]
            numbers[f"{side}_decay"] = branches.decay
    return {f"{effect.id}.{name}": value for name, value in numbers.items()}


def cell_parameters(cell: Cell) -> dict[str, float]:
    """Name -> value, e.g. `negative.thickness_m`, in a fixed order.

    Every number of `Cell` that enters the equations. Functions (potentials, conductivity,
    diffusivity) are part of the kernel and have a factor here, 1 as given:
    `negative.diffusivity_factor`, `electrolyte.conductivity_factor`, ... Resistances that a cell
    does not have by itself are 0, and so are the heights of bumps.
    """
    out: dict[str, float] = {name: getattr(cell, name) for name in SCALARS_OF_CELL}
    for part in ("negative", "separator", "positive", "electrolyte"):
        owner = getattr(cell, part)
        for f in fields(owner):
            value = getattr(owner, f.name)
            if not callable(value):
                out[f"{part}.{f.name}"] = float(value)
    for side in ("negative", "positive"):
        out[f"{side}.diffusivity_factor"] = 1.0
        out[f"{side}.film_ohm_m2"] = 0.0
    for name in ("electrolyte.conductivity", "electrolyte.diffusivity"):
        out[f"{name}_factor"] = 1.0
    out["series_resistance_ohm"] = 0.0
    out["outside_ohm"] = 0.0  # of it, what does not warm the cell
    return out | dict.fromkeys(bump_names(cell), 0.0)


class Symbols(Mapping[str, ca.SX]):
    """The same names as symbols; `vector` is the kernel's input."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.vector = ca.SX.sym("p", len(names))
        self._index = {name: i for i, name in enumerate(names)}

    def __getitem__(self, name: str) -> ca.SX:
        return self.vector[self._index[name]]

    def __iter__(self):  # type: ignore[no-untyped-def]
        return iter(self._index)

    def __len__(self) -> int:
        return len(self._index)


def vector(values: Mapping[str, float]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The kernel's parameter input (n,), in the order of `values`."""
    return np.array(list(values.values()), dtype=float)
