"""Sensitivities against central differences of runs solved to rounding, and exact relations."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from twin import limits, newton, pack_model
from twin.bpx_function import Table
from twin.builtin import load_cell
from twin.cell import Cell
from twin.cell_mesh import DEFAULT_MESH
from twin.compiled import compiler
from twin.effects import (
    AGEING,
    ActiveMaterialLoss,
    AnyEffect,
    Cracking,
    Mechanics,
    Plating,
    PorosityChange,
    Sei,
    SeiOnCracks,
    SelfHeating,
    StressEnhancedDiffusion,
    VoltageGain,
)
from twin.kernel import Backend
from twin.load import Between, Load
from twin.mesh import Mesh, electrode_mesh
from twin.pack import Pack, PackError
from twin.sensitivity import sensitivity
from twin.simulate import Run, changeable, solution_of
from twin.solution import Status

NAMES = (
    "negative.particle_radius_m",
    "positive.diffusivity_factor",
    "electrolyte.conductivity_factor",
    "negative.porosity",
    "area_m2",
    "initial_soc",
    "initial_K",
    "heat_transfer_W_m2_K",
    "ambient_K",
)
STEP = 1e-3  # relative; error of the difference goes as its fourth power, rounding as its inverse

STEP_AT_0 = {
    "film_ohm_m2": 1e-5,
    "resistance_ohm": 1e-5,
    "outside_ohm": 1e-5,
    "activation_J_mol": 100.0,
    "_V_K": 1e-5,
}
COARSE = electrode_mesh((0.0, 1.0), (2,))  # derivatives are exact on any mesh
HARSH = (  # years of ageing within half a minute
    StressEnhancedDiffusion(),
    Sei(solvent_diffusivity_m2_s=2.5e-18),
    SeiOnCracks(),
    Plating(rate_constant_m_s=1e-6, decay_1_s=1e-3, initial_mol_m3=10.0),
    Cracking(paris_rate=3.9e-16),
    ActiveMaterialLoss(rate_1_s=1e-2),
    PorosityChange(),
)


@pytest.fixture
def to_rounding(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Newton goes on to 1e-9 V: the difference of two runs has no error of its own from it."""
    for module in (newton, limits):
        monkeypatch.setattr(module, "CONVERGED_V", 1e-9)
    yield from _without_cached_kernels()


def _without_cached_kernels() -> Iterator[None]:
    pack_model.forget()
    yield
    pack_model.forget()


def flight(
    between: Between, seconds: float = 30.0, mean_A: float = 10.0, charging_s: float = 0.0
) -> Load:
    t = np.arange(0.0, seconds, 0.1)
    current = mean_A * (1 + 0.2 * np.random.default_rng(7).standard_normal(t.size))
    current[t >= seconds - charging_s] *= -0.25
    return Load(time_s=t, current_A=current, between=between, ambient_K=290.0)


def difference(
    pack: Pack, load: Load, name: str, value: float, mesh: Mesh = DEFAULT_MESH
) -> tuple[np.ndarray, np.ndarray]:
    """Of voltage and temperature: central, extrapolated from two steps to fourth order."""
    step = step_of(name, value)
    wide, narrow = (central(pack, load, name, value, h, mesh) for h in (step, step / 2))
    return tuple((4 * n - w) / 3 for n, w in zip(narrow, wide, strict=True))


def central(
    pack: Pack, load: Load, name: str, value: float, step: float, mesh: Mesh
) -> list[np.ndarray]:
    whole, ends = changeable(pack, load), []
    for changed in (value + step, value - step):
        run = Run(pack, load, mesh, Backend.AUTO, None)
        run.change(whole | {name: changed})
        run.run()
        ends.append(solution_of(run, pack, load))
    high, low = ((end.voltage_V, end.temperature_K) for end in ends)
    return [(h - low_) / (2 * step) for h, low_ in zip(high, low, strict=True)]


def step_of(name: str, value: float) -> float:
    """Temperatures have a zero far away; a number that is 0 says nothing of its size."""
    if name.endswith("_K") and value > 200:
        return 0.1
    return STEP * value or next(v for end, v in STEP_AT_0.items() if name.endswith(end))


def with_tables() -> Cell:
    """Rows on straight lines: differences see no jump of a slope."""
    cell = load_cell("lg_m50")

    def of(low: float, middle: float, high: float) -> Table:
        return Table((0.0, 0.5, 1.0), (low, middle, high))

    n, p = (
        replace(e, entropic_V_K=of(1e-4, 0.0, -1e-4), diffusivity_m2_s=of(3e-14, 2e-14, 1e-14))
        for e in (cell.negative, cell.positive)
    )
    return replace(
        cell,
        negative=replace(n, ocp_V=of(0.3, 0.2, 0.1)),
        positive=replace(p, ocp_V=of(4.5, 4, 3.5)),
    )


