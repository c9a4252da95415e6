"""Ageing against closed forms, conservation and its own absence."""

from dataclasses import replace

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from twin.builtin import load_cell
from twin.cell import Cell
from twin.cell_mesh import DEFAULT_MESH
from twin.constants import FARADAY_C_mol
from twin.effects import (
    AGEING,
    ActiveMaterialLoss,
    Ageing,
    Cracking,
    Plating,
    PorosityChange,
    Sei,
    SeiOnCracks,
    SelfHeating,
    StressEnhancedDiffusion,
    active_material_loss,
    cracking,
    mechanics,
    plating,
    sei,
)
from twin.effects.stress_enhanced_diffusion import enhancement
from twin.electrolyte import ElectrolyteSymbols
from twin.layout import Layout
from twin.load import Between, Load
from twin.pack import Pack
from twin.parameters import cell_parameters
from twin.simulate import simulate
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

EVERYTHING: tuple[Ageing, ...] = tuple(kind() for kind in AGEING)


@pytest.fixture(scope="module")
def m50() -> Cell:
    return load_cell("lg_m50")


def flight(seconds: float = 60.0, mean_A: float = 10.0) -> Load:
    t = np.arange(0.0, seconds, 0.1)
    noise = np.random.default_rng(7).standard_normal(t.size)
    return Load(time_s=t, current_A=mean_A * (1 + 0.2 * noise))


def constant(current_A: float, seconds: float, period_s: float = 1.0) -> Load:
    t = np.arange(0.0, seconds + period_s / 2, period_s)
    return Load(time_s=t, current_A=np.full(t.size, current_A), between=Between.HOLD)


def lost_mol(solution: Solution, name: str) -> float:
    start, end = solution.audit.lost_mol[name]
    return float(end - start)


@pytest.mark.parametrize("kind", AGEING, ids=lambda kind: kind.id)
def test_zero_strength_is_absence(m50: Cell, kind: type[Ageing]) -> None:
    load = flight()
    without = simulate(Pack(cell=m50), load)
    zero = simulate(Pack(cell=m50, effects=(kind(strength=0.0),)), load)
    assert np.max(np.abs(zero.voltage_V - without.voltage_V)) < 1e-8  # of what Newton leaves: 1e-6
    assert all(lost_mol(zero, name) == 0 for name in zero.audit.lost_mol)


@pytest.mark.parametrize(
    "effects", [*((e,) for e in EVERYTHING), EVERYTHING], ids=lambda e: "+".join(k.id for k in e)
)
@pytest.mark.parametrize("current_A", [10.0, -2.5])
def test_every_lithium_atom_is_somewhere(
    m50: Cell, effects: tuple[Ageing, ...], current_A: float
) -> None:
    load = flight(30.0, current_A)
    solution = simulate(Pack(cell=m50, initial_soc=0.6, effects=effects), load).require()
    assert abs(solution.audit.relative_error) < 1e-14
    assert abs(solution.audit.charge_error_C) < 1e-10


def test_sei_grows_with_the_root_of_time(m50: Cell) -> None:
    law, seconds = Sei(), 36000.0
    rested = simulate(Pack(cell=m50, effects=(law,)), constant(0.0, seconds, 60.0)).require()
    growth = 2 * law.molar_volume_m3_mol * law.solvent_concentration_mol_m3
    first = law.initial_thickness_m
    thickness_m = np.sqrt(first**2 + growth * law.solvent_diffusivity_m2_s * seconds)
    n = m50.negative
    surface_m2 = n.specific_area_m2_m3 * n.thickness_m * m50.area_m2
    exact = (thickness_m - first) * surface_m2 / law.molar_volume_m3_mol
    assert lost_mol(rested, "sei") == pytest.approx(exact, rel=1e-9)


def test_film_growth_does_not_depend_on_the_step() -> None:
    amount, h = ca.SX.sym("c"), ca.SX.sym("h")
    after, rate = sei.grown(amount, ca.SX(1e5), ca.SX(6.6e-19), ca.SX(9.6e-5), h)
    step = ca.Function("step", [amount, h], [after, rate])
    whole, mean = (float(v) for v in step(1e-9, 10.0))
    part = 1e-9
    for _ in range(1000):
        part = float(step(part, 0.01)[0])
    assert part == pytest.approx(whole, rel=1e-10)
    assert mean * 10.0 == pytest.approx(whole - 1e-9, rel=1e-12)
    assert float(step(1e-9, 0.0)[0]) == 1e-9


def test_sei_is_faster_when_warm_as_arrhenius_says(m50: Cell) -> None:
    lost = []
    for kelvin in (298.15, 318.15):
        pack = Pack(cell=m50, initial_K=kelvin, effects=(Sei(initial_thickness_m=1e-6),))
        lost.append(lost_mol(simulate(pack, constant(0.0, 600.0, 10.0)), "sei"))
    expected = np.exp(38000.0 / 8.314462618 * (1 / 298.15 - 1 / 318.15))
    assert lost[1] / lost[0] == pytest.approx(expected, rel=1e-6)


