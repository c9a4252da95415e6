"""Packs of unlike cells against single cells under the same current, and conservation."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from twin.abreast import Abreast
from twin.at_rest import open_circuit_V
from twin.builtin import load_cell
from twin.cell import Cell
from twin.cell_mesh import DEFAULT_MESH
from twin.constants import FARADAY_C_mol
from twin.effects import EFFECTS, AnyEffect, SelfHeating, SeriesResistance, WeakCell, chosen
from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack, PackError
from twin.pack_model import PackModel
from twin.population import population
from twin.protocol import ConstantCurrent, FollowLoad, Rest, charge_cc_cv, run
from twin.sensitivity import sensitivity
from twin.simulate import changeable, simulate
from twin.solution import Solution, Status
from twin.step import StepModel

Array = npt.NDArray[np.float64]

T_S = np.arange(0.0, 60.0, 0.1)  # more than a chunk
LOAD = Load(time_s=T_S, current_A=8 + 3 * np.sin(T_S))
WEAK = WeakCell(cell=2, capacity_factor=0.8, soc_offset=-0.1, resistance_ohm=4e-3)
HEATED: tuple[AnyEffect, ...] = (SelfHeating(),)
AGED = chosen(EFFECTS, heat_transfer_W_m2_K=10.0)


@pytest.fixture(scope="module")
def lipo() -> Cell:
    return load_cell("lipo_2200")


def alone(pack: Pack, weak: WeakCell) -> Pack:
    """A pack of the weak cell only, made without the code for weak cells."""
    smaller = replace(pack.cell, area_m2=pack.cell.area_m2 * weak.capacity_factor)
    leads = SeriesResistance(resistance_ohm=weak.resistance_ohm)
    others = tuple(e for e in pack.effects if not isinstance(e, WeakCell))
    return Pack(
        cell=smaller,
        initial_soc=pack.initial_soc + weak.soc_offset,
        effects=(*others, leads),
    )


@pytest.mark.parametrize("effects", [HEATED, AGED], ids=["heated", "aged"])
def test_a_pack_of_two_is_two_cells_under_one_current(
    lipo: Cell, effects: tuple[AnyEffect, ...]
) -> None:
    pack = Pack(cell=lipo, series=2, effects=(*effects, WEAK), initial_soc=0.9)
    both = simulate(pack, LOAD).require()
    good = simulate(replace(pack, series=1, effects=effects), LOAD).require()
    weak = simulate(alone(pack, WEAK), LOAD).require()
    assert both.cell_voltage_V[0] == pytest.approx(good.voltage_V, abs=1e-12)
    assert both.cell_voltage_V[1] == pytest.approx(weak.voltage_V, abs=1e-12)
    assert both.voltage_V == pytest.approx(good.voltage_V + weak.voltage_V, abs=1e-12)
    assert both.heat_W == pytest.approx(good.heat_W + weak.heat_W, rel=1e-12)
    assert both.cell_temperature_K[1] == pytest.approx(weak.temperature_K, abs=1e-9)
    assert both.temperature_K == pytest.approx(both.cell_temperature_K.mean(axis=0), abs=1e-9)
    assert both.cell_temperature_K[1, -1] > both.cell_temperature_K[0, -1] + 0.1


@pytest.mark.parametrize("effects", [(), AGED], ids=["bare", "aged"])
def test_a_weak_cell_of_no_weakness_is_absence(lipo: Cell, effects: tuple[AnyEffect, ...]) -> None:
    equal = Pack(cell=lipo, series=4, parallel=2, capacity_C=14400.0, effects=effects)
    named = replace(equal, effects=(*effects, WeakCell(), WeakCell(cell=3)))
    one, three = (simulate(p, LOAD).require() for p in (equal, named))
    assert three.voltage_V == pytest.approx(one.voltage_V, abs=1e-9)
    assert three.cell_voltage_V == pytest.approx(one.cell_voltage_V, abs=1e-9)
    assert three.temperature_K == pytest.approx(one.temperature_K, abs=1e-9)
    steps = (Rest(duration_s=10.0), ConstantCurrent(current_A=4.0, duration_s=60.0))
    for a, b in zip(*(run(p, steps).require().steps for p in (equal, named)), strict=True):
        assert b.time_s == pytest.approx(a.time_s, abs=1e-9)
        assert b.voltage_V == pytest.approx(a.voltage_V, abs=1e-9)


def test_means_extremes_and_each_cell_are_put_out_in_that_order(lipo: Cell) -> None:
    def cell(state: Array, each: Sequence[Array], fixed: Sequence[Array]) -> tuple[Array, Array]:
        drawn = np.cumsum(each[0][:, :1], axis=0)
        return state.T + drawn * fixed[0].T, drawn * fixed[0].T * np.arange(1.0, 13.0)

    equations = PackModel(StepModel(lipo, DEFAULT_MESH), (3, 1), Abreast(cell, 1))
    drive = np.array([[1.0], [0.5]])
    states, out = equations.steps(np.array([1.0, 2.0, 3.0, 4.0]), drive, np.array([1.0, 5.0]))
    assert states.tolist() == [[[2, 3], [8, 9]], [[2.5, 3.5], [10.5, 11.5]]]
    assert out[0, :12].tolist() == [2, 4, 6, 20, 5, 6, 14, 8, 9, 50, 11, 60]
    assert out[0, 12:].tolist() == [*range(1, 13), *range(5, 61, 5)]
    assert out[1] == pytest.approx(1.5 * out[0])
    assert equations.outputs == out.shape[1]
    assert equations.of_kinds(out.T)[1, 3].tolist() == [20, 30]


def test_cells_stand_where_they_are_named_and_the_unnamed_wherever_is_room(lipo: Cell) -> None:
    effects = (WeakCell(soc_offset=-0.1), WeakCell(cell=1, soc_offset=-0.2))
    pack = Pack(cell=lipo, series=3, effects=effects)
    assert pack.places() == (2, 1, 0)
    volts = simulate(pack, LOAD).cell_voltage_V
    assert volts.shape == (3, T_S.size)
    assert np.all(np.diff(volts[:, 0]) > 0.05)
    assert Pack(cell=lipo, effects=effects[:1]).places() == (0,)
    assert [kind.count for kind in Pack(cell=lipo, series=2, effects=effects).cells()] == [1, 1]


def capacity_C(cell: Cell, area_m2: float) -> float:
    """Of the window of the negative electrode's stoichiometry."""
    n = cell.negative
    solid = n.specific_area_m2_m3 * n.particle_radius_m / 3 * n.thickness_m * area_m2
    window = n.stoichiometry_max - n.stoichiometry_min
    return FARADAY_C_mol * n.max_concentration_mol_m3 * solid * window