@pytest.mark.parametrize(
    ("cell", "effects", "between"),
    [(load_cell("lg_m50"), HARSH, Between.LINEAR),
     pytest.param(load_cell("lipo_2200"), HARSH, Between.HOLD, marks=pytest.mark.long),
     (load_cell("lg_m50"), (), Between.HOLD),
     pytest.param(with_tables(), HARSH, Between.HOLD, marks=pytest.mark.long)],
    ids=["lg_m50", "lipo_2200", "without ageing", "tables"],
)  # fmt: skip
@pytest.mark.usefixtures("to_rounding")
def test_derivatives_by_every_number_are_the_limit_of_differences(
    cell: Cell, effects: tuple[AnyEffect, ...], between: Between
) -> None:
    pack = Pack(
        cell=cell, series=3, capacity_C=18000.0, initial_soc=0.6,
        effects=(SelfHeating(), VoltageGain(gain=1.05), *effects),
    )  # fmt: skip
    load = flight(between, charging_s=10.0)
    names = tuple(changeable(pack, load))
    exact = sensitivity(pack, load, names, mesh=COARSE)
    assert exact.solution.status is Status.DONE
    for i, name in enumerate(names):
        value = float(exact.values[i])
        near = difference(pack, load, name, value, COARSE)
        rounding = 1e-10 / abs(step_of(name, value))
        for got, want in zip((exact.voltage, exact.temperature), near, strict=True):
            assert got[:, i] == pytest.approx(want, abs=1e-6 * np.abs(want).max() + rounding), name


def test_ageing_is_harsh_enough_for_every_number_of_it_to_be_seen() -> None:
    pack = Pack(cell=load_cell("lg_m50"), initial_soc=0.6, initial_K=288.15, effects=HARSH)
    load = flight(Between.LINEAR, charging_s=10.0)
    there = changeable(pack, load)
    ids = tuple(f"{e.id}." for e in (*AGEING, Mechanics))
    names = tuple(n for n in there if n.startswith(ids))
    response = sensitivity(pack, load, names, mesh=COARSE)
    seen_V = np.abs(response.voltage).max(axis=0) * [abs(there[n]) for n in names]
    assert dict(zip(names, seen_V > 1e-6, strict=True)) == dict.fromkeys(names, True)


def test_at_the_kernels_own_tolerance_they_are_right_to_a_ten_thousandth() -> None:
    pack, load = Pack(cell=load_cell("lg_m50")), flight(Between.LINEAR)
    exact = sensitivity(pack, load, NAMES[:2])
    for i, name in enumerate(NAMES[:2]):
        near, _ = difference(pack, load, name, float(exact.values[i]))
        assert exact.voltage[:, i] == pytest.approx(near, abs=1e-4 * np.abs(near).max())


def test_where_a_run_ends_early_the_derivatives_end_with_it() -> None:
    pack, load = Pack(cell=load_cell("lg_m50"), initial_soc=0.05), flight(Between.HOLD, 90.0)
    part = sensitivity(pack, load, NAMES[:1], mesh=COARSE)
    n = part.solution.voltage_V.size
    assert part.solution.status is not Status.DONE
    assert 10 < n < load.time_s.size
    assert part.voltage.shape == part.temperature.shape == (n, 1)
    before = Load(time_s=load.time_s[:n], current_A=load.current_A[:n], between=Between.HOLD)
    assert np.array_equal(
        part.voltage[:-1], sensitivity(pack, before, NAMES[:1], mesh=COARSE).voltage[:-1]
    )


def test_many_parameters_give_what_each_gives_alone() -> None:
    pack, load = Pack(cell=load_cell("lg_m50")), flight(Between.LINEAR, 60.0)  # more than a chunk
    together = sensitivity(pack, load, NAMES[:6], mesh=COARSE)
    for i in (0, 3, 5):
        alone = sensitivity(pack, load, NAMES[i : i + 1], mesh=COARSE)
        scale = np.abs(alone.voltage).max()
        assert together.voltage[:, [i]] == pytest.approx(alone.voltage, abs=1e-11 * scale)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("effects", [(), (SelfHeating(), *HARSH)])
def test_vectors_of_directions_give_what_casadi_gives(effects: tuple[AnyEffect, ...]) -> None:
    pack = Pack(cell=load_cell("lg_m50"), effects=effects)
    load = flight(Between.LINEAR, charging_s=10.0)
    lanes, plain = (
        sensitivity(pack, load, NAMES[:4], mesh=COARSE, backend=backend).voltage
        for backend in (Backend.AUTO, Backend.VIRTUAL_MACHINE)
    )
    assert np.all(np.abs(lanes - plain) < 1e-8 * np.abs(plain).max(axis=0))


def test_an_unknown_name_is_refused_and_the_known_ones_told() -> None:
    with pytest.raises(PackError, match=r"'radius' is unknown.*particle_radius_m"):
        sensitivity(Pack(cell=load_cell("lg_m50")), flight(Between.HOLD), ["radius"])
