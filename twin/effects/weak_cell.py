"""A cell in series that is not like the others: less of it, less in it, or worse connected."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class WeakCell:
    """One place in the series whose cell differs; V = sum of the cells, each under the same I.

    The cell has states of its own and warms and ages by itself; of cells side by side at its place
    all are like it. Its coated area is smaller, so it works at a higher rate; mass and surface are
    those of the others, beside which it lies. The extra resistance is that of its place in the pack
    (tabs, connectors, leads), its heat stays in the cell.

    Attributes:
        cell: place in the series, from 1; 0 where it is not known: a pack's terminals do not tell.
        capacity_factor: coated area over that of the others.
        soc_offset: state of charge at the start minus that of the others, of its own window.
        resistance_ohm: in series with it, beyond that of the others; negative where it has less.
    """

    cell: int = 0
    capacity_factor: float = 1.0
    soc_offset: float = 0.0
    resistance_ohm: float = 0.0

    id: ClassVar[str] = "weak_cell"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="capacity_factor", unit="1", value=1.0, lower=0.1, upper=1.5, prior_std=0.1),
        Parameter(name="soc_offset", unit="1", value=0.0, lower=-1.0, upper=1.0, prior_std=0.05),
        Parameter(
            name="resistance_ohm", unit="Ohm", value=0.0, lower=-0.5, upper=0.5, prior_std=5e-3
        ),
    )
    balance: ClassVar[str] = "none: one cell of the series has its own of all"
    equation: ClassVar[str] = (
        r"V = \sum_{k \neq w} V_k(I) + V_w(I),\quad A_w = f A,\quad "
        r"\mathrm{SOC}_w(0) = \mathrm{SOC}(0) + \Delta,\quad V_w \leftarrow V_w - R_w I"
    )
    source: ClassVar[str] = "Kirchhoff's laws: one current through all cells, voltages add"
    signature: ClassVar[str] = (
        "towards the end of a flight the pack's voltage bends down long before its mean charge "
        "says so; the voltages of single cells spread"
    )

    def at(self, values: Mapping[str, float]) -> "WeakCell":
        """This cell with other values for some of `parameters`."""
        return WeakCell(
            cell=self.cell,
            capacity_factor=values.get("capacity_factor", self.capacity_factor),
            soc_offset=values.get("soc_offset", self.soc_offset),
            resistance_ohm=values.get("resistance_ohm", self.resistance_ohm),
        )

    def changed(self, cell: Mapping[str, float], parallel: int) -> dict[str, float]:
        """The kernel's parameters of this cell, from those of the others in the same pack."""
        values = dict(cell)
        values["area_m2"] *= self.capacity_factor
        values["series_resistance_ohm"] += self.resistance_ohm * parallel
        return values
