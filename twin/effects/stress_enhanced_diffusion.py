"""Stress in a particle drives lithium down its own gradient: diffusion looks faster than it is.

A choice of its own: PyBaMM switches it on with any particle mechanics, which multiplies the
diffusivity of an NMC by hundreds (github.com/pybamm-team/PyBaMM issue 4943). Off unless asked for.
"""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.constants import GAS_J_mol_K
from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class StressEnhancedDiffusion:
    """D (1 + theta c), theta = 2 Omega**2 E / (9 R T (1 - nu)), elastic constants as in Pack."""

    id: ClassVar[str] = "stress_enhanced_diffusion"
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    balance: ClassVar[str] = "none by itself: diffusivity in the particles"
    equation: ClassVar[str] = (
        r"D_\mathrm{eff} = D\left(1 + \frac{2\Omega^2 E}{9RT(1-\nu)}\,c\right)"
    )
    source: ClassVar[str] = (
        "Zhang, Shyy, Sastry, J. Electrochem. Soc. 154, A910 (2007), doi:10.1149/1.2759840; "
        "Ai et al., J. Electrochem. Soc. 167, 013512 (2020), doi:10.1149/2.0122001JES"
    )
    signature: ClassVar[str] = "flatter particles: less voltage lost to slow diffusion at high rate"


def enhancement(
    concentration: ca.SX, temperature_K: ca.SX, elastic: tuple[ca.SX, ca.SX, ca.SX]
) -> ca.SX:
    """Factor on the diffusivity (n,).

    Args:
        concentration: (n,) of lithium in the solid [mol/m3].
        temperature_K: () of the cell.
        elastic: Young's modulus [Pa], Poisson's ratio, partial molar volume [m3/mol].
    """
    modulus, poisson, partial = elastic
    theta = 2 * partial**2 * modulus / (9 * GAS_J_mol_K * temperature_K * (1 - poisson))
    return 1 + theta * concentration
