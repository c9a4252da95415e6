"""Resistance of leads, connectors, tabs and foils: between the cells and the terminals."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class SeriesResistance:
    """V at the terminals = V of the cells - R I; its heat stays in the pack."""

    resistance_ohm: float = 0.0

    id: ClassVar[str] = "series_resistance"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="resistance_ohm", unit="Ohm", value=0.0, lower=0.0, upper=0.5, prior_std=0.01
        ),
    )
    balance: ClassVar[str] = "voltage at the terminals, and its heat"
    equation: ClassVar[str] = r"V = V_\mathrm{cells} - R\,I"
    source: ClassVar[str] = "Ohm's law"
    signature: ClassVar[str] = "a step of the voltage with the current at once, at any charge"
