"""Stress in a particle whose surface holds less lithium than its inside, or more."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanics:
    """Elastic constants of the active materials, which cracking and loss of material share.

    Attributes:
        negative_modulus_Pa: Young's.
        negative_poisson: ratio.
        negative_partial_volume_m3_mol: of lithium in the solid.
        positive_modulus_Pa: Young's.
        positive_poisson: ratio.
        positive_partial_volume_m3_mol: of lithium in the solid.
    """

    negative_modulus_Pa: float = 15e9
    negative_poisson: float = 0.3
    negative_partial_volume_m3_mol: float = 3.1e-6
    positive_modulus_Pa: float = 375e9
    positive_poisson: float = 0.2
    positive_partial_volume_m3_mol: float = 1.25e-5

    id: ClassVar[str] = "mechanics"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="negative_modulus_Pa", unit="Pa", value=15e9, lower=1e8, upper=1e12, prior_std=5e9
        ),
        Parameter(
            name="negative_poisson", unit="1", value=0.3, lower=0.0, upper=0.49, prior_std=0.05
        ),
        Parameter(
            name="negative_partial_volume_m3_mol", unit="m3/mol", value=3.1e-6, lower=-5e-5,
            upper=5e-5, prior_std=1e-6,
        ),
        Parameter(
            name="positive_modulus_Pa", unit="Pa", value=375e9, lower=1e8, upper=1e12,
            prior_std=1e11,
        ),
        Parameter(
            name="positive_poisson", unit="1", value=0.2, lower=0.0, upper=0.49, prior_std=0.05
        ),
        Parameter(
            name="positive_partial_volume_m3_mol", unit="m3/mol", value=1.25e-5, lower=-5e-5,
            upper=5e-5, prior_std=4e-6,
        ),
    )  # fmt: skip


def tangential_stress_Pa(
    below_mean_mol_m3: ca.SX, modulus_Pa: ca.SX, poisson: ca.SX, partial_volume_m3_mol: ca.SX
) -> ca.SX:
    """At the surface of a sphere, tension positive; the radial stress is zero there.

    Args:
        below_mean_mol_m3: (n,) lithium averaged over the particle less that at its surface.
        modulus_Pa: () Young's.
        poisson: () ratio.
        partial_volume_m3_mol: () of lithium in the solid.

    Source:
        Ai, Kraft, Sturm, Jossen, Wu, J. Electrochem. Soc. 167, 013512 (2020),
        doi:10.1149/2.0122001JES.
    """
    return partial_volume_m3_mol * modulus_Pa * below_mean_mol_m3 / (3 * (1 - poisson))
