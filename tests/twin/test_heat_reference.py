"""Heat with every effect on: what PyBaMM leaves out of it, and that ours closes the balance.

PyBaMM takes the drop in the film out of the heat, and leaves out that of side reactions
(tests/reference/README.md). A film without resistance is how ours is told to do the first.
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.reference.ageing import ReferenceAgeing
from twin.builtin import load_cell
from twin.cell import Cell, Electrode
from twin.constants import FARADAY_C_mol
from twin.effects import (
    AGEING,
    ActiveMaterialLoss,
    AnyEffect,
    Plating,
    Sei,
    SelfHeating,
)
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution

ALL: tuple[AnyEffect, ...] = tuple(kind() for kind in AGEING)
NO_FILM = tuple(Sei(resistivity_ohm_m=0.0) if isinstance(e, Sei) else e for e in ALL)
U_NEGATIVE_V, U_POSITIVE_V = 0.1, 3.8


def warmed(reference: ReferenceAgeing, effects: tuple[AnyEffect, ...]) -> Solution:
    heating = SelfHeating(heat_transfer_W_m2_K=10.0)
    pack = Pack(cell=load_cell("lg_m50"), initial_soc=reference.charge, effects=(*effects, heating))
    whole = reference.load
    return simulate(pack, Load(time_s=whole.time_s, current_A=whole.current_A)).require()


@pytest.mark.parametrize("load", ["2C", "charge"])
def test_temperature_agrees_with_pybamm_but_for_the_heat_of_the_film(load: str) -> None:
    reference = ReferenceAgeing.read(f"ageing-{load}-all-lumped")
    expected_K = reference.outputs.temperature_K
    without, with_ = (warmed(reference, e).temperature_K for e in (NO_FILM, ALL))
    assert np.abs(without - expected_K).max() < 0.05
    assert np.abs(with_ - expected_K).max() > 0.05
    assert with_[-1] > without[-1]


def flat(electrode: Electrode, potential_V: float) -> Electrode:
    """Its potential the same at every stoichiometry: lithium's energy is then its amount."""
    return replace(electrode, ocp_V=lambda x: 0 * x + potential_V, entropic_V_K=lambda x: 0 * x)


@pytest.fixture(scope="module")
def level() -> Cell:
    cell = load_cell("lg_m50")
    return replace(
        cell,
        negative=flat(cell.negative, U_NEGATIVE_V),
        positive=flat(cell.positive, U_POSITIVE_V),
    )


@pytest.mark.parametrize(
    ("effects", "within"),
    [
        ((), 1e-11),
        ((Sei(),), 1e-11),
        ((ActiveMaterialLoss(),), 1e-11),
        ((Plating(),), 1e-5),  # its current is the mean of a step: 4e-4 of 246 J at 0.5 s a step
        (ALL, 1e-5),
    ],
)
def test_work_and_heat_are_what_the_lithium_gives(
    level: Cell, effects: tuple[AnyEffect, ...], within: float
) -> None:
    """Lithium in films and metal has none of its energy left: they stand at 0 V."""
    pack = Pack(
        cell=level, initial_soc=0.7, effects=(*effects, SelfHeating(heat_transfer_W_m2_K=0.0))
    )
    time_s = np.arange(0.0, 300.0, 0.5)
    current_A = 5 + 4 * np.sin(time_s / 7) + np.random.default_rng(0).normal(0, 1, time_s.size)
    solution = simulate(pack, Load(time_s=time_s, current_A=current_A)).require()
    heat_J = level.heat_capacity_J_K * (solution.temperature_K[-1] - 298.15)
    given_J = FARADAY_C_mol * (
        U_NEGATIVE_V * taken_up_mol(solution, "negative")
        + U_POSITIVE_V * taken_up_mol(solution, "positive")
    )
    missing_J = work_J(time_s, current_A, solution.voltage_V) + heat_J - given_J
    assert abs(missing_J) < within * heat_J


def taken_up_mol(solution: Solution, side: str) -> float:
    """By the particles of a side; what was trapped in lost ones was taken up before."""
    audit = solution.audit
    start, end = audit.negative_mol if side == "negative" else audit.positive_mol
    trapped = audit.lost_mol.get(f"trapped_{side}", np.zeros(2))
    return float(end - start + trapped[1] - trapped[0])


def work_J(time_s: np.ndarray, current_A: np.ndarray, voltage_V: np.ndarray) -> float:
    """Delivered, voltage and current running straight from sample to sample."""
    i, v = (np.array([x[:-1], x[1:]]) for x in (current_A, voltage_V))
    mean_W = (i[0] * v[0] + i[1] * v[1]) / 3 + (i[0] * v[1] + i[1] * v[0]) / 6
    return float(np.diff(time_s) @ mean_W)
