"""The health of a pack of unlike cells: closed forms, slow discharges, single cells, a life."""

from dataclasses import asdict, replace
from itertools import islice

import numpy as np
import pytest

from twin.ageing import Aged, Regime, age
from twin.builtin import load_cell
from twin.cell import Cell
from twin.constants import FARADAY_C_mol
from twin.effects import AGEING, SelfHeating, WeakCell, chosen
from twin.equilibrium import EDGE, Inventory, window
from twin.health import Examiner, Health
from twin.load import Load
from twin.pack import Pack
from twin.protocol import ConstantCurrent, ProtocolResult, charge_cc_cv, run
from twin.simulate import simulate
from twin.solution import Status

T_S = np.arange(0.0, 60.0, 0.2)
LOAD = Load(time_s=T_S, current_A=20 + 10 * np.sin(T_S))
WEAK = WeakCell(cell=2, capacity_factor=0.9, soc_offset=-0.03, resistance_ohm=4e-3)
ALL = (SelfHeating(), *chosen([e.id for e in AGEING], heat_transfer_W_m2_K=0.0))
STILL = tuple(e(strength=0.0) for e in AGEING)


@pytest.fixture(scope="module")
def lipo() -> Cell:
    return load_cell("lipo_2200")


@pytest.fixture(scope="module")
def pack(lipo: Cell) -> Pack:
    return Pack(cell=lipo, series=3, parallel=2, initial_soc=0.9, effects=(*ALL, WEAK))


@pytest.fixture(scope="module")
def life(pack: Pack) -> list[Aged]:
    return list(islice(age(pack, Regime(load=LOAD)), 4))


def straight_V(x: float, y: float) -> float:
    return 3.0 + x - y


def cell_at(x: float, *, size: float) -> Inventory:
    """Its electrodes are as large as each other and hold as much together as one of them can."""
    return Inventory(negative=size * x, positive=size * (1 - x), holds=(size, size))


def test_cells_with_straight_potentials_give_the_charge_of_the_closed_form() -> None:
    """V = 2 + 2 x, so a mean from 2.6 to 3.6 V is a mean x from 0.3 to 0.8."""
    cells = [cell_at(0.5, size=2.0), cell_at(0.45, size=1.0)]
    got = window(cells, np.array([2 / 3, 1 / 3]), straight_V, (2.6, 3.6))
    per_q = (2 / 2.0 + 1 / 1.0) / 3  # of mean x over charge in F
    assert got.charge_C == pytest.approx(FARADAY_C_mol * 0.5 / per_q, rel=1e-12)
    mean_now = (2 * 0.5 + 0.45) / 3
    q = (np.array([0.3, 0.8]) - mean_now) / per_q
    expected = np.array([0.5 + q / 2.0, 0.45 + q / 1.0])
    assert got.negative == pytest.approx(expected, abs=1e-12)
    assert got.positive == pytest.approx(1 - expected, abs=1e-12)
    assert got.voltage_V == pytest.approx(2 + 2 * expected, abs=1e-12)


def test_the_cell_that_is_empty_or_full_first_ends_it() -> None:
    cells = [cell_at(0.5, size=2.0), cell_at(0.2, size=1.0)]
    got = window(cells, np.array([0.9, 0.1]), straight_V, (2.3, 9.0))
    assert got.negative[1, 0] == pytest.approx(EDGE, abs=1e-12)
    assert got.negative[0] == pytest.approx([0.4, 0.9], abs=1e-6)
    assert got.negative[1, 1] == pytest.approx(1 - EDGE, abs=1e-12)
    assert got.charge_C == pytest.approx(FARADAY_C_mol * 1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("weak", "end"),
    [
        (WeakCell(soc_offset=0.02, capacity_factor=0.98), Status.LOWER_CUT_OFF),
        (WeakCell(soc_offset=-0.1, capacity_factor=0.8), Status.ELECTRODE_EMPTY),
    ],
)
def test_the_capacity_is_that_of_a_slow_discharge(lipo: Cell, weak: WeakCell, end: Status) -> None:
    pack = Pack(cell=lipo, series=3, initial_soc=0.8, effects=(*STILL, weak))
    examiner = Examiner(pack)
    expected = examiner.examine(examiner.new, 0.0)
    charged = run(pack, charge_cc_cv(pack, rate=0.05, until_rate=0.001)).require()
    whole = ConstantCurrent(current_A=2.2 / 100, duration_s=200 * 3600.0)
    emptied: ProtocolResult = run(pack, (whole,), state=charged.end_state)
    assert emptied.status is end
    # C/100 leaves a millivolt; at the steep ends that is a thousandth of the charge
    assert emptied.steps[0].charge_C == pytest.approx(expected.capacity_C, rel=3e-3)
    full_V = charged.steps[-1].cell_voltage_V[:, -1]
    others, worse = expected.cells
    assert [worse.full_V, others.full_V] == pytest.approx(full_V[:2], abs=3e-3)


