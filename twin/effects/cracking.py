"""Cracks of the negative particles, which grow while the surface is in tension."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.effects.effect import STRENGTH, Parameter

GEOMETRY = 1.12  # stress intensity of an edge crack
PER_CYCLE_s = 3600.0  # Paris' law is per cycle: one an hour, as in O'Kane 2022


@dataclass(frozen=True, slots=True, kw_only=True)
class Cracking:
    """Paris' law: dl/dt = k K**m / 3600 s with K = 1.12 sigma sqrt(pi l).

    With m > 2 it runs away in finite time; a crack ends where its particle does, at the radius.

    Attributes:
        strength: a factor on all it does; 0 is absence.
        paris_rate: k.
        paris_exponent: m.
        initial_length_m: l at the start of life.
        width_m: of a crack.
        density_1_m2: cracks on an area.
    """

    strength: float = 1.0
    paris_rate: float = 3.9e-20
    paris_exponent: float = 2.2
    initial_length_m: float = 2e-8
    width_m: float = 1.5e-8
    density_1_m2: float = 3.18e15

    id: ClassVar[str] = "cracking"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="paris_rate", unit="m/(Pa sqrt(m))**m", value=3.9e-20, lower=0.0, upper=1e-17,
            prior_std=3.9e-20,
        ),
        STRENGTH,
        Parameter(
            name="paris_exponent", unit="1", value=2.2, lower=1.0, upper=5.0, prior_std=0.3
        ),
        Parameter(
            name="initial_length_m", unit="m", value=2e-8, lower=1e-9, upper=1e-6, prior_std=2e-8
        ),
        Parameter(name="width_m", unit="m", value=1.5e-8, lower=1e-9, upper=1e-6, prior_std=1e-8),
        Parameter(
            name="density_1_m2", unit="1/m2", value=3.18e15, lower=1e12, upper=1e17,
            prior_std=3e15,
        ),
    )  # fmt: skip
    balance: ClassVar[str] = "none by itself: surface that `sei_on_cracks` covers"
    equation: ClassVar[str] = (
        r"\dot l = \frac{k}{3600}\left(1.12\,\sigma_t\sqrt{\pi l}\right)^m,\ \sigma_t > 0"
    )
    source: ClassVar[str] = (
        "Deshpande et al., J. Electrochem. Soc. 159, A1730 (2012), doi:10.1149/2.049210jes; "
        "O'Kane et al. (2022), doi:10.1039/d2cp00417h"
    )
    signature: ClassVar[str] = "fresh surface after high rates: loss that follows peaks, not charge"


def growth_m_s(stress_Pa: ca.SX, length_m: ca.SX, rate: ca.SX, exponent: ca.SX) -> ca.SX:
    """(n,) speed of the crack tip; none under compression.

    The power is that of exp and log, of what is above 0 only: so it has a derivative everywhere.
    """
    intensity = GEOMETRY * ca.fmax(stress_Pa, 0.0) * ca.sqrt(ca.pi * length_m)
    opening = intensity > 0
    power = ca.exp(exponent * ca.log(ca.if_else(opening, intensity, 1.0)))
    return rate / PER_CYCLE_s * ca.if_else(opening, power, 0.0)


def roughness(length_m: ca.SX, density_1_m2: ca.SX, width_m: ca.SX) -> ca.SX:
    """(n,) surface with the two faces of all cracks over surface without."""
    return 1 + 2 * length_m * density_1_m2 * width_m
