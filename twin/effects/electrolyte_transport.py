"""Salt moves through the pores worse, or better, than the cell's numbers say."""

from dataclasses import dataclass
from math import log
from typing import ClassVar

from twin.cell import Cell
from twin.effects.effect import Numbers, Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class ElectrolyteTransport:
    """D_e and kappa times a factor each: another salt, other solvents, pores that are clogged.

    Attributes:
        diffusivity_factor: of D_e.
        conductivity_factor: of kappa.
    """

    diffusivity_factor: float = 1.0
    conductivity_factor: float = 1.0

    id: ClassVar[str] = "electrolyte_transport"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=f"{name}_factor", unit="1", value=1.0, lower=0.05, upper=10.0, prior_std=log(2.0),
            logarithmic=True,
        )
        for name in ("diffusivity", "conductivity")
    )  # fmt: skip
    balance: ClassVar[str] = "salt in the electrolyte, and its potential"
    equation: ClassVar[str] = (
        r"\varepsilon \dot c = \nabla\cdot(f_D D_e^\mathrm{eff}\nabla c) + (1-t_+)\,a\,i/F,\quad "
        r"\kappa = f_\kappa\,\kappa_0(c)"
    )
    source: ClassVar[str] = (
        "Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597"
    )
    signature: ClassVar[str] = (
        "at high current the voltage sinks for the first half minute, more than in proportion, and "
        "recovers as slowly; little of it at low current"
    )

    def changed(self, numbers: Numbers, cell: Cell) -> Numbers:  # noqa: ARG002
        """The kernel's numbers of one cell with this effect in it."""
        factors = {
            "electrolyte.diffusivity_factor": self.diffusivity_factor,
            "electrolyte.conductivity_factor": self.conductivity_factor,
        }
        return numbers | {name: numbers[name] * factor for name, factor in factors.items()}
