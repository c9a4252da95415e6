"""Charge transfer at the surface of the particles, and what temperature does to rates."""

import casadi as ca

from twin.constants import FARADAY_C_mol, GAS_J_mol_K

SURFACE_MARGIN = 1e-6  # stoichiometry kept from 0 and 1 in sqrt(x (1 - x)); the step reports it
SALT_FLOOR_mol_m3 = 1.0  # concentration kept above this in sqrt, kappa and D; the step reports it


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
    c = ca.fmax(salt, SALT_FLOOR_mol_m3)
    return FARADAY_C_mol * rate_mol_m2_s * ca.sqrt(c / salt_initial * x * (1 - x))


def overpotential_V(current_A_m2: ca.SX, exchange_A_m2: ca.SX, temperature_K: ca.SX) -> ca.SX:
    """Butler-Volmer with transfer coefficients 1/2, solved for eta; asinh keeps Newton calm."""
    thermal_V = 2 * GAS_J_mol_K * temperature_K / FARADAY_C_mol
    return thermal_V * ca.asinh(current_A_m2 / (2 * exchange_A_m2))
