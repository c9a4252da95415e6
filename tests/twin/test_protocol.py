"""Protocols against conservation, PyBaMM, and themselves at finer tolerance."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.reference.loads import LOADS
from twin.builtin import load_cell
from twin.cell import Cell
from twin.effects import (
    EFFECTS,
    Cracking,
    CurrentGain,
    Leakage,
    Sei,
    SeiOnCracks,
    VoltageGain,
    chosen,
)
from twin.effects.self_heating import SelfHeating
from twin.load import Between, Load
from twin.mesh import electrode_mesh
from twin.pack import Pack
from twin.protocol import (
    TOLERANCE_V,
    ConstantCurrent,
    ConstantVoltage,
    FollowLoad,
    ProtocolError,
    Rest,
    Settings,
    charge_cc_cv,
    run,
)
from twin.simulate import simulate
from twin.solution import SimulationStopped, Status

REFERENCE = Path(__file__).parents[1] / "reference" / "lg_m50-charge-isothermal.npz"
FINE = electrode_mesh((0.0, 0.5, 1.0), (5, 5))


@pytest.fixture(scope="module")
def lipo() -> Cell:
    return load_cell("lipo_2200")


@pytest.fixture(scope="module")
def m50() -> Cell:
    return load_cell("lg_m50")


def follow(name: str) -> FollowLoad:
    load = LOADS[name, "flight"]
    return FollowLoad(load=Load(time_s=load.time_s, current_A=load.current_A))


def test_a_charge_agrees_with_pybamm_on_a_converged_mesh(m50: Cell) -> None:
    pack = Pack(cell=m50, initial_soc=0.2)
    result = run(pack, charge_cc_cv(pack), settings=Settings(mesh=FINE)).require()
    charge, hold = result.steps
    with np.load(REFERENCE) as stored:
        inside = charge.time_s <= stored["constant_current_s"][-1]
        expected_V = np.interp(
            charge.time_s[inside], stored["constant_current_s"], stored["voltage_V"]
        )
        error_mV = 1e3 * (charge.voltage_V[inside] - expected_V)[charge.time_s[inside] > 10]
        held_s = hold.time_s - charge.stopped_s
        common = held_s <= stored["constant_voltage_s"][-1]
        expected_A = np.interp(held_s[common], stored["constant_voltage_s"], stored["current_A"])
        assert np.sqrt(np.mean(error_mV**2)) < 0.3
        assert charge.stopped_s == pytest.approx(float(stored["switch_s"]), abs=0.2)
        assert np.sqrt(np.mean((hold.current_A[common] - expected_A) ** 2)) < 5e-3
        assert hold.stopped_s == pytest.approx(float(stored["end_s"]), abs=5.0)


def test_the_mesh_of_every_day_costs_a_third_of_a_second_at_the_switch(m50: Cell) -> None:
    pack = Pack(cell=m50, initial_soc=0.2)
    coarse, fine = (
        run(pack, charge_cc_cv(pack)[:1], settings=Settings(mesh=m)).steps[0].stopped_s
        for m in (Settings().mesh, FINE)
    )
    assert coarse == pytest.approx(fine, abs=0.4)


def test_lithium_moved_is_the_integral_of_the_current_through_every_kind_of_step(
    lipo: Cell,
) -> None:
    pack = Pack(cell=lipo, series=4, parallel=2, effects=(SelfHeating(heat_transfer_W_m2_K=10.0),))
    fly = Load(time_s=np.arange(0.0, 60.0, 0.1), current_A=20 + 9 * np.sin(np.arange(600.0)))
    steps = (FollowLoad(load=fly), Rest(duration_s=600.0), *charge_cc_cv(pack))
    result = run(pack, steps).require()
    drawn_C = sum(np.trapezoid(s.current_A, s.time_s) for s in result.steps)
    assert drawn_C == pytest.approx(sum(s.charge_C for s in result.steps), abs=1e-8)
    assert abs(result.audit.charge_error_C) < 1e-11 * fly.charge_C()
    assert abs(result.audit.relative_error) < 1e-13


def test_an_ageing_cell_keeps_its_lithium_through_flight_charge_and_rest(lipo: Cell) -> None:
    """Films narrow the pores within a step, so its extrapolated salt must be what there is."""
    pack = Pack(cell=lipo, effects=chosen(EFFECTS, heat_transfer_W_m2_K=10.0))
    steps = (follow("lipo_2200"), *charge_cc_cv(pack), Rest(duration_s=3600.0))
    result = run(pack, steps * 2).require()
    lost_mol = {name: end - start for name, (start, end) in result.audit.lost_mol.items()}
    assert all(mol > 0 for mol in lost_mol.values())
    assert abs(result.audit.relative_error) < 1e-12  # 1e-14 a cycle was seen
    assert abs(result.audit.charge_error_C) < 1e-8


def test_lithium_does_not_drift_away_over_many_short_cycles(lipo: Cell) -> None:
    """What each cycle misses adds up: `benchmarks/audit.py` runs a thousand."""
    pack = Pack(cell=lipo, initial_soc=0.6, effects=chosen(EFFECTS, heat_transfer_W_m2_K=10.0))
    whole = LOADS["lipo_2200", "flight"]
    load = Load(time_s=whole.time_s[:100], current_A=whole.current_A[:100])
    charge = ConstantCurrent(current_A=-2.2, duration_s=load.charge_C() / 2.2)
    result = run(pack, (FollowLoad(load=load), charge, Rest(duration_s=60.0)) * 30).require()
    before, after = result.audit.electrolyte_mol
    assert abs(result.audit.relative_error) < 1e-13
    assert after == pytest.approx(before, rel=1e-11)
    assert abs(result.audit.charge_error_C) < 1e-12 * 60 * load.charge_C()


def test_times_run_on_from_step_to_step(lipo: Cell) -> None:
    pack = Pack(cell=lipo, initial_soc=0.5)
    late = Load(time_s=np.array([100.0, 110.0]), current_A=np.ones(2))
    result = run(pack, (Rest(duration_s=7.0), FollowLoad(load=late), Rest(duration_s=5.0)))
    first, second, third = result.require().steps
    assert first.stopped_s == first.time_s[-1] == second.time_s[0] == 7.0
    assert third.time_s[0] == second.stopped_s == pytest.approx(17.0)
    assert third.stopped_s == pytest.approx(22.0)


def test_steps_tell_what_flowed_whatever_the_sensors_say(lipo: Cell) -> None:
    plain = Pack(cell=lipo, series=4)
    faulty = replace(plain, effects=(CurrentGain(gain=1.25), VoltageGain(gain=1.1)))
    t = np.arange(0.0, 20.0, 0.1)
    flown = Load(time_s=t, current_A=10 + 5 * np.sin(t))
    recorded = replace(flown, current_A=flown.current_A / 1.25)
    rest = ConstantCurrent(current_A=5.0, duration_s=60.0)
    true = run(plain, (FollowLoad(load=flown), rest)).require()
    told = run(faulty, (FollowLoad(load=recorded), rest)).require()
    for one, other in zip(true.steps, told.steps, strict=True):
        np.testing.assert_allclose(other.voltage_V, one.voltage_V, rtol=1e-9)
        np.testing.assert_allclose(other.current_A, one.current_A, rtol=1e-9)
        assert other.energy_J == pytest.approx(one.energy_J)
        power_W = one.voltage_V * one.current_A
        assert one.energy_J == pytest.approx(np.trapezoid(power_W, one.time_s), rel=1e-3)


def test_a_leak_acts_in_a_recording_and_not_in_the_rests_of_a_protocol(lipo: Cell) -> None:
    leaking = Pack(cell=lipo, initial_soc=0.5, effects=(Leakage(current_A=0.4),))
    t = np.arange(0.0, 61.0)
    ground = FollowLoad(load=Load(time_s=t, current_A=np.zeros(t.size), between=Between.HOLD))
    charge = ConstantCurrent(current_A=-1.0, duration_s=60.0)
    recorded, rested, charged = run(leaking, (ground, Rest(duration_s=60.0), charge)).steps
    assert recorded.charge_C == pytest.approx(0.4 * 60.0)
    assert rested.charge_C == 0.0
    assert charged.charge_C == pytest.approx(-60.0)


def test_a_load_in_two_parts_answers_like_the_whole(lipo: Cell) -> None:
    pack, t = Pack(cell=lipo), np.arange(0.0, 20.0, 0.1)
    current = 10 + 5 * np.sin(t)
    parts = [Load(time_s=t[s], current_A=current[s]) for s in (slice(0, 101), slice(100, None))]
    whole = simulate(pack, Load(time_s=t, current_A=current))
    first = simulate(pack, parts[0])
    second = simulate(pack, parts[1], state=first.end_state)
    assert second.voltage_V == pytest.approx(whole.voltage_V[100:], abs=1e-6)
    assert first.charge_C + second.charge_C == pytest.approx(whole.charge_C, rel=1e-12)


def test_a_protocol_in_two_parts_answers_like_the_whole(lipo: Cell) -> None:
    pack = Pack(cell=lipo, initial_soc=0.9)
    steps = (ConstantCurrent(current_A=2.2, duration_s=900.0), Rest(duration_s=900.0))
    whole = run(pack, steps)
    second = run(pack, steps[1:], state=run(pack, steps[:1]).end_state)
    np.testing.assert_array_equal(second.steps[0].voltage_V, whole.steps[1].voltage_V)


def test_events_are_located(lipo: Cell) -> None:
    pack = Pack(cell=lipo, initial_soc=0.5)
    charge, hold = run(pack, charge_cc_cv(pack)).require().steps
    assert charge.voltage_V[-1] == pytest.approx(4.2, abs=1e-5)
    assert charge.voltage_V[:-1].max() < 4.2
    assert hold.current_A[-1] == pytest.approx(-0.11, abs=1e-4)
    assert np.abs(hold.voltage_V - 4.2).max() < 5e-4
    empty = run(pack, (ConstantCurrent(current_A=2.2, until_V=3.6),)).require().steps[0]
    assert empty.voltage_V[-1] == pytest.approx(3.6, abs=1e-5)


def test_a_smaller_tolerance_comes_nearer_in_proportion(m50: Cell) -> None:
    pack = Pack(cell=m50, initial_soc=0.2)
    steps = (*charge_cc_cv(pack, until_rate=0.1), Rest(duration_s=3600.0))
    ends = []
    for tolerance_V in (1.6e-3, 4e-4, 1e-4, 1e-5):
        charge, hold, rest = run(pack, steps, settings=Settings(tolerance_V=tolerance_V)).steps
        ends.append((charge.charge_C + hold.charge_C, rest.voltage_V[-1]))
    charge_C, voltage_V = np.abs(np.array(ends[:-1]) - ends[-1]).T
    assert charge_C[0] > charge_C[-1]
    assert np.all(charge_C < 1e-3 * 18000 * np.array([1.6, 0.4, 0.1]))
    assert np.all(voltage_V < [1.6e-3, 4e-4, 1e-4])


def test_adaptive_steps_agree_with_a_sampled_load(lipo: Cell) -> None:
    t = np.arange(0.0, 901.0)
    current = np.where(t < 300, 4.4, 0.0)
    load = Load(time_s=t, current_A=current, between=Between.HOLD)
    pack = Pack(cell=lipo, initial_soc=0.9)
    sampled = simulate(pack, load)
    steps = (ConstantCurrent(current_A=4.4, duration_s=300.0), Rest(duration_s=600.0))
    result = run(pack, steps).require()
    rest = result.steps[1]
    assert rest.steps < 250
    expected = np.interp(rest.time_s, t, sampled.voltage_V)
    assert rest.voltage_V[rest.time_s > 310] == pytest.approx(expected[rest.time_s > 310], abs=5e-4)


def test_what_a_slow_cycle_takes_in_it_gives_back(lipo: Cell) -> None:
    pack = Pack(cell=lipo, initial_soc=1.0)
    cycle = (
        ConstantCurrent(current_A=0.44, until_V=3.5),
        Rest(duration_s=3600.0),
        *charge_cc_cv(pack, rate=0.2, until_rate=0.01),
    )
    first = run(pack, (*cycle[2:], *cycle)).require()
    out, _, charge, hold = first.steps[2:]
    assert -(charge.charge_C + hold.charge_C) == pytest.approx(out.charge_C, rel=1e-3)


def test_a_discharge_without_a_voltage_ends_at_the_cut_off_and_ends_the_protocol(
    lipo: Cell,
) -> None:
    pack = Pack(cell=lipo, series=3, initial_soc=0.1)
    steps = (ConstantCurrent(current_A=2.2, duration_s=7200.0), Rest(duration_s=1.0))
    result = run(pack, steps)
    assert result.status is Status.LOWER_CUT_OFF
    assert len(result.steps) == 1
    assert result.steps[0].voltage_V[-1] / 3 == pytest.approx(lipo.lower_cut_off_V, abs=2e-4)
    with pytest.raises(SimulationStopped, match="step 1 stopped"):
        result.require()


@pytest.mark.parametrize("current_A", [500.0, -500.0, 50000.0])
def test_a_current_beyond_the_cell_ends_with_a_status(lipo: Cell, current_A: float) -> None:
    pack = Pack(cell=lipo, initial_soc=0.5)
    result = run(pack, (ConstantCurrent(current_A=current_A, duration_s=600.0),))
    assert result.status is not Status.DONE
    assert np.all(np.isfinite(result.steps[0].voltage_V))
    assert np.all(np.isfinite(result.end_state))


def test_a_full_cell_is_charged_in_no_time(lipo: Cell) -> None:
    charge, hold = run(Pack(cell=lipo), charge_cc_cv(Pack(cell=lipo))).require().steps
    assert charge.stopped_s == 0.0
    assert abs(hold.charge_C) < 1.0


@pytest.mark.parametrize(("soc", "voltage_V"), [(0.03, 4.1), (0.9, 3.3)])
def test_a_voltage_far_from_that_of_the_cell_is_reached_in_one_jump(
    lipo: Cell, soc: float, voltage_V: float
) -> None:
    pack = Pack(cell=lipo, initial_soc=soc, initial_K=263.15)
    hold = ConstantVoltage(voltage_V=voltage_V, until_A=0.2, duration_s=20000.0)
    (held,) = run(pack, (hold,)).require().steps
    assert held.voltage_V == pytest.approx(voltage_V, abs=5e-4)
    assert abs(held.current_A[0]) > 100 * abs(held.current_A[-1])


def test_the_first_instant_of_a_film_on_cracks_is_passed(lipo: Cell) -> None:
    fast = Sei(solvent_diffusivity_m2_s=1e-19)
    pack = Pack(cell=lipo, initial_soc=0.9, effects=(fast, SeiOnCracks(), Cracking()))
    result = run(pack, (Rest(duration_s=60.0),)).require()
    (rest,) = result.steps
    sampled = simulate(pack, Load(time_s=np.arange(0.0, 60.05, 0.1), current_A=np.zeros(601)))
    films = (r.audit.lost_mol["sei_on_cracks"][1] for r in (result, sampled))
    assert next(films) == pytest.approx(next(films), rel=1e-9)  # exact for any step
    assert rest.voltage_V[-1] == pytest.approx(sampled.voltage_V[-1], abs=TOLERANCE_V)


def test_no_steps_leave_the_pack_as_it_is(lipo: Cell) -> None:
    result = run(Pack(cell=lipo), ())
    assert result.status is Status.DONE
    np.testing.assert_array_equal(result.end_state, result.start_state)


def test_charge_scales_with_the_pack(lipo: Cell) -> None:
    packs = (
        Pack(cell=lipo, initial_soc=0.5),
        Pack(cell=lipo, initial_soc=0.5, series=6, parallel=2, capacity_C=2 * 2 * 7920.0),
    )
    one, many = (run(p, charge_cc_cv(p)).require() for p in packs)
    for a, b in zip(one.steps, many.steps, strict=True):
        assert b.stopped_s == pytest.approx(a.stopped_s, abs=0.05)
        assert b.charge_C == pytest.approx(4 * a.charge_C, rel=1e-5)


def test_a_charge_to_a_cut_off_that_no_float_shares_out_exactly(lipo: Cell) -> None:
    cell = replace(lipo, upper_cut_off_V=3.65)
    assert 9 * cell.upper_cut_off_V / 9 > cell.upper_cut_off_V
    pack = Pack(cell=cell, initial_soc=0.2, series=9)
    assert run(pack, charge_cc_cv(pack)).status is Status.DONE


def test_impossible_steps_are_refused(lipo: Cell) -> None:
    with pytest.raises(ProtocolError, match="needs until_V or duration_s"):
        ConstantCurrent(current_A=1.0)
    with pytest.raises(ProtocolError, match="0 is a Rest"):
        ConstantCurrent(current_A=0.0, duration_s=1.0)
    with pytest.raises(ProtocolError, match="duration_s = nan"):
        Rest(duration_s=float("nan"))
    with pytest.raises(ProtocolError, match="duration_s = inf: expected an end"):
        Rest(duration_s=float("inf"))
    with pytest.raises(ProtocolError, match="until_V = nan"):
        ConstantCurrent(current_A=1.0, until_V=float("nan"))
    with pytest.raises(ProtocolError, match=r"expected 2\.75 to 4\.2"):
        run(Pack(cell=lipo), (ConstantVoltage(voltage_V=5.0, until_A=1.0),))


def test_a_cycle_of_flight_and_charge_takes_few_steps_but_for_the_samples(lipo: Cell) -> None:
    pack = Pack(cell=lipo)
    result = run(pack, (follow("lipo_2200"), *charge_cc_cv(pack), Rest(duration_s=3600.0)))
    flown, *others = result.require().steps
    assert flown.steps < 1.1 * flown.time_s.size
    assert sum(s.steps for s in others) < 1500
    assert abs(result.audit.charge_error_C) < 1e-8
    for a, b in pairwise(result.steps):
        assert b.soc[0] == pytest.approx(a.soc[-1], abs=1e-9)
