"""Ageing fitted to check-ups: lives by few cycles, slopes, and hidden parameters found again."""

import io
from dataclasses import replace

import numpy as np
import pytest

from twin.ageing import Regime
from twin.builtin import load_cell
from twin.calibrate.ageing import fit_life, told_of_life
from twin.calibrate.answer import Verdict
from twin.calibrate.check_ups import CheckUps, read_check_ups
from twin.calibrate.degradation import LifeProblem, aged_by, ageing_parameters, course
from twin.calibrate.life import Leap, checked
from twin.calibrate.table import CalibrationError
from twin.columns import TableError
from twin.effects import EFFECTS, AnyEffect, Sei, SelfHeating, WeakCell, chosen
from twin.load import Between, Load
from twin.pack import Pack

REGIME = Regime(
    load=Load(time_s=np.array([0.0, 900.0]), current_A=np.full(2, 3.3), between=Between.HOLD),
    rest_s=300.0,
)
STRAINED = chosen(
    ("sei", "cracking", "sei_on_cracks", "active_material_loss"), heat_transfer_W_m2_K=10.0
)


def pack_of(*effects: AnyEffect) -> Pack:
    return Pack(cell=load_cell("lipo_2200"), effects=effects)


def test_a_life_by_few_cycles_is_the_whole_life() -> None:
    pack = pack_of(*STRAINED)
    few, whole = (
        {c.cycle: c.health for c in checked(pack, REGIME, 30, stride=s)} for s in (0.15, 0.0)
    )
    assert len(few) < 0.6 * len(whole)
    lost = whole[0].capacity_C - whole[30].capacity_C
    assert few[30].capacity_C == pytest.approx(whole[30].capacity_C, abs=5e-3 * lost)
    assert few[30].negative_loss == pytest.approx(whole[30].negative_loss, rel=1e-3)
    assert abs(few[30].lithium_error) < 1e-12  # as exact as step by step
    assert abs(few[30].salt_change) < 1e-3


def test_a_leap_keeps_the_lithium_of_every_cell() -> None:
    effects = chosen(list(EFFECTS)[1:7], heat_transfer_W_m2_K=10.0)
    pack = Pack(cell=load_cell("lipo_2200"), series=2,
                effects=(*effects, WeakCell(capacity_factor=0.9)))  # fmt: skip
    *_, now = checked(pack, REGIME, 1)
    assert now.cycle == 1
    leap = Leap(pack)
    model = leap.model
    state = model.initial_state(pack.cells())
    moved = leap(state, 1e-3 * np.abs(state))
    for kind, before, after in zip(
        pack.cells(), model.states(state), model.states(moved), strict=True
    ):
        total = [sum(model.cell.lithium_mol(s, kind.values).values()) for s in (before, after)]
        assert total[1] == pytest.approx(total[0], rel=1e-13)
        film = model.cell.layout.slice_of("film")
        assert after[film] == pytest.approx(1.001 * before[film], rel=1e-12)


def test_what_acts_through_the_stress_has_the_slope_of_the_modulus() -> None:
    pack = pack_of(*STRAINED)
    ups = CheckUps(cycle=np.array([0, 2, 4]), capacity_C=np.array([7900.0, 7800.0, 7750.0]))
    problem = LifeProblem(pack, REGIME, ups)
    names = [p.name for p in problem.parameters]
    q = np.full(len(names), 0.1)
    _, slopes = problem.linearised(q)
    for name in ("mechanics.negative_poisson", "mechanics.positive_partial_volume_m3_mol"):
        step = np.where([n == name for n in names], 0.05, 0.0)
        high, low = (problem.residuals(q + s)[: len(ups)] for s in (step, -step))
        near = (high - low) / 0.1
        assert slopes[: len(ups), names.index(name)] == pytest.approx(
            near, abs=0.05 * np.abs(near).max()
        )


