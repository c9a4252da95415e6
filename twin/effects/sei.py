"""Solid-electrolyte interphase that grows as solvent diffuses through it."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.effects.effect import STRENGTH, Parameter

JUMP_s = 1.0
"""A step of no length asks for a current, not for growth: that of the coming second. On a fresh
crack (1e-13 m) the instantaneous one is amperes for a millisecond."""
MEASURED_K = 298.15
"""At which the diffusivity holds, whatever the reference temperature of the cell is."""
NO_FILM = 1e-100  # mol/m3; keeps the root of a film that is not there, and does not grow, from 0/0


@dataclass(frozen=True, slots=True, kw_only=True)
class Sei:
    """i = -F c_sol D_sol / L: thickness**2 grows in proportion to time.

    The film also resists: phi_s - phi_e = U + eta + (current through it) * resistivity * L.

    Attributes:
        strength: a factor on all it does; 0 is absence.
        solvent_diffusivity_m2_s: through the film at 25 °C, D_sol.
        solvent_concentration_mol_m3: outside of the film, c_sol.
        activation_J_mol: of that diffusivity.
        molar_volume_m3_mol: of the film.
        resistivity_ohm_m: of the film.
        initial_thickness_m: L at the start of life.
    """

    strength: float = 1.0
    solvent_diffusivity_m2_s: float = 2.5e-22
    solvent_concentration_mol_m3: float = 2636.0
    activation_J_mol: float = 38000.0
    molar_volume_m3_mol: float = 9.585e-5
    resistivity_ohm_m: float = 2e5
    initial_thickness_m: float = 5e-9

    id: ClassVar[str] = "sei"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="solvent_diffusivity_m2_s", unit="m2/s", value=2.5e-22, lower=1e-24, upper=1e-19,
            prior_std=2.5e-22,
        ),
        Parameter(
            name="initial_thickness_m", unit="m", value=5e-9, lower=1e-9, upper=5e-7,
            prior_std=5e-9,
        ),
        STRENGTH,
        Parameter(
            name="solvent_concentration_mol_m3", unit="mol/m3", value=2636.0, lower=1.0,
            upper=2e4, prior_std=1000.0,
        ),
        Parameter(
            name="activation_J_mol", unit="J/mol", value=38000.0, lower=0.0, upper=2e5,
            prior_std=1e4,
        ),
        Parameter(
            name="molar_volume_m3_mol", unit="m3/mol", value=9.585e-5, lower=1e-6, upper=1e-3,
            prior_std=3e-5,
        ),
        Parameter(
            name="resistivity_ohm_m", unit="Ohm m", value=2e5, lower=0.0, upper=1e8, prior_std=2e5
        ),
    )  # fmt: skip
    balance: ClassVar[str] = (
        "lithium and charge of the negative surface to the film; potential lost in it; porosity"
    )
    equation: ClassVar[str] = r"\dot L = \bar V c_\mathrm{sol} D_\mathrm{sol} / L"
    source: ClassVar[str] = (
        "O'Kane et al., Phys. Chem. Chem. Phys. 24, 7909 (2022), doi:10.1039/d2cp00417h; "
        "Single, Latz, Horstmann, ChemSusChem 11, 1950 (2018), doi:10.1002/cssc.201800077"
    )
    signature: ClassVar[str] = (
        "lithium is lost with the square root of time, faster when warm, whatever is drawn"
    )

    @property
    def first_film_ohm_m2(self) -> float:
        """Resistance of the film that is there at the start of life, over the area it covers."""
        return self.strength * self.resistivity_ohm_m * self.initial_thickness_m


def grown(
    amount: ca.SX, area_m2_m3: ca.SX, permeability: ca.SX, molar_volume: ca.SX, step_s: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """Film after a step and the rate at which it grew, exact for any step.

    Args:
        amount: (n,) film [mol per m3 of electrode].
        area_m2_m3: (n,) surface it covers.
        permeability: () c_sol D_sol at temperature [mol/m/s].
        molar_volume: () of the film [m3/mol].
        step_s: () may be 0.

    Returns:
        (n,) amount after the step and (n,) mean rate [mol/m3/s], of one lithium a molecule. The law
        is d(amount)/dt = area**2 permeability / (molar_volume amount): the square grows steadily.
    """
    slope = permeability * area_m2_m3**2 / molar_volume
    averaged_s = ca.if_else(step_s > 0, step_s, JUMP_s)
    after, averaged = (
        ca.sqrt(ca.fmax(amount**2 + 2 * slope * t, NO_FILM**2)) for t in (step_s, averaged_s)
    )
    return after, 2 * slope / (averaged + amount)
