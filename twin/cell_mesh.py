"""The mesh that a cell needs: finer at the separator where its reactions are fast."""

from functools import lru_cache
from math import sqrt

import casadi as ca

from twin.cell import Cell, Electrode, Electrolyte, Function
from twin.constants import FARADAY_C_mol, GAS_J_mol_K
from twin.mesh import Mesh, electrode_mesh

DEFAULT_MESH = electrode_mesh((0.0, 1.0), (5,))
FINE_MESH = electrode_mesh((0.0, 0.5, 1.0), (5, 5))
MOST_RESOLVED = 3.5
"""Of `reaction_modulus`, above which the default mesh does not follow how the current enters the
particles. An LG M50 whose graphite reacts 30, 60, 100 and 400 times as fast (3.0, 4.3, 5.6, 11)
goes 0.2, 0.5, 1.1 and 2.0 mV astray in a flight of up to 3C, on the graded one 0.01 to 0.17; an NCA
cell (Kim 2011; 12.4) 0.74 and 0.09."""
GRADED_MESH = electrode_mesh((0.0, 0.5, 0.8, 1.0), (4, 4, 4))
FINE_GRADED_MESH = electrode_mesh((0.0, 0.5, 0.8, 1.0), (6, 6, 6))


def mesh_of(cell: Cell) -> Mesh:
    """That simulations of it take."""
    return GRADED_MESH if _is_fast(cell) else DEFAULT_MESH


def fine_mesh_of(cell: Cell) -> Mesh:
    """To tell what the other one misses, and where salt runs short."""
    return FINE_GRADED_MESH if _is_fast(cell) else FINE_MESH


def reaction_modulus(electrode: Electrode, electrolyte: Electrolyte, reference_K: float) -> float:
    """Thickness of an electrode over the depth at which a small current enters its particles.

    nu = L sqrt(a j0 F / (R T) (1 / kappa + 1 / sigma)), j0 at half of all sites: Newman, Tobias,
    J. Electrochem. Soc. 109, 1183 (1962).
    """
    solution_S_m = electrode.transport_efficiency * _at(
        electrolyte.conductivity_S_m, electrolyte.initial_concentration_mol_m3
    )
    exchanged_A_m2 = FARADAY_C_mol * electrode.rate_constant_mol_m2_s / 2
    volume_S_m3 = (
        electrode.specific_area_m2_m3 * exchanged_A_m2 * FARADAY_C_mol / (GAS_J_mol_K * reference_K)
    )
    return electrode.thickness_m * sqrt(
        volume_S_m3 * (1 / solution_S_m + 1 / electrode.conductivity_S_m)
    )


@lru_cache(maxsize=64)
def _is_fast(cell: Cell) -> bool:
    moduli = (
        reaction_modulus(e, cell.electrolyte, cell.reference_K)
        for e in (cell.negative, cell.positive)
    )
    return max(moduli) > MOST_RESOLVED


def _at(function: Function, x: float) -> float:
    return float(ca.evalf(function(ca.SX(x))))
