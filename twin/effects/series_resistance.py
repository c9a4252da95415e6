"""Resistance of leads, connectors, tabs and foils: between the cells and the terminals."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class SeriesResistance:
    """V at the terminals = V of the cells - R I; what is not outside of it warms the cells.

    Attributes:
        resistance_ohm: of the pack.
        outside: share of its heat that does not reach the cells: 0 of tabs and foils, which is what
            a calibration of cells finds, 1 of leads and plugs. Where it is not known it may be any.
    """

    resistance_ohm: float = 0.0
    outside: float = 0.0

    id: ClassVar[str] = "series_resistance"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="resistance_ohm", unit="Ohm", value=0.0, lower=0.0, upper=0.5, prior_std=0.01
        ),
        Parameter(name="outside", unit="1", value=0.0, lower=0.0, upper=1.0, prior_std=0.5),
    )
    balance: ClassVar[str] = "voltage at the terminals, and its heat"
    equation: ClassVar[str] = (
        r"V = V_\mathrm{cells} - R\,I,\quad Q_\mathrm{cells} \leftarrow "
        r"Q_\mathrm{cells} + (1 - \sigma)\,R\,I^2"
    )
    source: ClassVar[str] = "Ohm's and Joule's laws"
    signature: ClassVar[str] = "a step of the voltage with the current at once, at any charge"
