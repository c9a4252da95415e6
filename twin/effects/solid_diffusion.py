"""Lithium moves through the particles slower, or faster, than the cell's numbers say."""

from dataclasses import dataclass
from math import log
from typing import ClassVar

from twin.cell import Cell
from twin.effects.effect import Numbers, Parameter

FACTOR = Parameter(
    name="diffusivity_factor", unit="1", value=1.0, lower=0.01, upper=30.0, prior_std=log(2.5),
    logarithmic=True,
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _SolidDiffusion:
    """D_s times a factor; larger particles look the same, by the square of their radius.

    Attributes:
        diffusivity_factor: of D_s.
    """

    diffusivity_factor: float = 1.0

    side: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = (FACTOR,)
    balance: ClassVar[str] = "lithium in the particles"
    equation: ClassVar[str] = (
        r"\dot c_s = r^{-2}\,\partial_r\!\left(f D_s r^2\,\partial_r c_s\right)"
    )
    source: ClassVar[str] = (
        "Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597"
    )
    signature: ClassVar[str] = (
        "the voltage goes on sinking for minutes under load and recovers as slowly, the more the "
        "steeper the open-circuit potential of that electrode is"
    )

    def changed(self, numbers: Numbers, cell: Cell) -> Numbers:  # noqa: ARG002
        """The kernel's numbers of one cell with this effect in it."""
        name = f"{self.side}.diffusivity_factor"
        return numbers | {name: numbers[name] * self.diffusivity_factor}


@dataclass(frozen=True, slots=True, kw_only=True)
class SolidDiffusionNegative(_SolidDiffusion):
    """In the negative electrode."""

    id: ClassVar[str] = "solid_diffusion_negative"
    side: ClassVar[str] = "negative"


@dataclass(frozen=True, slots=True, kw_only=True)
class SolidDiffusionPositive(_SolidDiffusion):
    """In the positive electrode."""

    id: ClassVar[str] = "solid_diffusion_positive"
    side: ClassVar[str] = "positive"
