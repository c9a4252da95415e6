"""SEI on the faces of cracks: the same law on the surface that cracking opens."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import STRENGTH, Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class SeiOnCracks:
    """`sei.grown` on the area a (roughness - 1); a fresh crack has next to no film.

    Attributes:
        strength: a factor on all it does; 0 is absence.
        initial_share: film on the faces at the start of life, over the outer film (OKane2022 in
            PyBaMM).
    """

    strength: float = 1.0
    initial_share: float = 1e-4

    id: ClassVar[str] = "sei_on_cracks"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        STRENGTH,
        Parameter(
            name="initial_share", unit="1", value=1e-4, lower=1e-6, upper=1.0, prior_std=1e-4
        ),
    )
    balance: ClassVar[str] = (
        "lithium and charge of the negative surface to the film on cracks; porosity"
    )
    equation: ClassVar[str] = (
        r"\dot L_\mathrm{cr} = \bar V c_\mathrm{sol} D_\mathrm{sol} / L_\mathrm{cr}"
    )
    source: ClassVar[str] = (
        "O'Kane et al., Phys. Chem. Chem. Phys. 24, 7909 (2022), doi:10.1039/d2cp00417h"
    )
    signature: ClassVar[str] = "lithium is lost with every deep or fast swing of the charge"
