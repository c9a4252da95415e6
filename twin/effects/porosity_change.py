"""Films and plated lithium take room from the electrolyte, and transport slows down."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.effects.effect import Parameter

LEAST_POROSITY = 0.01  # a clogged electrode still conducts a little; below it nothing can be solved


@dataclass(frozen=True, slots=True, kw_only=True)
class PorosityChange:
    """The pores shrink by the volume of what has grown since the start of life.

    Attributes:
        strength: a factor on that volume; 0 is absence.
    """

    strength: float = 1.0

    id: ClassVar[str] = "porosity_change"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="strength", unit="1", value=1.0, lower=0.0, upper=2.0, prior_std=0.5),
    )
    balance: ClassVar[str] = "pores of the negative electrode: salt held, diffusion and conduction"
    equation: ClassVar[str] = (
        r"\varepsilon = \varepsilon_0 - \bar V_\mathrm{SEI}\,\Delta c_\mathrm{SEI}"
        r" - \bar V_\mathrm{Li}(c_\mathrm{Li}+c_\mathrm{dead}),\quad "
        r"B = \varepsilon^{\,\ln B_0 / \ln \varepsilon_0}"
    )
    source: ClassVar[str] = (
        "O'Kane et al., Phys. Chem. Chem. Phys. 24, 7909 (2022), doi:10.1039/d2cp00417h"
    )
    signature: ClassVar[str] = "transport limits at high rate grow worse with age"


def bruggeman(porosity: ca.SX, initial: ca.SX, efficiency: ca.SX) -> ca.SX:
    """(n,) transport efficiency of shrunk pores: porosity**b, b = ln(efficiency) / ln(initial).

    Args:
        porosity: (n,) that is left.
        initial: () before; none is all pore.
        efficiency: () transport efficiency before, which is the cell's own: where it is
            initial**1.5, b is 1.5.
    """
    exponent = ca.log(efficiency) / ca.log(initial)
    return efficiency * ca.exp(exponent * ca.log(porosity / initial))


def remaining(initial: ca.SX, filled: ca.SX) -> ca.SX:
    """(n,) porosity after a volume share `filled` (n,) has been taken."""
    return ca.fmax(initial - filled, LEAST_POROSITY)
