"""Cells side by side: each as if it were alone, whatever the others do."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from twin import compiled
from twin.builtin import load_cell
from twin.cell_mesh import DEFAULT_MESH
from twin.effects import OcvHysteresis, Sei, SelfHeating, WeakCell
from twin.kernel import CHUNK, Backend
from twin.lanes import LANES
from twin.load import Load
from twin.pack import Pack
from twin.pack_model import Asked, pack_model, steps_of
from twin.simulate import Run, run_abreast, simulate, simulate_all
from twin.solution import Status

FloatArray = npt.NDArray[np.float64]

M50 = Pack(cell=load_cell("lg_m50"))
T_S = np.arange(0.0, 30.0, 0.1)


def gusty(seed: int, mean_A: float = 10.0, seconds: float = 30.0) -> Load:
    t = T_S[seconds > T_S]
    noise = np.random.default_rng(seed).standard_normal(t.size)
    return Load(time_s=t, current_A=mean_A * (1 + 0.3 * noise))


def asked(pack: Pack, load: Load, backend: Backend = Backend.AUTO) -> Asked:
    return Run(pack, load, DEFAULT_MESH, backend, None).ahead()


calm = asked(M50, gusty(1, 0.01))
wild = asked(replace(M50, initial_soc=0.4), gusty(2, 25.0))
broken = calm._replace(p=np.where(np.arange(calm.p.size) == 0, np.nan, calm.p))


def alone(one: Asked) -> tuple[FloatArray, FloatArray]:
    return one.model.steps(one.state, one.drive, one.p)


@pytest.mark.parametrize("cells", range(1, 2 * LANES + 1))
def test_each_gives_to_the_bit_what_it_gives_alone(cells: int) -> None:
    """One needs no iteration, another several, a third has no solution."""
    several = [(calm, wild, broken)[k % 3] for k in range(cells)]
    expected = {id(own): alone(own) for own in (calm, wild, broken)}
    for own, (states, out) in zip(several, steps_of(several), strict=True):
        assert np.array_equal(states, expected[id(own)][0], equal_nan=True)
        assert np.array_equal(out, expected[id(own)][1], equal_nan=True)
    assert np.isnan(expected[id(broken)][1]).any()


def test_one_with_fewer_steps_gets_so_many() -> None:
    short = asked(M50, gusty(3, seconds=5.0))
    whole, cut = steps_of([wild, short])
    assert whole[1].shape[0] == CHUNK
    assert cut[0].shape[0] == cut[1].shape[0] == 50
    assert np.array_equal(cut[1], alone(short)[1])


@pytest.mark.skipif(compiled.compiler() is None, reason="no C compiler")
@pytest.mark.parametrize(
    "effects",
    [(), (SelfHeating(), Sei()), (OcvHysteresis(),), (WeakCell(soc_offset=-0.05),)],
    ids=["bare", "ageing", "hysteretic", "two kinds"],
)
def test_the_lanes_compute_what_casadi_does(effects: tuple[object, ...]) -> None:
    """Of cells that differ, in jumps that take several iterations.

    One more of these or one less, where rounding decides, is worth 1e-7.
    """
    packs = [Pack(cell=M50.cell, series=2, initial_soc=s, effects=effects) for s in (0.3, 0.9)]
    loads = [gusty(4), gusty(5, 20.0)]
    ours, theirs = (
        [asked(*each, backend) for each in zip(packs, loads, strict=True)] for backend in Backend
    )
    for own, other in zip(steps_of(ours), map(alone, theirs), strict=True):
        for a, b in zip(own, other, strict=True):
            assert a == pytest.approx(b, rel=1e-6, abs=1e-8)


def test_runs_that_end_leave_the_others_going() -> None:
    loads = [gusty(seed, seconds=s) for seed, s in ((6, 30.0), (7, 10.0), (8, 30.0))]
    packs = [M50, M50, replace(M50, initial_soc=0.004)]
    runs = [Run(*each, DEFAULT_MESH, Backend.AUTO, None) for each in zip(packs, loads, strict=True)]
    run_abreast(runs)
    assert [run.status is Status.DONE for run in runs] == [True, True, False]
    assert not any(run.goes_on for run in runs)
    pairs = [*zip(packs, loads, strict=True)]
    for own, pair in zip(simulate_all(pairs), pairs, strict=True):
        expected = simulate(*pair)
        assert own.status is expected.status
        assert np.array_equal(own.voltage_V, expected.voltage_V)
        assert np.array_equal(own.end_state, expected.end_state)


def test_packs_with_other_equations_and_more_cells_than_lanes_are_simulated_together() -> None:
    kinds = [WeakCell(cell=k, soc_offset=-0.02 * (k + 1)) for k in range(LANES)]
    packs = [
        M50,
        replace(M50, effects=(OcvHysteresis(),)),
        replace(M50, series=LANES + 1, effects=tuple(kinds)),
        replace(M50, initial_soc=0.5),
    ]
    load = gusty(9, 5.0, seconds=10.0)
    for pack, own in zip(packs, simulate_all([(p, load) for p in packs]), strict=True):
        assert np.array_equal(own.cell_voltage_V, simulate(pack, load).cell_voltage_V)
    assert simulate_all([]) == []
    assert len(pack_model(packs[2], DEFAULT_MESH, Backend.AUTO).counts) == LANES + 1
