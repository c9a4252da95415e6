"""State of charge by the voltage at rest, of one cell and of packs whose cells differ."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from twin.at_rest import OVERFULL, open_circuit_V, soc_at_rest, soc_of_others
from twin.builtin import load_cell
from twin.cell import Cell, Hysteresis
from twin.effects import (
    ActiveMaterialLossNegative,
    ActiveMaterialLossPositive,
    AnyEffect,
    ColdPack,
    LithiumInventoryLoss,
    OcvHysteresis,
    VoltageGain,
    WeakCell,
)
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

REST = Load(time_s=np.arange(3.0), current_A=np.zeros(3))


@pytest.fixture(scope="module", params=["lipo_2200", "lg_m50"])
def cell(request: pytest.FixtureRequest) -> Cell:
    return load_cell(request.param)


@pytest.mark.parametrize("soc", [0.03, 0.5, 0.97])
def test_a_cell_at_rest_tells_its_charge(cell: Cell, soc: float) -> None:
    assert soc_at_rest(cell, open_circuit_V(cell, soc)) == pytest.approx(soc, abs=1e-8)


def test_beyond_what_a_cell_can_have_it_is_full_or_empty(cell: Cell) -> None:
    assert soc_at_rest(cell, cell.upper_cut_off_V + 0.1) == 1.0
    assert soc_at_rest(cell, cell.lower_cut_off_V - 0.1) == 0.0


@pytest.mark.parametrize("offsets", [(-0.1,), (0.05,), (-0.12, -0.03), (-0.1, 0.04, 0.03, 0.03)])
def test_a_pack_of_unlike_cells_rests_at_the_voltage_that_its_charge_was_told_by(
    cell: Cell, offsets: tuple[float, ...]
) -> None:
    told = Pack(cell=cell, series=4, initial_soc=0.8, soc_by_rest=True)
    weak = tuple(WeakCell(cell=k, soc_offset=d) for k, d in enumerate(offsets, start=1))
    unlike = simulate(replace(told, effects=weak), REST).require()
    assert unlike.voltage_V == pytest.approx(simulate(told, REST).require().voltage_V, abs=1e-8)
    stated = simulate(replace(told, soc_by_rest=False, effects=weak), REST).require()
    if abs(sum(offsets)) > 1e-9:
        assert abs(stated.voltage_V[0] - unlike.voltage_V[0]) > 0.02


def test_cells_that_start_alike_start_as_told(cell: Cell) -> None:
    pack = Pack(cell=cell, series=4, initial_soc=0.8, soc_by_rest=True)
    smaller = replace(pack, effects=(WeakCell(capacity_factor=0.9),))
    assert [k.initial_soc for k in smaller.cells()] == [0.8, 0.8]


@pytest.mark.parametrize(
    "effect",
    [
        LithiumInventoryLoss(lost=0.09),
        ActiveMaterialLossNegative(lost=0.12),
        ActiveMaterialLossPositive(lost=0.12),
        VoltageGain(gain=1.01),
        VoltageGain(gain=0.99),
    ],
    ids=lambda e: e.id,
)
def test_an_aged_pack_and_a_wrong_sensor_keep_the_voltage_that_its_charge_was_told_by(
    cell: Cell, effect: AnyEffect
) -> None:
    """Not its charge: with 9 % of the lithium lost that is 1 to 4 % of the window off."""
    told = Pack(cell=cell, series=4, initial_soc=0.8, soc_by_rest=True)
    changed = replace(told, effects=(effect,))
    first_V, other_V = (simulate(p, REST).require().voltage_V for p in (told, changed))
    assert other_V == pytest.approx(first_V, abs=1e-8)
    stated = simulate(replace(changed, soc_by_rest=False), REST).require()
    assert abs(stated.voltage_V[0] - first_V[0]) > 2e-3
    assert abs(changed.numbers()["initial_soc"] - 0.8) > 2e-3


def first_V(pack: Pack) -> float:
    return float(simulate(pack, REST).require().voltage_V[0])


@pytest.mark.parametrize("soc", [0.95, 0.4])
@pytest.mark.parametrize(
    "effect",
    [
        OcvHysteresis(),
        OcvHysteresis(negative_amplitude_V=0.03, negative_start=0.5, positive_start=-0.7),
    ],
    ids=["as a charge leaves it", "between its branches"],
)
def test_a_cell_off_its_equilibrium_keeps_the_voltage_that_its_charge_was_told_by(
    cell: Cell, effect: AnyEffect, soc: float
) -> None:
    """Without, 5 mV a side are 10 mV too many: 1 % of the small LiPo's charge."""
    told = Pack(cell=cell, series=4, initial_soc=soc, soc_by_rest=True)
    beside = replace(told, effects=(effect,))
    assert first_V(beside) == pytest.approx(first_V(told), abs=1e-8)
    stated = replace(beside, soc_by_rest=False)
    assert stated.numbers()["initial_soc"] == soc
    assert abs(first_V(stated) - first_V(told)) > 0.02  # of 4 cells


