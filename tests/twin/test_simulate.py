"""The twin against limits, conservation laws and itself at finer resolution."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.builtin import load_cell
from twin.cell import Cell
from twin.effects import FilmResistance, SelfHeating, SeriesResistance
from twin.load import Between, Load
from twin.mesh import electrode_mesh
from twin.pack import Pack, PackError
from twin.pieces import cut_into_pieces
from twin.simulate import simulate
from twin.solution import SimulationStopped, Status


@pytest.fixture(scope="module")
def m50() -> Cell:
    return load_cell("lg_m50")


def flight(seconds: float = 60.0, mean_A: float = 10.0) -> Load:
    rng = np.random.default_rng(7)
    t = np.arange(0.0, seconds, 0.1)
    return Load(time_s=t, current_A=mean_A * (1 + 0.2 * rng.standard_normal(t.size)))


def constant(current_A: float, seconds: float, period_s: float = 1.0) -> Load:
    t = np.arange(0.0, seconds + period_s / 2, period_s)
    return Load(time_s=t, current_A=np.full(t.size, current_A), between=Between.HOLD)


def open_circuit_V(cell: Cell, soc: float) -> float:
    x = ca.SX.sym("x")
    n, p = cell.negative, cell.positive
    u_n, u_p = (ca.Function("u", [x], [side.ocp_V(x)]) for side in (n, p))
    x_n = n.stoichiometry_min + soc * (n.stoichiometry_max - n.stoichiometry_min)
    x_p = p.stoichiometry_max - soc * (p.stoichiometry_max - p.stoichiometry_min)
    return float(u_p(x_p) - u_n(x_n))


@pytest.mark.parametrize("soc", [0.1, 0.5, 1.0])
def test_without_current_the_voltage_is_the_open_circuit_voltage(m50: Cell, soc: float) -> None:
    solution = simulate(Pack(cell=m50, series=3, initial_soc=soc), constant(0.0, 5.0))
    assert solution.require().voltage_V == pytest.approx(3 * open_circuit_V(m50, soc), abs=1e-9)
    assert np.all(solution.soc == pytest.approx(soc, abs=1e-12))


@pytest.mark.parametrize("between", list(Between))
def test_charge_and_lithium_are_kept_to_rounding(m50: Cell, between: Between) -> None:
    load = flight()
    load = Load(time_s=load.time_s, current_A=load.current_A, between=between)
    solution = simulate(Pack(cell=m50), load).require()
    assert abs(solution.audit.charge_error_C) < 1e-11 * load.charge_C()
    assert abs(solution.audit.relative_error) < 1e-14
    electrolyte = solution.audit.electrolyte_mol
    assert electrolyte[1] == pytest.approx(electrolyte[0], rel=1e-13)


def test_energy_is_that_of_the_current_as_it_is_between_samples(m50: Cell) -> None:
    strokes_A = np.array([0.0, 0.0, 8.0, 8.0, 8.0, 0.0, 12.0, 0.0])
    held = Load(time_s=10 * np.arange(8.0), current_A=strokes_A, between=Between.HOLD)
    pack = Pack(cell=m50, series=3, parallel=2)
    coarse, fine = (simulate(pack, load).require() for load in (held, held.refined(0.02)))
    by_samples_J = np.dot(np.diff(fine.time_s), (fine.voltage_V * fine.current_A)[:-1])
    assert coarse.energy_J == pytest.approx(by_samples_J, rel=1e-3)
    assert fine.energy_J == pytest.approx(by_samples_J, rel=1e-4)


def test_slow_discharge_follows_the_open_circuit_curve(m50: Cell) -> None:
    solution = simulate(Pack(cell=m50), constant(0.001, 3600.0, 60.0)).require()
    ocv = [open_circuit_V(m50, s) for s in solution.soc[::10]]
    assert solution.voltage_V[::10] == pytest.approx(ocv, abs=2e-4)


def test_voltage_at_a_sample_belongs_to_the_current_at_that_sample(m50: Cell) -> None:
    t = np.arange(6) * 0.1
    step = np.array([0.0, 0.0, 10.0, 10.0, 0.0, 0.0])
    for between in Between:
        v = simulate(Pack(cell=m50), Load(time_s=t, current_A=step, between=between)).voltage_V
        assert v[1] - v[2] > 0.05
        assert v[4] - v[3] > 0.05


def test_finer_samples_of_the_same_straight_current_change_little(m50: Cell) -> None:
    load = flight(30.0)
    fine_t = np.linspace(load.time_s[0], load.time_s[-1], 8 * (load.time_s.size - 1) + 1)
    fine = Load(time_s=fine_t, current_A=np.interp(fine_t, load.time_s, load.current_A))
    coarse = simulate(Pack(cell=m50), load).voltage_V
    error = coarse - simulate(Pack(cell=m50), fine).voltage_V[::8]
    assert np.sqrt(np.mean(error**2)) < 0.2e-3  # of the target of 1 mV rms in all


def test_mesh_refinement_converges(m50: Cell) -> None:
    load = flight(30.0)
    best = simulate(Pack(cell=m50), load, mesh=electrode_mesh((0.0, 0.5, 1.0), (5, 5))).voltage_V
    rms = []
    for order in (2, 3, 5):
        v = simulate(Pack(cell=m50), load, mesh=electrode_mesh((0.0, 1.0), (order,))).voltage_V
        rms.append(np.sqrt(np.mean((v - best) ** 2)))
    assert rms[0] > rms[1] > rms[2]
    assert rms[2] < 0.5e-3


def test_self_heating_switched_off_keeps_the_temperature(m50: Cell) -> None:
    solution = simulate(Pack(cell=m50, initial_K=290.0), flight())
    assert np.all(solution.temperature_K == 290.0)


def test_energy_balance_closes(m50: Cell) -> None:
    """Without cooling, heat capacity * rise = energy of the open circuit - energy delivered."""
    heating = SelfHeating(heat_transfer_W_m2_K=0.0)
    load = flight(120.0)
    solution = simulate(Pack(cell=m50, effects=(heating,)), load).require()
    stored = m50.heat_capacity_J_K * (solution.temperature_K - 298.15)
    heat = np.concatenate(
        [[0.0], np.cumsum(np.diff(load.time_s) * (solution.heat_W[1:] + solution.heat_W[:-1]) / 2)]
    )
    # the trapezoid of a convex quantity is above its integral: 1.3 % for 20 % jitter
    assert stored[-1] == pytest.approx(heat[-1], rel=0.02)
    smooth = simulate(Pack(cell=m50, effects=(heating,)), constant(10.0, 120.0, 0.1)).require()
    stored = m50.heat_capacity_J_K * (smooth.temperature_K - 298.15)
    heat = np.concatenate([[0.0], np.cumsum(0.05 * (smooth.heat_W[1:] + smooth.heat_W[:-1]))])
    assert stored[-1] == pytest.approx(heat[-1], rel=1e-4)


def test_cooling_relaxes_to_ambient_with_the_time_constant(m50: Cell) -> None:
    h = 12.0
    load = Load(time_s=np.arange(0.0, 1200.0), current_A=np.zeros(1200), ambient_K=290.0)
    pack = Pack(cell=m50, initial_K=310.0, effects=(SelfHeating(heat_transfer_W_m2_K=h),))
    solution = simulate(pack, load).require()
    tau_s = m50.heat_capacity_J_K / (h * m50.cooling_area_m2)
    exact = 290.0 + 20.0 * np.exp(-load.time_s / tau_s)
    assert solution.temperature_K == pytest.approx(exact, abs=1e-4)


def test_series_and_parallel_scale_voltage_and_current(m50: Cell) -> None:
    load = flight(20.0)
    one = simulate(Pack(cell=m50), load)
    twice = Load(time_s=load.time_s, current_A=2 * load.current_A)
    many = simulate(Pack(cell=m50, series=6, parallel=2), twice)
    assert many.voltage_V == pytest.approx(6 * one.voltage_V, rel=1e-14)
    assert many.heat_W == pytest.approx(12 * one.heat_W, rel=1e-12)


def test_capacity_scales_the_cell_not_the_chemistry(m50: Cell) -> None:
    load = flight(20.0)
    half = Load(time_s=load.time_s, current_A=load.current_A / 2)
    pack = Pack(cell=m50, capacity_C=m50.nominal_capacity_C / 2)
    same = simulate(Pack(cell=m50), load).voltage_V
    assert simulate(pack, half).voltage_V == pytest.approx(same, abs=1e-9)


def test_lower_cut_off_is_located_inside_a_long_sample(m50: Cell) -> None:
    fine = simulate(Pack(cell=m50), constant(10.0, 2500.0))
    coarse = simulate(Pack(cell=m50), constant(10.0, 6000.0, 2000.0))
    assert fine.status is coarse.status is Status.LOWER_CUT_OFF
    assert coarse.stopped_s == pytest.approx(fine.stopped_s, abs=0.1)
    with pytest.raises(SimulationStopped, match="lower cut-off"):
        fine.require()


def test_charging_a_full_cell_ends_at_the_upper_cut_off(m50: Cell) -> None:
    solution = simulate(Pack(cell=m50, initial_soc=0.8), constant(-2.5, 3600.0))
    assert solution.status is Status.UPPER_CUT_OFF
    assert solution.voltage_V[-1] <= m50.upper_cut_off_V + 5.1e-3


@pytest.mark.parametrize(("size_A", "at_K"), [(0.1, 298.15), (0.12, 283.15)])
def test_a_full_pack_at_rest_under_sensor_noise_is_not_being_overcharged(
    size_A: float, at_K: float
) -> None:
    noise_A = np.random.default_rng(1).normal(0.0, size_A, 600)
    load = Load(time_s=np.arange(600) / 10, current_A=noise_A - noise_A.mean(), ambient_K=at_K)
    full = Pack(cell=load_cell("lipo_2200"), initial_K=at_K)
    assert simulate(full, load).status is Status.DONE


@pytest.mark.parametrize("current_A", [200.0, 2000.0, -500.0])
def test_a_load_beyond_the_cell_ends_with_a_status_and_finite_numbers(
    m50: Cell, current_A: float
) -> None:
    solution = simulate(Pack(cell=m50, initial_soc=0.6), constant(current_A, 60.0, 0.1))
    assert solution.status not in (Status.DONE, Status.NOT_CONVERGED)
    assert np.all(np.isfinite(solution.voltage_V))
    assert abs(solution.audit.relative_error) < 1e-13


def test_an_empty_cell_answers_a_discharge_with_a_status(m50: Cell) -> None:
    solution = simulate(Pack(cell=m50, initial_soc=0.0), constant(10.0, 60.0))
    assert solution.status in (Status.LOWER_CUT_OFF, Status.ELECTRODE_EMPTY)


def test_a_long_gap_in_the_samples_is_cut_into_steps(m50: Cell) -> None:
    load = Load(time_s=np.array([0.0, 0.1, 10.1, 10.2]), current_A=np.array([10.0] * 4))
    assert cut_into_pieces(load, 1.0).length_s.max() <= 1.0
    assert simulate(Pack(cell=m50), load).require().time_s.size == 4


@given(
    st.lists(st.floats(0.01, 7.0), min_size=1, max_size=20),
    st.integers(0, 2**32 - 1),
    st.sampled_from(list(Between)),
)
@settings(max_examples=60, deadline=None)
def test_pieces_carry_the_charge_of_the_load(
    steps: list[float], seed: int, between: Between
) -> None:
    time = np.concatenate([[0.0], np.cumsum(steps)])
    current = np.random.default_rng(seed).integers(-3, 4, time.size).astype(float)
    load = Load(time_s=time, current_A=current, between=between)
    pieces = cut_into_pieces(load, 2.0)
    charge = np.dot(pieces.length_s, pieces.start_A + pieces.stop_A) / 2
    assert 2 * charge == pytest.approx(load.charge_C(), rel=1e-12, abs=1e-11)
    assert pieces.start_A[1:] == pytest.approx(pieces.stop_A[:-1])
    assert np.all(np.diff(pieces.sample) >= 0)
    last = np.flatnonzero(np.diff(pieces.sample, append=-1))
    assert pieces.stop_A[last] == pytest.approx(current / 2, abs=1e-12)
    assert np.cumsum(pieces.length_s)[last] == pytest.approx(time, abs=1e-9)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("series", 0),
        ("series", 4.5),
        ("initial_soc", 1.2),
        ("initial_K", 25.0),
        ("capacity_C", -1.0),
    ],
)
def test_an_impossible_pack_is_refused_by_name(m50: Cell, field: str, value: float) -> None:
    with pytest.raises(PackError, match=field):
        Pack(cell=m50, **{field: value})


def test_a_series_resistance_takes_its_share_at_once_and_warms_the_pack(m50: Cell) -> None:
    load, ohm = flight(20.0), 0.03
    bare = Pack(cell=m50, series=4, parallel=2)
    leads = Pack(cell=m50, series=4, parallel=2, effects=(SeriesResistance(resistance_ohm=ohm),))
    without, with_ = simulate(bare, load), simulate(leads, load)
    drop_V = ohm * load.current_A
    assert without.voltage_V - with_.voltage_V == pytest.approx(drop_V, abs=1e-9)
    assert with_.heat_W - without.heat_W == pytest.approx(drop_V * load.current_A, abs=1e-6)


@pytest.mark.parametrize("outside", [0.25, 1.0])
def test_of_leads_outside_the_voltage_is_lost_and_the_heat_is_elsewhere(
    m50: Cell, outside: float
) -> None:
    load, ohm = flight(20.0), 0.03
    leads = SeriesResistance(resistance_ohm=ohm, outside=outside)
    bare = simulate(Pack(cell=m50, series=4, parallel=2), load)
    led = simulate(Pack(cell=m50, series=4, parallel=2, effects=(leads,)), load)
    drop_V = ohm * load.current_A
    assert bare.voltage_V - led.voltage_V == pytest.approx(drop_V, abs=1e-9)
    inside_W = (1.0 - outside) * drop_V * load.current_A
    assert led.heat_W - bare.heat_W == pytest.approx(inside_W, abs=1e-6)


def test_a_film_on_both_electrodes_costs_what_ohm_says_where_the_reaction_is_even(
    m50: Cell,
) -> None:
    film = FilmResistance(negative_ohm_m2=5e-3, positive_ohm_m2=2e-3)
    load = constant(0.5, 5.0)
    bare = simulate(Pack(cell=m50), load)
    filmed = simulate(Pack(cell=m50, effects=(film,)), load)
    expected = 0.0
    for side, ohm_m2 in ((m50.negative, 5e-3), (m50.positive, 2e-3)):
        surface_m2 = side.specific_area_m2_m3 * side.thickness_m * m50.area_m2
        expected += 0.5 / surface_m2 * ohm_m2
    assert bare.voltage_V[-1] - filmed.voltage_V[-1] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("effect", [SeriesResistance(), FilmResistance()], ids=lambda e: e.id)
def test_no_resistance_is_absence(m50: Cell, effect: SeriesResistance | FilmResistance) -> None:
    load = flight(20.0)
    assert np.array_equal(
        simulate(Pack(cell=m50, effects=(effect,)), load).voltage_V,
        simulate(Pack(cell=m50), load).voltage_V,
    )
