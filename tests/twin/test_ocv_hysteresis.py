"""Hysteresis of the open-circuit potentials: exact solutions, what a loop costs, limits, PyBaMM."""

from dataclasses import replace

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.reference.hysteresis import THERMAL, ReferenceHysteresis
from twin.builtin import load_cell
from twin.cell import Cell, Electrode, Hysteresis
from twin.cell_mesh import DEFAULT_MESH
from twin.constants import FARADAY_C_mol
from twin.effects import AGEING, AnyEffect, OcvHysteresis, SelfHeating
from twin.effects.ocv_hysteresis import relaxed
from twin.kernel import Backend
from twin.layout import Layout
from twin.load import Load
from twin.mesh import electrode_mesh
from twin.pack import Pack
from twin.protocol import ConstantCurrent, run
from twin.sensitivity import sensitivity
from twin.simulate import simulate
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

VM = Backend.VIRTUAL_MACHINE  # where compiling takes longer than the steps
M50 = load_cell("lg_m50")
FAR = OcvHysteresis(negative_amplitude_V=0.03, positive_amplitude_V=0.02)
NONE = OcvHysteresis(negative_amplitude_V=0.0, positive_amplitude_V=0.0)
U_NEGATIVE_V, U_POSITIVE_V = 0.1, 3.8


def step_of(h: float, start: float, end: float) -> float:
    return float(ca.evalf(relaxed(ca.SX(h), ca.SX(start), ca.SX(end))))


reactions = st.floats(-8.0, 8.0).filter(lambda x: x == 0 or abs(x) > 1e-6)
states = st.floats(-1.0, 1.0)


def by_short_steps(h: float, start: float, end: float, n: int = 20_000) -> float:
    """h' = (sgn(i) - h) |i| by the midpoint rule."""
    for k in range(n):
        i = start + (end - start) * (k + 0.5) / n
        pull = np.sign(i) - h
        h += (np.sign(i) - (h + pull * abs(i) / (2 * n))) * abs(i) / n
    return h


@pytest.mark.parametrize(
    ("h", "start", "end"),
    [(-1.0, 2.0, 2.0), (0.3, 1.0, 5.0), (0.9, 3.0, -2.0), (-0.2, -0.5, 4.0), (0.5, 0.0, -3.0)],
)
def test_a_step_is_the_solution_of_its_equation(h: float, start: float, end: float) -> None:
    assert step_of(h, start, end) == pytest.approx(by_short_steps(h, start, end), abs=1e-7)


@given(states, reactions, reactions, st.floats(0.0, 1.0))
def test_two_parts_of_a_step_are_the_step(h: float, start: float, end: float, cut: float) -> None:
    between = start + cut * (end - start)
    half_way = step_of(h, cut * start, cut * between)
    parts = step_of(half_way, (1 - cut) * between, (1 - cut) * end)
    assert parts == pytest.approx(step_of(h, start, end), abs=1e-12)


@given(states, reactions, reactions)
def test_both_ways_are_alike_and_no_branch_is_left(h: float, start: float, end: float) -> None:
    after = step_of(h, start, end)
    assert -1.0 <= after <= 1.0
    assert step_of(-h, -start, -end) == pytest.approx(-after, abs=1e-15)
    assert step_of(h, 0.0, 0.0) == h


def straight(times_s: list[float], currents_A: list[float], period_s: float = 1.0) -> Load:
    t = np.arange(times_s[0], times_s[-1] + period_s / 2, period_s)
    return Load(time_s=t, current_A=np.interp(t, times_s, currents_A))


def turning(seconds: float = 200.0) -> Load:
    """Noise about nothing: every place turns many times."""
    t = np.arange(0.0, seconds, 0.5)
    noise = np.random.default_rng(3).normal(0.0, 2.0, t.size)
    return Load(time_s=t, current_A=5 * np.sin(t / 9) + noise)


def part(state: FloatArray, name: str, *, ages: bool = False) -> FloatArray:
    return state[Layout(DEFAULT_MESH, ageing=ages, hysteretic=True).slice_of(name)]


