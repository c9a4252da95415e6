"""The cell warms itself: one temperature for the whole cell, heat made inside, lost to the air."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.effects.effect import Parameter

Ends = tuple[ca.SX, ca.SX]


@dataclass(frozen=True, slots=True, kw_only=True)
class SelfHeating:
    """Lumped energy balance C dT/dt = Q - h A (T - T_ambient).

    Q, see `released_W`, closes the energy balance of the surfaces. What a gradient inside the
    particles takes up and gives back as heat when it levels out (heat of mixing: of solid
    diffusion, between mean and surface) is not counted, as it is not by PyBaMM unless it is asked
    for, and that is no small part. Of all heat of a discharge by 30 % from a charge of 0.95,
    isothermal, and the rest after it, so much is told at 0, 25 and 45 degC: LG M50 at 1C, whose
    particles are slow, 0.62, 0.67, 0.70; small LiPo cell at 1C 0.70, 0.93, 0.98, at 5C 0.66, 0.88,
    0.95 (`python -m benchmarks.heat_told`).
    """

    heat_transfer_W_m2_K: float = 12.0
    """From the outer surface to the air, still air to a light breeze: 5 to 25."""

    id: ClassVar[str] = "self_heating"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="heat_transfer_W_m2_K", unit="W/(m2 K)", value=12.0, lower=0.01, upper=1000.0,
            prior_std=1.0, logarithmic=True,
        ),
    )  # fmt: skip
    balance: ClassVar[str] = "temperature, on which every rate depends"
    equation: ClassVar[str] = r"C\,\dot T = Q - hA\,(T - T_\mathrm{amb})"
    source: ClassVar[str] = (
        "Bernardi, Pawlikowski, Newman, J. Electrochem. Soc. 132, 5 (1985), doi:10.1149/1.2113792"
    )
    signature: ClassVar[str] = (
        "resistance falls as the flight goes on, with the heat made so far, not with charge drawn; "
        "it recovers over tens of minutes of rest"
    )


def released_W(reaction_A: ca.SX, enthalpy_V: ca.SX, current_A: ca.SX, voltage_V: ca.SX) -> ca.SX:
    """Heat made inside a cell, reversible and irreversible, > 0 warms [W].

    What chemistry gives and the terminals do not take: ohmic, kinetic, concentration and entropic
    heat in one, without a gradient to be formed.

    Args:
        reaction_A: (n,) current of oxidation at each node, both electrodes; the sum is zero.
        enthalpy_V: (n,) U - T dU/dT at the surface of the particles there.
        current_A: () at the terminals, discharge positive.
        voltage_V: () at the terminals.
    """
    return -ca.dot(reaction_A, enthalpy_V) - current_A * voltage_V


def mean_released_W(reaction_A: Ends, enthalpy_V: Ends, current_A: Ends, voltage_V: Ends) -> ca.SX:
    """`released_W` averaged over a step whose quantities (start, end) run straight in between.

    The mean of the product is not the product's trapezoid: with current that jumps by a quarter of
    its mean at every sample the trapezoid makes 2 % too much heat.
    """
    return -ca.sum1(_mean_product(reaction_A, enthalpy_V)) - _mean_product(current_A, voltage_V)


def _mean_product(a: Ends, b: Ends) -> ca.SX:
    return (a[0] * b[0] + a[1] * b[1]) / 3 + (a[0] * b[1] + a[1] * b[0]) / 6


def rise_K(
    above_ambient_K: ca.SX, heat_W: ca.SX, cooling_W_K: ca.SX, capacity_J_K: ca.SX, step_s: ca.SX
) -> ca.SX:
    """Change of temperature over a step: trapezoidal, second order, stable for any step."""
    half = step_s * cooling_W_K / (2 * capacity_J_K)
    return (step_s * heat_W / capacity_J_K - 2 * half * above_ambient_K) / (1 + half)
