"""Charge transfer at the surface of the particles, and what temperature does to rates."""

import casadi as ca

from twin.constants import FARADAY_C_mol, GAS_J_mol_K

SURFACE_MARGIN = 1e-6  # stoichiometry kept from 0 and 1 in sqrt(x (1 - x)); the step reports it
SALT_FLOOR_mol_m3 = 1.0
"""Below it the logarithm of a concentration goes on straight, see `log_salt`; in D it is the least.

Where salt runs out, reactions end and others take over: the model has a solution with next to none
left. It is found by concentrations a few times this below 0 at most, a thousandth of what was
mixed; an LG M50 at 2C with 0.6 of its transport answers alike to 0.3 mV by a floor of 3 or 0.1."""


def arrhenius(activation_J_mol: ca.SX, temperature_K: ca.SX, reference_K: ca.SX) -> ca.SX:
    """exp(E / R * (1 / T_ref - 1 / T)), 1 at the reference temperature."""
    return ca.exp(activation_J_mol / GAS_J_mol_K * (1 / reference_K - 1 / temperature_K))


def exchange_current_A_m2(
    rate_mol_m2_s: ca.SX, salt: ca.SX, salt_initial: ca.SX, surface: ca.SX
) -> ca.SX:
    """i0 = F k sqrt(c_e / c_e0 * x * (1 - x)), symmetric (BPX standard, Butler-Volmer).

    Args:
        rate_mol_m2_s: () k at temperature.
        salt: (n,) concentration [mol/m3].
        salt_initial: () c_e0 [mol/m3].
        surface: (n,) stoichiometry x at the particle surface.
    """
    x = ca.fmin(ca.fmax(surface, SURFACE_MARGIN), 1 - SURFACE_MARGIN)
    return FARADAY_C_mol * rate_mol_m2_s * ca.sqrt(felt(salt) / salt_initial * x * (1 - x))


def log_salt(salt: ca.SX) -> ca.SX:
    """(n,) ln c of concentrations [mol/m3], straight below SALT_FLOOR_mol_m3."""
    floor = SALT_FLOOR_mol_m3
    return ca.log(ca.fmax(salt, floor)) + ca.fmin(salt / floor - 1, 0)


def felt(salt: ca.SX) -> ca.SX:
    """(n,) concentrations with that logarithm [mol/m3], always positive."""
    floor = SALT_FLOOR_mol_m3
    return ca.fmax(salt, floor) * ca.exp(ca.fmin(salt / floor - 1, 0))


def overpotential_V(current_A_m2: ca.SX, exchange_A_m2: ca.SX, temperature_K: ca.SX) -> ca.SX:
    """Butler-Volmer with transfer coefficients 1/2, solved for eta; asinh keeps Newton calm."""
    thermal_V = 2 * GAS_J_mol_K * temperature_K / FARADAY_C_mol
    return thermal_V * ca.asinh(current_A_m2 / (2 * exchange_A_m2))