def test_after_a_charge_of_the_pack_each_cell_rests_at_its_own_charge(lipo: Cell) -> None:
    """The charger sees the sum: the small cell is overcharged, the others are not full."""
    weak = WeakCell(capacity_factor=0.9, soc_offset=0.05)
    pack = Pack(cell=lipo, series=3, initial_soc=0.5, effects=(weak,))
    result = run(pack, (*charge_cc_cv(pack), Rest(duration_s=6 * 3600.0))).require()
    _, hold, rest = result.steps
    held = hold.cell_voltage_V[:, -1]
    # a step's end settles after the voltage was met: some of its tolerance, 0.2 mV a cell
    assert hold.voltage_V[-1] == pytest.approx(3 * lipo.upper_cut_off_V, abs=6e-4)
    assert held.sum() == pytest.approx(hold.voltage_V[-1], abs=1e-12)
    assert held[0] > lipo.upper_cut_off_V > held[1] == held[2]
    given_C = -sum(s.charge_C for s in result.steps)
    expected = [
        open_circuit_V(lipo, soc + given_C / capacity_C(lipo, share * lipo.area_m2))
        for share, soc in ((0.9, 0.55), (1.0, 0.5), (1.0, 0.5))
    ]
    assert rest.cell_voltage_V[:, -1] == pytest.approx(expected, abs=1e-3)


def test_every_kind_of_cell_keeps_its_lithium_in_every_kind_of_step(lipo: Cell) -> None:
    pack = Pack(cell=lipo, series=3, parallel=2, effects=(*AGED, WEAK), initial_soc=0.9)
    steps = (FollowLoad(load=LOAD), *charge_cc_cv(pack), Rest(duration_s=600.0))
    result = run(pack, steps).require()
    audit = result.audit
    assert abs(audit.relative_error) < 1e-13
    assert abs(audit.charge_error_C) < 1e-8
    assert all(end > start for start, end in audit.lost_mol.values())
    total = [
        audit.negative_mol,
        audit.positive_mol,
        audit.electrolyte_mol,
        *audit.lost_mol.values(),
    ]
    assert np.ptp(sum(total)) < 1e-13 * sum(total)[0]
    good, weak = (
        simulate(p, LOAD).audit.negative_mol[0]
        for p in (Pack(cell=lipo, initial_soc=0.9), alone(pack, WEAK))
    )
    assert audit.negative_mol[0] == pytest.approx((2 * good + weak) / 3, rel=1e-12)


def test_steps_are_as_short_as_the_cell_that_is_worst_off_needs(lipo: Cell) -> None:
    weak = WeakCell(capacity_factor=0.2)
    pack = Pack(cell=lipo, series=50, initial_soc=0.9, effects=(weak,))
    step = ConstantCurrent(current_A=1.0, duration_s=600.0)
    packs = pack, replace(pack, series=1, effects=()), alone(pack, weak)
    together, good, bad = (run(p, (step,)).require().steps[0].steps for p in packs)
    assert good < 0.7 * bad
    assert together == pytest.approx(bad, rel=0.1)