@pytest.mark.long
def test_hidden_growth_and_resistivity_are_found_and_the_rest_of_the_life_predicted() -> None:
    pack = pack_of(Sei(solvent_diffusivity_m2_s=2e-20))
    truth = aged_by(pack, {"sei.solvent_diffusivity_m2_s": 4e-20, "sei.resistivity_ohm_m": 4e5})
    cycles = np.array([0, 3, 6, 9, 12, 24])
    life = course(truth, REGIME, cycles)
    noise = np.random.default_rng(5).standard_normal((2, cycles.size))
    ups = CheckUps(
        cycle=cycles,
        capacity_C=0.97 * life.capacity_C * (1 + 1e-4 * noise[0]),
        resistance_ohm=(2e-3 + life.resistance_ohm) * (1 + 1e-3 * noise[1]),
    )
    *_, best = fit_life(pack, REGIME, ups.before(5))
    told = told_of_life(best)
    found = {e.name: e for e in told.answer.estimates}
    for name, value in (("sei.solvent_diffusivity_m2_s", 4e-20), ("measured_capacity", 0.97),
                        ("sei.resistivity_ohm_m", 4e5)):  # fmt: skip
        assert abs(np.log(value / found[name].value)) < 3 * found[name].std / found[name].value
    assert found["sei.solvent_diffusivity_m2_s"].verdict is Verdict.IDENTIFIED
    later = told.measured_capacity * course(told.pack, REGIME, cycles).capacity_C[-1]
    assert later == pytest.approx(ups.capacity_C[-1], rel=1e-3)


def test_only_what_acts_is_free() -> None:
    assert [p.name for p in ageing_parameters(pack_of(SelfHeating(), Sei()))] == [
        "sei.solvent_diffusivity_m2_s", "sei.resistivity_ohm_m"
    ]  # fmt: skip
    cracked = pack_of(*chosen(("cracking",), heat_transfer_W_m2_K=1.0))
    assert {p.name.split("_")[0] for p in ageing_parameters(cracked)} == {"mechanics.negative"}
    ups = CheckUps(cycle=np.arange(3), capacity_C=np.ones(3))
    with pytest.raises(CalibrationError, match="nothing in this pack ages"):
        LifeProblem(pack_of(SelfHeating()), REGIME, ups)


def test_a_load_the_pack_cannot_bear_is_refused_in_words() -> None:
    heavy = replace(REGIME, load=replace(REGIME.load, current_A=np.full(2, 66.0)))
    ups = CheckUps(cycle=np.arange(3), capacity_C=np.full(3, 7900.0))
    with pytest.raises(CalibrationError, match=r"ends in cycle 1, in the flight"):
        next(fit_life(pack_of(Sei()), heavy, ups))


def test_check_ups_are_read_with_their_units() -> None:
    text = "Cycle,Capacity / mAh,DC resistance [mOhm],Temperature / degC\n0,3019,31,25\n" \
           "50,2946,32,25\n\n100,2898,33,25\n"  # fmt: skip
    ups = read_check_ups(io.StringIO(text), name="x")
    assert ups.cycle.tolist() == [0, 50, 100]
    assert ups.capacity_C == pytest.approx(3.6 * np.array([3019, 2946, 2898]))
    assert ups.resistance_ohm == pytest.approx([0.031, 0.032, 0.033])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Cycle,Voltage / V\n0,1\n1,1\n2,1\n", "no column for capacity_C"),
        ("Time / s,Capacity / Ah\n0,1\n1,1\n2,1\n", "no column for cycle"),
        ("Cycle,Capacity / Ah\n0,1\n1,1\n", "2 check-ups: expected 3 or more"),
        ("Cycle,Capacity / Ah\n0,1\n5,1\n3,1\n", r"cycles \[0.0, 5.0, 3.0\]"),
        ("Cycle,Capacity / Ah\n0,1\n1,\n2,1\n", "line 3: capacity_C is ''"),
        ("Cycle,Capacity / Ah\n0,1\n1,0\n2,1\n", "capacity_C is not positive"),
    ],
)
def test_what_are_no_check_ups_is_refused(text: str, said: str) -> None:
    with pytest.raises((CalibrationError, TableError), match=said):
        read_check_ups(io.StringIO(text), name="x")