def test_sei_does_not_know_the_reference_temperature_of_the_cell(m50: Cell) -> None:
    told = []
    for cell in (m50, replace(m50, reference_K=293.15)):
        pack = Pack(cell=cell, initial_K=308.15, effects=(Sei(),))
        told.append(lost_mol(simulate(pack, constant(0.0, 600.0, 10.0)), "sei"))
    assert told[1] == pytest.approx(told[0], rel=1e-9)


def test_crack_faces_lose_the_more_the_rougher(m50: Cell) -> None:
    lost = [
        lost_mol(
            simulate(
                Pack(
                    cell=m50,
                    effects=(SeiOnCracks(), Cracking(strength=0.0, initial_length_m=length)),
                ),
                constant(0.0, 600.0, 10.0),
            ),
            "sei_on_cracks",
        )
        for length in (2e-8, 4e-8)
    ]
    assert lost[1] / lost[0] == pytest.approx(2.0, rel=1e-3)  # area of the faces; films are thin


def test_film_on_cracks_follows_its_closed_form_from_a_stiff_start(m50: Cell) -> None:
    law, crack, seconds = Sei(), Cracking(strength=0.0), 600.0
    pack = Pack(cell=m50, effects=(SeiOnCracks(), crack))
    lost = lost_mol(simulate(pack, constant(0.0, seconds, 10.0)), "sei_on_cracks")
    growth = 2 * law.molar_volume_m3_mol * law.solvent_concentration_mol_m3
    rough = 2 * crack.initial_length_m * crack.density_1_m2 * crack.width_m
    first = law.initial_thickness_m * SeiOnCracks().initial_share / rough
    thickness_m = np.sqrt(first**2 + growth * law.solvent_diffusivity_m2_s * seconds)
    n = m50.negative
    surface_m2 = n.specific_area_m2_m3 * n.thickness_m * m50.area_m2 * rough
    exact = (thickness_m - first) * surface_m2 / law.molar_volume_m3_mol
    assert lost == pytest.approx(exact, rel=1e-9)


def test_plating_settles_where_stripping_balances_it() -> None:
    salt, volts, h = ca.SX(1000.0), ca.SX.sym("v"), ca.SX.sym("h")
    rates = plating.rates(ca.SX(4e-4), salt, volts, ca.SX(298.15))
    after, oxidised = plating.plated(ca.SX(0), *rates, ca.SX(0), h)
    settle = ca.Function("settle", [volts, h], [after, oxidised])
    amount, rate = (float(v) for v in settle(0.05, 1e12))
    balance = 1000.0 * np.exp(-FARADAY_C_mol * 0.05 / (8.314462618 * 298.15))
    assert amount == pytest.approx(balance, rel=1e-6)
    assert abs(rate) < 1e-9


def test_charging_in_the_cold_plates_more(m50: Cell) -> None:
    plated = [
        lost_mol(
            simulate(
                Pack(cell=m50, initial_soc=0.5, initial_K=kelvin, effects=(Plating(),)),
                constant(-5.0, 300.0),
            ),
            "plated",
        )
        for kelvin in (298.15, 273.15)
    ]
    assert 0 < plated[0] < plated[1]


def test_dead_lithium_is_what_plated_lithium_decayed(m50: Cell) -> None:
    solution = simulate(
        Pack(cell=m50, initial_soc=0.8, effects=(Plating(decay_1_s=1e-3),)), constant(-2.5, 300.0)
    )
    assert 0 < lost_mol(solution, "dead") < 0.3 * lost_mol(solution, "plated")


def test_only_tension_cracks_and_loosens() -> None:
    stress, length = ca.SX.sym("s"), ca.SX(2e-8)
    speed = cracking.growth_m_s(stress, length, ca.SX(3.9e-20), ca.SX(2.2))
    loss = active_material_loss.loss_1_s(stress, ca.SX(60e6), ca.SX(2.8e-7))
    both = ca.Function("both", [stress], [speed, loss])
    assert [float(v) for v in both(-1e7)] == [0.0, 0.0]
    once, twice = ([float(v) for v in both(s)] for s in (1e7, 2e7))
    assert twice[0] / once[0] == pytest.approx(2**2.2)
    assert twice[1] / once[1] == pytest.approx(4.0)


def test_stress_is_that_of_the_formula() -> None:
    got = mechanics.tangential_stress_Pa(ca.SX(1000.0), ca.SX(15e9), ca.SX(0.3), ca.SX(3.1e-6))
    assert float(ca.Function("f", [], [got])()["o0"]) == pytest.approx(22.142857e6, rel=1e-6)


