"""The margin to plating against PyBaMM, stress in the particles against its closed form."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.twin.test_ageing_reference import EFFECTS
from twin.builtin import load_cell
from twin.cell import Cell
from twin.constants import FARADAY_C_mol
from twin.effects import AGEING, ActiveMaterialLoss, Mechanics, WeakCell
from twin.load import Between, Load
from twin.mesh import Layer, Mesh
from twin.pack import Pack
from twin.protocol import ConstantCurrent, FollowLoad, run
from twin.simulate import simulate
from twin.solution import Inside

FOLDER = Path(__file__).parents[1] / "reference"
LEVEL = Layer((0.0, 1.0), (1,))
COARSE = Mesh(LEVEL, Layer((0.0, 1.0), (2,)), LEVEL)


@pytest.fixture(scope="module")
def m50() -> Cell:
    return load_cell("lg_m50")


@pytest.mark.parametrize(
    ("load", "effects"),
    [("2C", "all"), ("2C", "lam"), ("charge", "all"), ("charge", "plating"), ("flight", "all")],
)
def test_the_plating_margin_agrees_with_pybamm(m50: Cell, load: str, effects: str) -> None:
    """PyBaMM's least phi_s - phi_e less the film's loss, on converged meshes: 0.15 to 0.33 mV."""
    with np.load(FOLDER / f"ageing-{load}-{effects}-isothermal.npz") as file:
        stored = dict(file)
    pack = Pack(cell=m50, initial_soc=float(stored["charge"]), effects=EFFECTS[effects])
    current = Load(time_s=stored["time_s"], current_A=stored["current_A"])
    anode_V = simulate(pack, current).require().inside.anode_V
    error_mV = 1e3 * (anode_V - stored["plating_overpotential_V"])[1:]  # films: as in ageing
    assert np.sqrt(np.mean(error_mV**2)) < 0.5


def steady(pack: Pack, current_A: float) -> Inside:
    """After diffusion in the particles has settled, each electrode being two alike nodes."""
    t = np.arange(0.0, 3000.0, 5.0)
    load = Load(
        time_s=t, current_A=np.full(t.size, current_A), between=Between.HOLD, longest_step_s=5.0
    )
    return simulate(pack, load, mesh=COARSE).require().inside


@pytest.mark.parametrize("current_A", [0.05, -0.05])
def test_stress_of_a_steady_flux_is_that_of_its_closed_form(m50: Cell, current_A: float) -> None:
    """Surface below mean by j R / (5 D): sigma_h = 2/3 Omega E / (3 (1 - nu)) j R / (5 D)."""
    x = 0.5
    elastic = Mechanics()
    got = steady(Pack(cell=m50, initial_soc=x), current_A)
    for name, sign in (("negative", 1.0), ("positive", -1.0)):
        side = getattr(m50, name)
        surface_m2 = side.specific_area_m2_m3 * side.thickness_m * m50.area_m2
        flux = sign * current_A / (FARADAY_C_mol * surface_m2)
        below = flux * side.particle_radius_m / (5 * float(side.diffusivity_m2_s(x)))
        stiff = getattr(elastic, f"{name}_partial_volume_m3_mol")
        stiff *= getattr(elastic, f"{name}_modulus_Pa")
        exact = 2 / 3 * stiff * below / (3 * (1 - getattr(elastic, f"{name}_poisson")))
        least, most = getattr(got, f"{name}_stress_Pa")[:, -1]
        assert least <= most
        assert (least + most) / 2 == pytest.approx(exact, rel=0.02)  # nodes share it unevenly


def test_a_material_that_shrinks_as_it_fills_is_stressed_the_other_way(m50: Cell) -> None:
    plain = steady(Pack(cell=m50, initial_soc=0.5), 1.0).negative_stress_Pa
    shrinks = Mechanics(negative_partial_volume_m3_mol=-Mechanics().negative_partial_volume_m3_mol)
    other = steady(Pack(cell=m50, initial_soc=0.5, mechanics=shrinks), 1.0).negative_stress_Pa
    np.testing.assert_allclose(other, -plain[::-1], rtol=1e-12)


def test_the_stress_that_is_told_is_the_one_that_loosens(m50: Cell) -> None:
    """Loss of material, integrated from the stress by hand at the node of either extreme."""
    law = ActiveMaterialLoss()
    pack = Pack(cell=m50, effects=(law,))
    t = np.arange(0.0, 600.0)
    solution = simulate(pack, Load(time_s=t, current_A=np.full(t.size, 5.0))).require()
    rate = law.rate_1_s * (solution.inside.negative_stress_Pa / law.negative_critical_Pa) ** 2
    fraction = m50.negative.specific_area_m2_m3 * m50.negative.particle_radius_m / 3
    low, high = np.trapezoid(rate, t, axis=1) / fraction
    lost = solution.audit.lost_mol["trapped_negative"][1] / solution.audit.negative_mol[0]
    assert low < lost < high


def test_a_protocol_tells_the_same_as_a_solution(m50: Cell) -> None:
    pack = Pack(cell=m50, initial_soc=0.8, effects=tuple(k() for k in AGEING))
    t = np.arange(0.0, 60.0)
    load = Load(time_s=t, current_A=np.full(t.size, 5.0))
    alone = simulate(pack, load).require().inside
    followed, stepped = (
        run(pack, (step,)).require().steps[0].inside
        for step in (FollowLoad(load=load), ConstantCurrent(current_A=5.0, duration_s=59.0))
    )
    np.testing.assert_array_equal(followed.anode_V, alone.anode_V)
    assert stepped.anode_V[-1] == pytest.approx(alone.anode_V[-1], abs=1e-3)
    assert stepped.negative_stress_Pa.shape == (2, stepped.anode_V.size)


def test_of_unlike_cells_the_worst_is_told(m50: Cell) -> None:
    equal = Pack(cell=m50, series=2, initial_soc=0.8)
    weak = replace(equal, effects=(WeakCell(cell=1, capacity_factor=0.8),))
    t = np.arange(0.0, 60.0)
    load = Load(time_s=t, current_A=np.full(t.size, 5.0))
    worse, same = (simulate(p, load).require().inside for p in (weak, equal))
    assert (worse.negative_stress_Pa[1, 1:] > same.negative_stress_Pa[1, 1:]).all()
