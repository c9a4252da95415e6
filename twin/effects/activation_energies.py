"""Diffusivities, rates and the salt change with temperature more or less than stated."""

from dataclasses import dataclass
from typing import ClassVar

from twin.cell import Cell
from twin.effects.effect import Numbers, Parameter

ACTIVATION_STD_J_mol = 12e3
"""Those of the reactions lie 18 and 26 kJ/mol apart in the two built-in cells, one NMC, one
Li(Ni0.4Co0.6)O2."""
NUMBERS = {
    "negative_diffusivity_J_mol": "negative.diffusivity_activation_J_mol",
    "positive_diffusivity_J_mol": "positive.diffusivity_activation_J_mol",
    "negative_rate_J_mol": "negative.rate_activation_J_mol",
    "positive_rate_J_mol": "positive.rate_activation_J_mol",
    "electrolyte_diffusivity_J_mol": "electrolyte.diffusivity_activation_J_mol",
    "electrolyte_conductivity_J_mol": "electrolyte.conductivity_activation_J_mol",
}
"""Parameter of the effect -> number of the cell that it adds to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ActivationEnergies:
    """Differences of the activation energies; nothing changes at the reference temperature.

    Attributes:
        negative_diffusivity_J_mol: of diffusion in the negative particles.
        positive_diffusivity_J_mol: in the positive ones.
        negative_rate_J_mol: of the reaction at the negative particles.
        positive_rate_J_mol: at the positive ones.
        electrolyte_diffusivity_J_mol: of D_e.
        electrolyte_conductivity_J_mol: of kappa.
    """

    negative_diffusivity_J_mol: float = 0.0
    positive_diffusivity_J_mol: float = 0.0
    negative_rate_J_mol: float = 0.0
    positive_rate_J_mol: float = 0.0
    electrolyte_diffusivity_J_mol: float = 0.0
    electrolyte_conductivity_J_mol: float = 0.0

    id: ClassVar[str] = "activation_energies"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=name, unit="J/mol", value=0.0, lower=-100e3, upper=100e3,
            prior_std=ACTIVATION_STD_J_mol,
        )
        for name in NUMBERS
    )  # fmt: skip
    balance: ClassVar[str] = "none: rates, diffusivities and conductivity by temperature"
    equation: ClassVar[str] = (
        r"k(T) = k_\mathrm{ref}\exp\left[\frac{E + \Delta E}{R}"
        r"\left(\frac{1}{T_\mathrm{ref}} - \frac{1}{T}\right)\right]"
    )
    source: ClassVar[str] = "S. Arrhenius, Z. Phys. Chem. 4, 226 (1889), doi:10.1515/zpch-1889-0416"
    signature: ClassVar[str] = "as a cold or warm pack, and only where it is cold or warm"

    def changed(self, numbers: Numbers, cell: Cell) -> Numbers:  # noqa: ARG002
        """The kernel's numbers of one cell with this effect in it."""
        more = {number: getattr(self, name) for name, number in NUMBERS.items()}
        return numbers | {name: numbers[name] + difference for name, difference in more.items()}