@pytest.mark.parametrize("current_A", [10.0, -4.0])
def test_at_a_constant_current_it_decays_with_the_charge_through_each_place(
    current_A: float,
) -> None:
    effect = replace(FAR, negative_start=0.2, positive_start=-0.4, positive_decay=45.0)
    pack = Pack(cell=M50, initial_soc=0.5, effects=(effect,))
    solution = simulate(pack, straight([0, 1, 400], [0, current_A, current_A])).require()
    for key, way, h, decay in (("n", 1, 0.2, effect.negative_decay), ("p", -1, -0.4, 45.0)):
        side = M50.negative if key == "n" else M50.positive
        first = (side.stoichiometry_min + side.stoichiometry_max) / 2
        mean = part(solution.end_state, f"modes_{key}")[: DEFAULT_MESH.negative.size]
        branch = way * np.sign(current_A)
        exact = branch + (h - branch) * np.exp(-decay / 2 * np.abs(mean - first))
        assert np.ptp(mean) > 1e-3  # the places differ
        assert part(solution.end_state, f"hysteresis_{key}") == pytest.approx(exact, abs=1e-12)


def test_a_rested_cell_shows_the_branches_its_start_is_on_and_keeps_them() -> None:
    effect = replace(FAR, negative_start=-1.0, positive_start=0.5)
    rest = straight([0, 50], [0, 0])
    plain = simulate(Pack(cell=M50, initial_soc=0.5), rest).voltage_V
    beside = simulate(Pack(cell=M50, initial_soc=0.5, effects=(effect,)), rest).require().voltage_V
    assert beside - plain == pytest.approx(0.03 + 0.5 * 0.02, abs=1e-9)


@pytest.mark.parametrize("beside", [(), tuple(kind() for kind in AGEING)], ids=["new", "ageing"])
def test_no_amplitude_is_absence(beside: tuple[AnyEffect, ...]) -> None:
    pack = Pack(cell=M50, initial_soc=0.6, effects=(*beside, SelfHeating()))
    nothing = replace(pack, effects=(*pack.effects, NONE))
    plain, same = (simulate(p, turning(), backend=VM).require() for p in (pack, nothing))
    assert same.voltage_V == pytest.approx(plain.voltage_V, abs=1e-8)
    assert same.temperature_K == pytest.approx(plain.temperature_K, abs=1e-8)
    for key in ("n", "p"):
        h = part(same.end_state, f"hysteresis_{key}", ages=bool(beside))
        assert np.all(np.abs(h) < 1)
    assert abs(same.audit.relative_error) < 1e-13


def flat(electrode: Electrode, potential_V: float) -> Electrode:
    """Its potential the same at every stoichiometry: what a loop costs is hysteresis and rate."""
    return replace(electrode, ocp_V=lambda x: 0 * x + potential_V, entropic_V_K=lambda x: 0 * x)


LEVEL = replace(
    M50,
    negative=flat(M50.negative, U_NEGATIVE_V),
    positive=flat(M50.positive, U_POSITIVE_V),
)


def lost_J(solution: Solution) -> float:
    """Work put into a loop less what came out of it; all runs straight from sample to sample."""
    i, v = (np.array([x[:-1], x[1:]]) for x in (solution.current_A, solution.voltage_V))
    mean_W = (i[0] * v[0] + i[1] * v[1]) / 3 + (i[0] * v[1] + i[1] * v[0]) / 6
    return -float(np.diff(solution.time_s) @ mean_W)


def area_J(cell: Cell, side: Electrode, charge_C: float, amplitude_V: float, decay: float) -> float:
    """Of a loop that begins on the branch it ends on: both ways relax from near that of before."""
    holds_C = side.max_concentration_mol_m3 * side.specific_area_m2_m3 * side.particle_radius_m / 3
    holds_C *= cell.area_m2 * side.thickness_m * FARADAY_C_mol
    k = decay / 2 * charge_C / holds_C
    left = np.exp(-k)
    first = 1 - 2 * (1 - left) / k  # mean h on the way out, from -1 to 1 - 2 exp(-k)
    back = 1 - (2 - 2 * left) * (1 - left) / k  # and -h on the way back
    return float(amplitude_V * charge_C * (first + back))


WIDE = replace(FAR, negative_decay=60.0, positive_decay=90.0)
LOOP_C = 1990.0  # out, and back in


def loop(current_A: float) -> Load:
    times_s = [t / current_A for t in (0, 10, 1990, 2010, 3990, 4000)]
    return straight(times_s, [current_A * i for i in (0, 1, 1, -1, -1, 0)], 1 / current_A)


def test_a_closed_loop_costs_its_area() -> None:
    """The slower the better: 1.2 % more at 1 A, 0.4 % at 0.2 A, where reactions are more even."""
    lost = []
    for effect in (WIDE, NONE):
        pack = Pack(cell=LEVEL, initial_soc=0.7, effects=(effect,))
        lost.append(lost_J(simulate(pack, loop(0.1)).require()))
    expected = area_J(LEVEL, LEVEL.negative, LOOP_C, 0.03, 60.0)
    expected += area_J(LEVEL, LEVEL.positive, LOOP_C, 0.02, 90.0)
    assert lost[0] - lost[1] == pytest.approx(expected, rel=3e-3)
    assert expected > 60


