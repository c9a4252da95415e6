"""Where reactions are fast the current enters a thin part of an electrode."""

from dataclasses import replace

import numpy as np
import pytest

from tests.reference.loads import flight
from twin.builtin import builtin_names, load_cell
from twin.cell import Cell
from twin.cell_mesh import (
    DEFAULT_MESH,
    FINE_MESH,
    MOST_RESOLVED,
    fine_mesh_of,
    mesh_of,
    reaction_modulus,
)
from twin.load import Load
from twin.mesh import Mesh, electrode_mesh
from twin.pack import Pack
from twin.simulate import simulate

CONVERGED = electrode_mesh((0.0, 0.5, 0.75, 0.9, 1.0), (6, 6, 6, 6))


def faster(factor: float) -> Cell:
    """An LG M50 whose graphite reacts so many times as fast."""
    cell = load_cell("lg_m50")
    rate = factor * cell.negative.rate_constant_mol_m2_s
    return replace(cell, negative=replace(cell.negative, rate_constant_mol_m2_s=rate))


def flown_V(cell: Cell, mesh: Mesh | None) -> np.ndarray:
    gusts = flight(5.0, mean=1.5, peak=3.0, duration_s=120.0, seed=1)
    load = Load(time_s=gusts.time_s, current_A=gusts.current_A)
    return simulate(Pack(cell=cell), load, mesh=mesh).require().voltage_V


@pytest.mark.long
def test_a_cell_whose_reactions_are_fast_is_followed_as_on_a_converged_mesh() -> None:
    cell = faster(100.0)
    exact_V = flown_V(cell, CONVERGED)

    def missed_V(mesh: Mesh | None) -> float:
        return float(np.sqrt(np.mean((flown_V(cell, mesh) - exact_V) ** 2)))

    assert missed_V(DEFAULT_MESH) > 1e-3
    assert missed_V(None) < 1.5e-4
    assert missed_V(fine_mesh_of(cell)) < 5e-5


def test_the_modulus_is_the_thickness_over_the_depth_of_the_reaction() -> None:
    """By hand: graphite of the LG M50; four times the rate is twice as far from even."""
    cell = load_cell("lg_m50")
    one, four = (
        reaction_modulus(c.negative, c.electrolyte, c.reference_K) for c in (cell, faster(4.0))
    )
    assert one == pytest.approx(0.56, abs=0.01)
    assert four == pytest.approx(2 * one)


def test_cells_that_need_no_more_take_the_mesh_of_everyday_use() -> None:
    for name in builtin_names():
        cell = load_cell(name)
        assert (mesh_of(cell), fine_mesh_of(cell)) == (DEFAULT_MESH, FINE_MESH), name
        assert reaction_modulus(cell.positive, cell.electrolyte, 298.15) < MOST_RESOLVED
