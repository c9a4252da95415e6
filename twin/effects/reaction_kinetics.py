"""Charge is transferred at the surfaces slower, or faster, than the cell's numbers say."""

from dataclasses import dataclass
from math import log
from typing import ClassVar

from twin.cell import Cell
from twin.effects.effect import Numbers, Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class ReactionKinetics:
    """Exchange currents times a factor, each electrode its own.

    Attributes:
        negative_factor: of the exchange current of the negative electrode.
        positive_factor: likewise.
    """

    negative_factor: float = 1.0
    positive_factor: float = 1.0

    id: ClassVar[str] = "reaction_kinetics"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=f"{side}_factor", unit="1", value=1.0, lower=0.01, upper=30.0, prior_std=log(2.5),
            logarithmic=True,
        )
        for side in ("negative", "positive")
    )  # fmt: skip
    balance: ClassVar[str] = "potential between solid and electrolyte"
    equation: ClassVar[str] = r"i = 2 f i_0 \sinh\frac{F\eta}{2RT}"
    source: ClassVar[str] = (
        "Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597"
    )
    signature: ClassVar[str] = (
        "a step of the voltage with the current at once, but less than in proportion to it: most "
        "at small currents and when cold"
    )

    def changed(self, numbers: Numbers, cell: Cell) -> Numbers:  # noqa: ARG002
        """The kernel's numbers of one cell with this effect in it."""
        factors = {
            "negative.rate_constant_mol_m2_s": self.negative_factor,
            "positive.rate_constant_mol_m2_s": self.positive_factor,
        }
        return numbers | {name: numbers[name] * factor for name, factor in factors.items()}