def losses(health: Health) -> dict[str, object]:
    return {k: v for k, v in asdict(health).items() if "resistance" not in k and k != "cells"}


def flat(health: Health) -> dict[str, float]:
    found = losses(health)
    return {**found.pop("lost"), **found}  # type: ignore[dict-item]


def test_each_kind_is_told_as_the_cell_alone(lipo: Cell) -> None:
    weak = replace(WEAK, resistance_ohm=0.0)
    pack = Pack(cell=lipo, series=2, initial_soc=0.9, effects=(*ALL, weak))
    small = replace(lipo, area_m2=lipo.area_m2 * weak.capacity_factor)
    single = [
        Pack(cell=lipo, initial_soc=0.9, effects=ALL),
        Pack(cell=small, initial_soc=0.87, effects=ALL),
    ]
    drawn_C = LOAD.charge_C()
    together = Examiner(pack).examine(simulate(pack, LOAD).require().end_state, drawn_C)
    for one, kind in zip(single, together.cells, strict=True):
        own = Examiner(one).examine(simulate(one, LOAD).require().end_state, drawn_C)
        # what is lost is 1e-5 of all lithium, and rounding 1e-16 of that
        assert flat(kind.health) == pytest.approx(flat(own), rel=1e-7, abs=1e-8)


def test_a_weak_cell_of_no_weakness_changes_nothing(lipo: Cell) -> None:
    equal = Pack(cell=lipo, series=3, parallel=2, initial_soc=0.9, effects=ALL)
    named = replace(equal, effects=(*ALL, WeakCell()))
    one, two = (
        Examiner(p).examine(simulate(p, LOAD).require().end_state, LOAD.charge_C())
        for p in (equal, named)
    )
    assert not one.cells
    assert flat(two) == pytest.approx(flat(one), rel=1e-9, abs=1e-12)
    assert two.resistance_ohm == pytest.approx(one.resistance_ohm, rel=1e-9)
    for kind in two.cells:
        assert kind.health.capacity_C == pytest.approx(one.capacity_C, rel=1e-9)
        assert kind.full_V == pytest.approx(lipo.upper_cut_off_V, abs=1e-9)
        assert kind.empty_V == pytest.approx(lipo.lower_cut_off_V, abs=1e-9)


def test_the_pack_is_the_sum_or_the_mean_or_the_worst_of_its_cells(life: list[Aged]) -> None:
    for aged in life:
        health = aged.cycle.health
        places = [health.cells[k].health for k in (0, 0, 1)]
        for name in ("resistance_ohm", "resistance_10s_ohm"):
            assert getattr(health, name) == pytest.approx(sum(getattr(p, name) for p in places))
        for name in ("sei_C", "sei_on_cracks_C", "plated_C", "dead_C", "trapped_C"):
            mean = np.mean([getattr(p.lost, name) for p in places])
            assert getattr(health.lost, name) == pytest.approx(mean)
        for name in ("lithium_error", "salt_change", "charge_error_C"):
            assert getattr(health, name) in [getattr(p, name) for p in places]
            assert abs(getattr(health, name)) == max(abs(getattr(p, name)) for p in places)
        areas = np.array([1.0, 1.0, 0.9])
        for name in ("lithium_loss", "negative_loss", "positive_loss"):
            share = np.average([getattr(p, name) for p in places], weights=areas)
            # cells that begin at another charge hold a little more or less lithium
            assert getattr(health, name) == pytest.approx(share, rel=1e-3)
        assert health.capacity_C < places[2].capacity_C < places[0].capacity_C
        extra_ohm = places[2].resistance_ohm - places[0].resistance_ohm
        assert extra_ohm == pytest.approx(WEAK.resistance_ohm, rel=0.2)


def test_the_lithium_of_every_kind_lasts_a_life(life: list[Aged]) -> None:
    for aged in life:
        assert abs(aged.cycle.health.lithium_error) < 1e-12
        assert abs(aged.cycle.health.charge_error_C) < 1e-8
        assert abs(aged.cycle.health.salt_change) < 1e-9
    assert np.all(np.diff([a.cycle.health.capacity_C for a in life]) < 0)


def test_a_life_is_continued_to_the_last_bit(pack: Pack, life: list[Aged]) -> None:
    (again,) = islice(age(pack, Regime(load=LOAD), after=life[2]), 1)
    assert again.cycle == life[3].cycle
    np.testing.assert_array_equal(again.state, life[3].state)


def test_a_repeated_load_ends_where_the_weak_cell_is_empty(lipo: Cell) -> None:
    weak = WeakCell(capacity_factor=0.7)
    pack = Pack(cell=lipo, series=6, initial_soc=0.9, effects=(*STILL, weak))
    _, first, second = islice(age(pack, Regime(load=LOAD, repeat=True, rest_s=0.0)), 3)
    assert first.cycle.end_V > 6 * lipo.lower_cut_off_V + 1
    assert second.cycle.status is Status.DONE
    assert 0.8 < second.cycle.drawn_C / first.cycle.drawn_C <= 1.01
