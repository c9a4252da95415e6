"""Reactions faster or slower than the cell's file has them."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class ReactionKinetics:
    """Rate constants of both electrodes, times a factor."""

    factor: float = 1.0

    id: ClassVar[str] = "reaction_kinetics"
    scales: ClassVar[tuple[str, ...]] = (
        "negative.rate_constant_mol_m2_s",
        "positive.rate_constant_mol_m2_s",
    )
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="factor", unit="1", value=1.0, lower=0.02, upper=50.0, prior_std=0.7),
    )
    balance: ClassVar[str] = "current through the surface of the particles"
    equation: ClassVar[str] = r"i_0 \to f\, i_0"
    source: ClassVar[str] = (
        "Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597"
    )
    signature: ClassVar[str] = (
        "a step of the voltage with the current at once, less than in proportion at high current"
    )
