"""Lithium that moves faster or slower in the particles than the cell's file has it."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class SolidDiffusion:
    """Diffusivities in the particles of both electrodes, times one factor."""

    factor: float = 1.0

    id: ClassVar[str] = "solid_diffusion"
    scales: ClassVar[tuple[str, ...]] = (
        "negative.diffusivity_factor",
        "positive.diffusivity_factor",
    )
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="factor", unit="1", value=1.0, lower=0.02, upper=50.0, prior_std=0.7),
    )
    balance: ClassVar[str] = "lithium in the particles"
    equation: ClassVar[str] = r"D_s \to f\,D_s"
    source: ClassVar[str] = (
        "Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993), doi:10.1149/1.2221597"
    )
    signature: ClassVar[str] = "a slow fall of the voltage under load, and as slow a recovery"
