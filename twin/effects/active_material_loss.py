"""Active material that loses contact, in proportion to the square of the stress in tension."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.effects.effect import STRENGTH, Parameter

LEAST_LEFT = 0.01  # share of a node's material that stays: without any its current has no surface
HYDROSTATIC = 2.0 / 3.0  # of the tangential stress, the radial one being zero at the surface


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveMaterialLoss:
    """d eps_s/dt = -beta (max(sigma_h, 0) / sigma_c)**2; the lithium inside is trapped.

    Attributes:
        strength: a factor on all it does; 0 is absence.
        rate_1_s: beta.
        negative_critical_Pa: sigma_c of the negative electrode.
        positive_critical_Pa: sigma_c of the positive electrode.
    """

    strength: float = 1.0
    rate_1_s: float = 2.7778e-7
    negative_critical_Pa: float = 60e6
    positive_critical_Pa: float = 375e6

    id: ClassVar[str] = "active_material_loss"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="rate_1_s", unit="1/s", value=2.7778e-7, lower=0.0, upper=1e-4, prior_std=2.8e-7
        ),
        STRENGTH,
        Parameter(
            name="negative_critical_Pa", unit="Pa", value=60e6, lower=1e6, upper=1e10,
            prior_std=30e6,
        ),
        Parameter(
            name="positive_critical_Pa", unit="Pa", value=375e6, lower=1e6, upper=1e10,
            prior_std=190e6,
        ),
    )  # fmt: skip
    balance: ClassVar[str] = (
        "active material of both electrodes; its lithium goes from the particles to what is trapped"
    )
    equation: ClassVar[str] = r"\dot\varepsilon_s = -\beta\left(\max(\sigma_h,0)/\sigma_c\right)^2"
    source: ClassVar[str] = (
        "Laresgoiti et al., J. Power Sources 300, 112 (2015), doi:10.1016/j.jpowsour.2015.09.033; "
        "O'Kane et al. (2022), doi:10.1039/d2cp00417h"
    )
    signature: ClassVar[str] = "capacity of one electrode alone; the other's curve is shifted"


def loss_1_s(stress_Pa: ca.SX, critical_Pa: ca.SX, rate_1_s: ca.SX) -> ca.SX:
    """(n,) volume share of active material that is lost per time, from the tangential stress."""
    return rate_1_s * (ca.fmax(HYDROSTATIC * stress_Pa, 0.0) / critical_Pa) ** 2