def test_loss_of_material_traps_the_lithium_in_it(m50: Cell) -> None:
    pack = Pack(cell=m50, effects=(ActiveMaterialLoss(rate_1_s=1e-5),))
    solution = simulate(pack, constant(10.0, 300.0)).require()
    assert lost_mol(solution, "trapped_negative") > 1e-5
    assert abs(solution.audit.relative_error) < 1e-14


def test_filled_pores_slow_transport_down(m50: Cell) -> None:
    thick = Sei(solvent_diffusivity_m2_s=1e-17, resistivity_ohm_m=0.0)
    load = constant(12.0, 120.0)
    open_, filled = (
        simulate(Pack(cell=m50, effects=(thick, PorosityChange(strength=s))), load).require()
        for s in (0.0, 1.0)
    )
    assert filled.voltage_V[-1] < open_.voltage_V[-1] - 1e-3
    assert abs(filled.audit.relative_error) < 1e-14


@pytest.mark.parametrize("exponent", [1.5, 2.6])
def test_filled_pores_conduct_like_pores_made_so_by_the_exponent_of_the_cell(
    m50: Cell, exponent: float
) -> None:
    """Not by 1.5: a quarter filled by 2.6, they would conduct 1.37 times as well as they do."""
    layout, left = Layout(DEFAULT_MESH, ageing=True), 0.75 * m50.negative.porosity
    salt, kelvin = ca.SX(np.full(layout.nodes, 1000.0)), ca.SX(298.15)
    old = {"temperature_K": kelvin}

    def of(porosity: float, now: ca.SX | None) -> FloatArray:
        made = replace(m50.negative, porosity=porosity, transport_efficiency=porosity**exponent)
        p = cell_parameters(replace(m50, negative=made))
        symbols = ElectrolyteSymbols(m50.electrolyte, layout, {k: ca.SX(v) for k, v in p.items()})
        got = symbols.conductivity_S_m("negative", salt, old, now)
        return np.asarray(ca.evalf(got)).ravel()

    filled = of(m50.negative.porosity, ca.SX(np.full(layout.electrodes[0], left)))
    assert filled == pytest.approx(of(left, None), rel=1e-12)


def test_heat_and_ageing_couple(m50: Cell) -> None:
    load = constant(10.0, 600.0)
    cool, warm = (
        lost_mol(simulate(Pack(cell=m50, effects=(*EVERYTHING, *more)), load), "sei_on_cracks")
        for more in ((), (SelfHeating(),))
    )
    assert warm > 1.1 * cool


def test_stress_enhances_diffusion_by_hundreds_in_nmc_and_little_in_graphite() -> None:
    kelvin = ca.SX(298.15)
    graphite = enhancement(ca.SX(15000.0), kelvin, (ca.SX(15e9), ca.SX(0.3), ca.SX(3.1e-6)))
    nmc = enhancement(ca.SX(40000.0), kelvin, (ca.SX(375e9), ca.SX(0.2), ca.SX(1.25e-5)))
    factors = [float(ca.Function("f", [], [x])()["o0"]) for x in (graphite, nmc)]
    assert 1.2 < factors[0] < 1.4  # over its window 1.3 to 1.6; NMC 208 to 415
    assert 208 < factors[1] < 415


def test_stress_enhanced_diffusion_flattens_the_particles(m50: Cell) -> None:
    load = constant(10.0, 300.0)
    plain, enhanced = (
        simulate(Pack(cell=m50, effects=e), load).voltage_V[-1]
        for e in ((), (StressEnhancedDiffusion(),))
    )
    assert enhanced > plain + 0.1


@pytest.mark.parametrize("current_A", [10.0, -5.0])
def test_side_reactions_leave_the_salt_as_it_was(m50: Cell, current_A: float) -> None:
    """Every ion that a side reaction takes from the solution the particles give, and not later."""
    times = np.cumsum(np.tile([0.1, 0.1, 1.0, 7.0, 0.4], 20))
    gusts = 1 + 0.2 * np.random.default_rng(7).standard_normal(times.size)
    load = Load(time_s=times, current_A=current_A * gusts)
    solution = simulate(Pack(cell=m50, initial_soc=0.5, effects=EVERYTHING), load).require()
    assert lost_mol(solution, "plated") > 1e-9
    start, end = solution.audit.electrolyte_mol
    assert end == pytest.approx(start, rel=1e-13)


def test_a_crack_that_runs_away_ends_where_its_particle_does(m50: Cell) -> None:
    law = Cracking(paris_exponent=4.0)  # finite-time singularity for m > 2
    model_end = simulate(Pack(cell=m50, effects=(law, SeiOnCracks())), flight()).require().end_state
    assert np.isfinite(model_end).all()
