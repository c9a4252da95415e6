"""An electrolyte that conducts and diffuses better or worse than the cell's file has it."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class ElectrolyteTransport:
    """Conductivity and diffusivity of the electrolyte, times one factor (pores more winding)."""

    factor: float = 1.0

    id: ClassVar[str] = "electrolyte_transport"
    scales: ClassVar[tuple[str, ...]] = (
        "electrolyte.conductivity_factor",
        "electrolyte.diffusivity_factor",
    )
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="factor", unit="1", value=1.0, lower=0.1, upper=10.0, prior_std=0.4),
    )
    balance: ClassVar[str] = "salt and charge in the pores"
    equation: ClassVar[str] = r"\kappa \to f\,\kappa,\quad D_e \to f\,D_e"
    source: ClassVar[str] = (
        "Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597"
    )
    signature: ClassVar[str] = "a fall of the voltage at once, and more of it over tens of seconds"