def test_so_does_one_whose_branches_are_of_its_file() -> None:
    made = load_cell("lg_m50")
    branches = Hysteresis(
        lithiation_V=lambda x: made.negative.ocp_V(x) - 0.01,
        delithiation_V=lambda x: made.negative.ocp_V(x) + 0.03,
        decay=30.0,
    )
    cell = replace(made, negative_hysteresis=branches)
    told = Pack(cell=cell, initial_soc=0.8, soc_by_rest=True)
    assert told.numbers()["initial_soc"] == 0.8
    beside = replace(told, effects=(OcvHysteresis(positive_amplitude_V=0.0, negative_start=0.5),))
    assert first_V(beside) == pytest.approx(first_V(told), abs=1e-8)
    assert first_V(replace(beside, soc_by_rest=False)) == pytest.approx(first_V(told) - 0.02)


@pytest.mark.parametrize(
    ("initial_K", "effects"),
    [
        (273.15, ()),
        (313.15, ()),
        (298.15, (ColdPack(start_offset_K=-20.0),)),
        (283.15, (ColdPack(start_offset_K=-5.0), WeakCell(soc_offset=-0.05), OcvHysteresis())),
    ],
    ids=["cold", "warm", "colder than stated", "cold, a weak cell, hysteresis"],
)
def test_a_cold_or_warm_pack_keeps_the_voltage_that_its_charge_was_told_by(
    initial_K: float, effects: tuple[AnyEffect, ...]
) -> None:
    cell = load_cell("lipo_2200")  # dU/dT = -0.16 mV/K there
    told = Pack(cell=cell, series=4, initial_soc=0.2, soc_by_rest=True)
    other = replace(told, initial_K=initial_K, effects=effects)
    assert first_V(other) == pytest.approx(first_V(told), abs=1e-8)
    assert abs(first_V(replace(other, soc_by_rest=False)) - first_V(told)) > 2e-3
    assert first_V(told) == pytest.approx(4 * open_circuit_V(cell, 0.2), abs=1e-8)


def test_without_entropy_temperature_moves_no_charge() -> None:
    cell = load_cell("lg_m50")
    cold = Pack(cell=cell, initial_soc=0.8, soc_by_rest=True, initial_K=263.15)
    assert cold.numbers()["initial_soc"] == 0.8


def test_where_no_such_pack_rests_at_that_voltage_the_nearest_is_taken(cell: Cell) -> None:
    full_V, empty_V = (open_circuit_V(cell, soc) for soc in (1.0, 0.0))
    rests_V = partial(open_circuit_V, cell)
    assert soc_of_others(rests_V, 2, (-0.9,), full_V) == pytest.approx(OVERFULL)
    assert soc_of_others(rests_V, 2, (0.5,), empty_V) == 0.0
