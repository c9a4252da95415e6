"""A film on the particles that conducts badly, as thick on the last day as on the first."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class FilmResistance:
    """phi_s - phi_e = U + eta + i R at each particle surface.

    Attributes:
        negative_ohm_m2: R, over the area of the particles.
        positive_ohm_m2: likewise.
    """

    negative_ohm_m2: float = 0.0
    positive_ohm_m2: float = 0.0

    id: ClassVar[str] = "film_resistance"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=f"{side}_ohm_m2", unit="Ohm m2", value=0.0, lower=0.0, upper=0.1, prior_std=2e-3
        )
        for side in ("negative", "positive")
    )
    balance: ClassVar[str] = "potential between solid and electrolyte, and its heat"
    equation: ClassVar[str] = r"\phi_s - \phi_e = U + \eta + i R_\mathrm{film}"
    source: ClassVar[str] = (
        "Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597"
    )
    signature: ClassVar[str] = (
        "as a series resistance, but with the reaction it spreads over the electrode's depth"
    )
