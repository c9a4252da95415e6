"""Lithium plating on graphite, partly reversible; what is cut off from the electrode is dead."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.constants import FARADAY_C_mol, GAS_J_mol_K
from twin.effects.effect import STRENGTH, Parameter

STRIPPING, PLATING = 0.35, 0.65  # transfer coefficients


@dataclass(frozen=True, slots=True, kw_only=True)
class Plating:
    """i = F k (c_Li exp(0.35 F eta / RT) - c_e exp(-0.65 F eta / RT)), dead lithium by decay.

    Attributes:
        strength: a factor on all it does; 0 is absence.
        rate_constant_m_s: k.
        decay_1_s: share of the plated lithium that dies in a second, under a film as thin as at
            first.
        molar_volume_m3_mol: of the metal.
        initial_mol_m3: plated at the start, per volume of the negative electrode: what a cold
            charge left.
    """

    strength: float = 1.0
    rate_constant_m_s: float = 1e-9
    decay_1_s: float = 1e-6
    molar_volume_m3_mol: float = 1.3e-5
    initial_mol_m3: float = 0.0

    id: ClassVar[str] = "plating"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="rate_constant_m_s", unit="m/s", value=1e-9, lower=1e-13, upper=1e-7,
            prior_std=1e-9,
        ),
        Parameter(
            name="decay_1_s", unit="1/s", value=1e-6, lower=0.0, upper=1e-3, prior_std=1e-6
        ),
        STRENGTH,
        Parameter(
            name="molar_volume_m3_mol", unit="m3/mol", value=1.3e-5, lower=1e-6, upper=1e-4,
            prior_std=1e-7,
        ),
        Parameter(
            name="initial_mol_m3", unit="mol/m3", value=0.0, lower=0.0, upper=1e4, prior_std=1000.0
        ),
    )  # fmt: skip
    balance: ClassVar[str] = "lithium from the electrolyte to metal and back, its charge, porosity"
    equation: ClassVar[str] = (
        r"i = Fk\left(c_\mathrm{Li}e^{0.35F\eta/RT} - c_e e^{-0.65F\eta/RT}\right),\quad"
        r"\dot c_\mathrm{dead} = \gamma_0 \frac{L_0}{L} c_\mathrm{Li}"
    )
    source: ClassVar[str] = (
        "O'Kane et al., J. Electrochem. Soc. 167, 090540 (2020), doi:10.1149/1945-7111/ab90ac; "
        "O'Kane et al. (2022), doi:10.1039/d2cp00417h"
    )
    signature: ClassVar[str] = "a plateau on the voltage at rest after charging, most when cold"


def rates(
    mobility_1_s: ca.SX, salt: ca.SX, potential_V: ca.SX, temperature_K: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """Stripping per plated lithium (n,) [1/s] and plating (n,) [mol/m3/s].

    Args:
        mobility_1_s: (n,) rate constant times surface per volume.
        salt: (n,) concentration [mol/m3].
        potential_V: (n,) phi_s - phi_e less the film's loss.
        temperature_K: () of the cell.
    """
    scaled = FARADAY_C_mol * potential_V / (GAS_J_mol_K * temperature_K)
    stripping = mobility_1_s * ca.exp(STRIPPING * scaled)
    return stripping, mobility_1_s * salt * ca.exp(-PLATING * scaled)


def plated(
    amount: ca.SX, stripping: ca.SX, plating: ca.SX, decay_1_s: ca.SX, step_s: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """Plated lithium after a step (n,), and oxidised per time (n,) [mol/m3/s], < 0 while plating.

    Backward Euler; `stripping` and `plating` as of `rates`, at the end of the step; step_s may be
    0. What decays is dead, step_s * decay_1_s * amount after the step.
    """
    after = (amount + step_s * plating) / (1 + step_s * (stripping + decay_1_s))
    return after, stripping * after - plating
