"""Many members in one call: the same numbers as one by one, and no member harms another."""

import numpy as np
import pytest

from twin.builtin import load_cell
from twin.load import Load
from twin.pack import Pack, PackError
from twin.population import PopulationError, population
from twin.simulate import simulate
from twin.solution import Status

T_S = np.arange(0.0, 20.0, 0.1)
LOAD = Load(time_s=T_S, current_A=10 + 3 * np.sin(T_S))
PACK = Pack(cell=load_cell("lg_m50"), series=2, parallel=2)


def test_each_member_is_what_a_simulation_of_it_gives() -> None:
    socs = [0.3, 0.6, 0.9]
    many = population(PACK, LOAD, ["initial_soc"], [[soc] for soc in socs])
    for soc, voltage_V in zip(socs, many.voltage_V, strict=True):
        pack = Pack(cell=PACK.cell, series=2, parallel=2, initial_soc=soc)
        assert np.array_equal(voltage_V, simulate(pack, LOAD).voltage_V)
    assert many.status == (Status.DONE,) * 3
    assert np.all(many.stopped_s == T_S[-1])


def test_threads_give_the_same_numbers_in_the_same_order() -> None:
    radii = np.linspace(3e-6, 9e-6, 11)[:, None]
    alone, shared = (
        population(PACK, LOAD, ["negative.particle_radius_m"], radii, workers=w) for w in (1, 3)
    )
    assert np.array_equal(alone.voltage_V, shared.voltage_V)
    assert np.array_equal(alone.temperature_K, shared.temperature_K)
    assert alone.status == shared.status


def test_members_that_fail_cost_only_themselves() -> None:
    names = ["initial_soc", "negative.particle_radius_m"]
    good = [0.8, 5.86e-6]
    rows = [good, [0.8, np.nan], [0.02, 5.86e-6], [0.8, 0.0], good]
    many = population(PACK, LOAD, names, rows)
    assert many.status[0] is many.status[4] is Status.DONE
    assert np.array_equal(many.voltage_V[0], many.voltage_V[4])
    assert many.status[1] is many.status[3] is Status.NOT_CONVERGED
    assert not np.isfinite(many.voltage_V[[1, 3]]).any()
    assert many.status[2] in (Status.LOWER_CUT_OFF, Status.ELECTRODE_EMPTY)
    simulated = np.isfinite(many.voltage_V[2])
    assert np.array_equal(simulated, many.stopped_s[2] >= T_S)


def test_what_does_not_fit_is_refused_by_name() -> None:
    with pytest.raises(PackError, match="radius"):
        population(PACK, LOAD, ["radius"], [[1.0]])
    with pytest.raises(PopulationError, match=r"\(members, 1\)"):
        population(PACK, LOAD, ["initial_soc"], [0.5])
    with pytest.raises(PopulationError, match="workers"):
        population(PACK, LOAD, ["initial_soc"], [[0.5]], workers=0)


def test_no_members_is_an_empty_answer() -> None:
    many = population(PACK, LOAD, ["initial_soc"], np.zeros((0, 1)))
    assert many.voltage_V.shape == (0, T_S.size)
    assert many.status == ()