def test_what_a_closed_loop_costs_becomes_heat() -> None:
    """The lithium is where it was, so nothing else can have become of the work."""
    effects = (WIDE, SelfHeating(heat_transfer_W_m2_K=0.0))
    solution = simulate(Pack(cell=LEVEL, initial_soc=0.7, effects=effects), loop(1.0)).require()
    heat_J = LEVEL.heat_capacity_J_K * (solution.temperature_K[-1] - 298.15)
    assert heat_J == pytest.approx(lost_J(solution), rel=1e-9)


def test_a_cell_with_branches_uses_them_when_asked_to_and_only_then() -> None:
    branches = Hysteresis(
        lithiation_V=lambda x: M50.negative.ocp_V(x) - 0.03,
        delithiation_V=lambda x: M50.negative.ocp_V(x) + 0.03,
        decay=FAR.negative_decay,
    )
    filed = Pack(cell=replace(M50, negative_hysteresis=branches), initial_soc=0.6)
    asked, own = replace(filed, effects=(FAR,)), Pack(cell=M50, initial_soc=0.6, effects=(FAR,))

    def voltage_V(pack: Pack) -> FloatArray:
        return simulate(pack, turning(), backend=VM).require().voltage_V

    plain = voltage_V(replace(own, effects=()))
    assert np.array_equal(voltage_V(filed), plain)
    assert "ocv_hysteresis.negative_amplitude_V" not in asked.cell_parameters()
    assert voltage_V(asked) == pytest.approx(voltage_V(own), abs=1e-9)
    assert np.abs(voltage_V(asked) - plain).max() > 0.03


def test_chosen_steps_agree_with_short_ones() -> None:
    pack = Pack(cell=M50, initial_soc=0.6, effects=(replace(FAR, negative_decay=200.0),))
    steps = (
        ConstantCurrent(current_A=2.5, duration_s=600.0),
        ConstantCurrent(current_A=-2.5, duration_s=600.0),
    )
    chosen = run(pack, steps).require()
    out = straight([0, 600], [2.5, 2.5])
    first = simulate(pack, out).require()
    back = replace(out, current_A=-out.current_A)
    last = simulate(pack, back, state=first.end_state).require()
    for fine, coarse in zip((first, last), chosen.steps, strict=True):
        since_s = coarse.time_s - coarse.time_s[0]
        at = np.interp(since_s, fine.time_s, fine.voltage_V)
        assert np.abs(coarse.voltage_V - at)[since_s > 5].max() < 2e-4
    h = part(last.end_state, "hysteresis_n")
    assert part(chosen.end_state, "hysteresis_n") == pytest.approx(h, abs=1e-3)


def test_sensitivities_are_those_of_differences() -> None:
    names = [f"ocv_hysteresis.negative_{n}" for n in ("amplitude_V", "decay", "start")]
    load, mesh = turning(30.0), electrode_mesh((0.0, 1.0), (3,))
    pack = Pack(cell=M50, initial_soc=0.6, effects=(replace(FAR, negative_start=-0.5),))
    exact = sensitivity(pack, load, names, mesh=mesh, backend=VM).voltage
    for column, (name, step) in enumerate(zip(names, (1e-3, 0.05, 1e-2), strict=True)):
        field = name.split(".")[1]
        ends = []
        for sign in (1, -1):
            (effect,) = pack.effects
            changed = replace(effect, **{field: getattr(effect, field) + sign * step})
            there = replace(pack, effects=(changed,))
            ends.append(simulate(there, load, mesh=mesh, backend=VM).voltage_V)
        difference = (ends[0] - ends[1]) / (2 * step)
        scale = np.abs(difference).max()
        assert exact[:, column] == pytest.approx(difference, abs=2e-3 * scale)


@pytest.mark.parametrize("thermal", THERMAL)
def test_the_twin_agrees_with_pybamm_on_converged_meshes(thermal: str) -> None:
    reference = ReferenceHysteresis.read(thermal)
    solution = reference.twin().require()
    error_mV = 1e3 * (solution.voltage_V - reference.voltage_V)
    bare_mV = 1e3 * (reference.without_V - reference.voltage_V)
    assert reference.own_error_rms_mV < 0.1
    assert np.sqrt(np.mean(error_mV**2)) <= 1.0
    assert np.abs(error_mV).max() <= 3.0
    assert np.sqrt(np.mean(bare_mV**2)) > 10.0
    assert np.abs(solution.temperature_K - reference.temperature_K).max() < 0.1
