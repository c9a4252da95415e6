"""Salt that runs out in a part of an electrode: the rest goes on, as in PyBaMM's DFN."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from tests.reference.stored import Reference, simulate_reference, twin_load, twin_pack
from twin.builtin import load_cell
from twin.carried import carried
from twin.cell_mesh import fine_mesh_of, mesh_of
from twin.damage.loss import NOTHING, Ledger
from twin.effects import Cracking, ElectrolyteTransport, Plating, Sei
from twin.kernel import Backend
from twin.limits import COLUMN
from twin.load import Load
from twin.pack import Pack
from twin.pack_model import finer_model, pack_model
from twin.protocol import ConstantCurrent, Rest, Settings, run
from twin.sensitivity import sensitivity
from twin.simulate import Run, simulate, simulate_all
from twin.solution import Status

REFERENCE = "lg_m50-3C-isothermal"


def scarce(factor: float = 0.6) -> Pack:
    """An LG M50 with less transport in its salt, of which 2C leaves none at the positive foil."""
    salt = ElectrolyteTransport(diffusivity_factor=factor, conductivity_factor=factor)
    return Pack(cell=load_cell("lg_m50"), initial_soc=0.7, effects=(salt,))


def bursts(c_rate: float = 2.0) -> Load:
    """150 s of it, then a quarter of it for as long."""
    time_s = np.arange(0.0, 300.0, 1.0)
    return Load(time_s=time_s, current_A=5.0 * np.where(time_s < 150.0, c_rate, c_rate / 4))


def least_mol_m3(run: Run) -> float:
    return float(np.hstack(run.rows)[COLUMN["salt_min_mol_m3"]].min())


@pytest.mark.parametrize(("cell", "c_rate"), [("lg_m50", 10.0), ("lipo_2200", 60.0)])
def test_a_cell_goes_on_to_its_cut_off_where_a_part_of_it_has_no_salt_left(
    cell: str, c_rate: float
) -> None:
    own = Pack(cell=load_cell(cell))
    time_s = np.arange(0.0, 60.0, 0.1)
    load = Load(time_s=time_s, current_A=np.full(600, c_rate * own.rated_C / 3600))
    run = Run(own, load, None, Backend.AUTO, None)
    run.run()
    assert run.status is Status.LOWER_CUT_OFF
    assert -10.0 < least_mol_m3(run) < 1.0


def test_the_finer_mesh_is_taken_where_little_is_left_and_none_was_asked_for() -> None:
    reference = Reference.read(REFERENCE)
    pack, load = twin_pack(reference), twin_load(reference.load)

    def missed_V(got_V: np.ndarray) -> float:
        return float(np.sqrt(np.mean((got_V - reference.voltage_V) ** 2)))

    usual, finer = (simulate(pack, load, mesh=of(pack.cell)) for of in (mesh_of, fine_mesh_of))
    own = simulate_reference(reference)
    assert own.voltage_V == pytest.approx(finer.voltage_V, abs=1e-9)
    assert own.steps == finer.steps
    assert missed_V(own.voltage_V) < 1.2e-3 < 10e-3 < missed_V(usual.voltage_V)


def test_side_by_side_each_is_what_it_is_alone() -> None:
    asked = [(scarce(), bursts()), (scarce(), bursts(1.0)), (scarce(0.5), bursts())]
    for (pack, load), beside in zip(asked, simulate_all(asked), strict=True):
        alone = simulate(pack, load)
        assert beside.status is Status.DONE
        assert np.array_equal(alone.voltage_V, beside.voltage_V)
        assert alone.charge_C == pytest.approx(load.charge_C(), rel=1e-12)
        assert abs(alone.audit.relative_error) < 1e-12


@pytest.mark.parametrize("cut", [50, 150])  # there is salt left at the first of them
def test_a_run_goes_on_from_where_another_ended(cut: int) -> None:
    pack, whole = scarce(), bursts()
    first, rest = (
        Load(time_s=whole.time_s[own], current_A=whole.current_A[own])
        for own in (slice(cut + 1), slice(cut, None))
    )
    before = simulate(pack, first)
    after = simulate(pack, rest, state=before.end_state)
    together = simulate(pack, whole)
    assert after.voltage_V[1:] == pytest.approx(together.voltage_V[cut + 1 :], abs=1e-4)


def test_a_protocol_takes_the_finer_mesh_too() -> None:
    pack = Pack(cell=load_cell("lg_m50"))
    steps = ConstantCurrent(current_A=15.0, duration_s=400.0), Rest(duration_s=60.0)
    usual, finer = (
        run(pack, steps, settings=Settings(mesh=of(pack.cell))) for of in (mesh_of, fine_mesh_of)
    )
    own = run(pack, steps)
    for got, expected in zip(own.steps, finer.steps, strict=True):
        assert got.voltage_V == pytest.approx(expected.voltage_V, abs=1e-9)
    assert abs(usual.steps[0].voltage_V[-1] - own.steps[0].voltage_V[-1]) > 0.01
    assert own.end_state.size == usual.end_state.size
    assert abs(own.audit.relative_error) < 1e-12
    assert abs(own.audit.charge_error_C) < 1e-6


def test_amounts_are_kept_on_another_mesh_and_on_the_way_back() -> None:
    pack = replace(scarce(), effects=(*scarce().effects, Sei(), Plating(), Cracking()))
    usual, finer = pack_model(pack, None, Backend.AUTO), finer_model(pack, Backend.AUTO)
    (kind,) = kinds = pack.cells()
    time_s = np.arange(0.0, 60.0)
    state = simulate(pack, Load(time_s=time_s, current_A=np.full(60, 5.0))).end_state
    there = carried(state, kinds, usual, finer)
    amounts = (m.cell.lithium_mol(s, kind.values) for m, s in ((usual, state), (finer, there)))
    before, after = amounts
    assert after == pytest.approx(before, rel=1e-12, abs=1e-15)
    back = carried(there, kinds, finer, usual)
    assert back == pytest.approx(state, rel=1e-9, abs=1e-9)
    ledger = Ledger(pack)
    losses = [astuple(ledger.loss(s)) for s in (state, there)]
    assert losses[1] == pytest.approx(losses[0], rel=1e-9, abs=1e-9)
    assert losses[0] != pytest.approx(astuple(NOTHING), abs=1e-6)


@pytest.mark.long
def test_derivatives_hold_where_there_is_no_salt_left() -> None:
    pack, load, name = scarce(), bursts(), "electrolyte.diffusivity_factor"
    told = sensitivity(pack, load, [name])
    (effect,) = pack.effects
    assert isinstance(effect, ElectrolyteTransport)
    step = 1e-4
    up, down = (
        simulate(replace(pack, effects=(replace(effect, diffusivity_factor=0.6 + h),)), load)
        for h in (step, -step)
    )
    slope_V = (up.voltage_V - down.voltage_V) / (2 * step)
    assert told.solution.status is Status.DONE
    assert told.voltage[:, 0] == pytest.approx(slope_V, abs=0.01 * np.abs(slope_V).max())