def test_the_weak_cell_ends_the_flight_and_the_answer_is_whole(lipo: Cell) -> None:
    load = Load(time_s=np.arange(0.0, 1200.0), current_A=np.full(1200, 8.8))
    equal = Pack(cell=lipo, series=4)
    weak = replace(equal, effects=(WeakCell(capacity_factor=0.6),))
    whole, cut = simulate(equal, load), simulate(weak, load)
    assert cut.status in (Status.ELECTRODE_EMPTY, Status.LOWER_CUT_OFF, Status.ELECTROLYTE_DEPLETED)
    assert cut.stopped_s < 0.75 * whole.stopped_s
    assert np.isfinite(cut.cell_voltage_V).all()
    assert cut.cell_voltage_V[0, -1] < cut.cell_voltage_V[1, -1] - 0.5
    assert abs(cut.audit.relative_error) < 1e-13


def test_the_virtual_machine_gives_the_same_numbers(lipo: Cell) -> None:
    pack, short = (
        Pack(cell=lipo, series=2, effects=(WEAK,)),
        Load(time_s=T_S[:9], current_A=T_S[:9]),
    )
    compiled, virtual = (simulate(pack, short, backend=b).cell_voltage_V for b in Backend)
    assert np.abs(compiled - virtual).max() < 1e-9


NAMES = ("weak_cell.capacity_factor", "weak_cell.soc_offset", "weak_cell#2.resistance_ohm")


def two_weak(numbers: tuple[float, float, float]) -> Pack:
    capacity, offset, ohm = numbers
    effects = (
        *HEATED,
        WeakCell(capacity_factor=capacity, soc_offset=offset),
        WeakCell(cell=4, resistance_ohm=ohm),
    )
    cell = load_cell("lipo_2200")
    return Pack(cell=cell, series=4, parallel=2, initial_soc=0.9, effects=effects)


def test_a_population_varies_the_weak_cells_numbers_and_those_of_all() -> None:
    rows = [(1.0, 0.0, 0.0), (0.8, -0.1, 5e-3)]
    many = population(two_weak(rows[0]), LOAD, NAMES, rows)
    for voltage_V, numbers in zip(many.voltage_V, rows, strict=True):
        assert np.array_equal(voltage_V, simulate(two_weak(numbers), LOAD).voltage_V)
    warm = population(two_weak(rows[1]), LOAD, ["initial_K", "initial_soc"], [[310.0, 0.8]])
    one = replace(two_weak(rows[1]), initial_K=310.0, initial_soc=0.8)
    assert np.array_equal(warm.voltage_V[0], simulate(one, LOAD).voltage_V)


def test_derivatives_by_the_weak_cells_numbers_are_the_limit_of_differences() -> None:
    values = np.array([0.9, -0.05, 5e-3])
    names = (*NAMES, "area_m2")
    pack, step = two_weak((0.9, -0.05, 5e-3)), np.array([1e-4, 1e-4, 1e-4])
    exact = sensitivity(pack, LOAD, names)
    assert list(exact.values[:3]) == values.tolist()
    area_m2 = changeable(pack, LOAD)["area_m2"]
    rows = np.tile([*values, area_m2], (8, 1))
    steps = [*step, 1e-3 * area_m2]
    for i, s in enumerate(steps):
        rows[[2 * i, 2 * i + 1], i] += s, -s
    near = population(pack, LOAD, names, rows, workers=1).voltage_V
    for i, s in enumerate(steps):
        difference = (near[2 * i] - near[2 * i + 1]) / (2 * s)
        assert exact.voltage[:, i] == pytest.approx(
            difference, abs=1e-3 * np.abs(difference).max()
        ), names[i]


def end_V(solution: Solution) -> float:
    return float(solution.voltage_V[-1])


def test_each_weakness_leaves_its_mark(lipo: Cell) -> None:
    equal = Pack(cell=lipo, series=3, parallel=2, initial_soc=0.8)
    whole = simulate(equal, LOAD)
    for weak in (WeakCell(capacity_factor=0.7), WeakCell(soc_offset=-0.2)):
        assert end_V(simulate(replace(equal, effects=(weak,)), LOAD)) < end_V(whole) - 0.01
    leads = simulate(replace(equal, effects=(WeakCell(resistance_ohm=0.01),)), LOAD)
    drop_V = whole.voltage_V - leads.voltage_V
    assert drop_V == pytest.approx(0.01 * LOAD.current_A, abs=1e-9)


@pytest.mark.parametrize(
    ("weak", "said"),
    [
        ((WeakCell(cell=5),), r"cell = 5: expected 1 to 4, or 0"),
        ((WeakCell(cell=-1),), r"cell = -1"),
        ((WeakCell(cell=2), WeakCell(cell=2)), r"cell = 2 in 2 of them"),
        ((WeakCell(),) * 5, r"5 weak cells: expected 4 at most"),
        ((WeakCell(capacity_factor=0.0),), r"capacity_factor = 0\.0: expected 0\.1 to 1\.5"),
        ((WeakCell(soc_offset=0.3),), r"soc_offset = 0\.3 beside initial_soc = 0\.9"),
        ((WeakCell(resistance_ohm=float("nan")),), r"resistance_ohm = nan"),
    ],
)
def test_an_impossible_weak_cell_is_refused_by_name(
    lipo: Cell, weak: tuple[WeakCell, ...], said: str
) -> None:
    with pytest.raises(PackError, match=said):
        Pack(cell=lipo, series=4, initial_soc=0.9, effects=weak)
