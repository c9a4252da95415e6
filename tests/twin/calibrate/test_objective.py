"""The map from parameters to the kernel, and exact derivatives of what is minimised."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import cell_pack, measured
from twin.at_rest import open_circuit_V
from twin.calibrate.cell_map import FILLERS, Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.polish import polish
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.refine import PARTS, refined
from twin.calibrate.run import problem_of
from twin.calibrate.simulated import Simulated
from twin.cell import Cell, Hysteresis
from twin.constants import FARADAY_C_mol
from twin.effects import OcvHysteresis
from twin.sensitivity import Sensitivities, sensitivity_of

FloatArray = npt.NDArray[np.float64]


@cache
def case(name: str = "lipo_2200", seed: int = 3) -> tuple[Problem, FloatArray]:
    pack = cell_pack(name)
    tests, truth, _ = measured(pack, seed, ("2C",))
    return problem_of(pack, tests), truth


@pytest.mark.parametrize("name", ["lipo_2200", "lg_m50"])
def test_the_cell_to_start_from_is_the_mean_of_the_prior(name: str) -> None:
    problem, _ = case(name)
    numbers = problem.mapped(np.zeros(len(problem.free)), 0).numbers
    given = problem.pack.cell_parameters()
    for key, value in numbers.items():
        if key != "initial_soc":  # files round their windows and areas to some digits
            assert value == pytest.approx(given[key], rel=5e-3), key


@pytest.mark.parametrize("name", ["lipo_2200", "lg_m50"])
def test_the_cell_to_start_from_has_filler_enough(name: str) -> None:
    """Also where it is told without: the truth may not be walled off."""
    problem, _ = case(name)
    missed = problem.missed_fillers(problem.mapped(np.zeros(len(problem.free)), 0).derived)[0]
    assert missed == pytest.approx(0.0, abs=1e-2)


def test_windows_end_at_given_voltages_and_both_electrodes_hold_the_capacity() -> None:
    problem, q = case()
    numbers = problem.mapped(q, 0).numbers
    given = problem.pack.cell_parameters()
    capacity = problem.values(q)[[p.name for p in problem.table].index("capacity_C")]
    for side in ("negative", "positive"):
        solid = numbers[f"{side}.specific_area_m2_m3"] * numbers[f"{side}.particle_radius_m"] / 3
        low, high = (numbers[f"{side}.stoichiometry_{end}"] for end in ("min", "max"))
        volume = given["area_m2"] * given[f"{side}.thickness_m"]
        most = FARADAY_C_mol * given[f"{side}.max_concentration_mol_m3"] * solid * volume
        assert most * (high - low) == pytest.approx(capacity, rel=1e-12)
    for soc in (0.0, 1.0):
        at_end_V = open_circuit_V(problem.pack.cell, soc)
        assert problem.rest_V(q, soc) == pytest.approx(at_end_V, abs=1e-9)


def branched(cell: Cell) -> Cell:
    """Its graphite between two branches of a file."""
    ocp_V = cell.negative.ocp_V
    branches = Hysteresis(
        lithiation_V=lambda x: ocp_V(x) - 0.01, delithiation_V=lambda x: ocp_V(x) + 0.02, decay=20.0
    )
    return replace(cell, negative_hysteresis=branches)


@pytest.mark.parametrize("of_file", [False, True])
def test_a_cell_with_hysteresis_starts_at_the_voltage_at_which_it_rested(*, of_file: bool) -> None:
    """Without, 4.105 V were the curve's, and the simulation began at 4.115 V."""
    made = cell_pack()
    test = measured(made, 3, ("2C",))[0][0]
    cell = branched(made.cell) if of_file else made.cell
    problem = problem_of(replace(made, cell=cell, effects=(OcvHysteresis(),)), [test])
    q = np.zeros(len(problem.free))
    assert problem.replayed(q, test, 4.105)[0] == pytest.approx(4.105, abs=1e-6)
    start_V, soc = problem.values(q)[-1], problem.mapped(q, 0).numbers["initial_soc"]
    assert problem.rest_V(q, soc) == pytest.approx(start_V, abs=1e-9)


@pytest.mark.parametrize("effects", [(), (OcvHysteresis(),)], ids=["plain", "hysteresis"])
def test_derivatives_are_those_of_the_residuals(effects: tuple[OcvHysteresis, ...]) -> None:
    problem, q = case()
    if effects:
        problem = Problem(replace(cell_pack(), effects=effects), problem.tests)
    residuals, slopes = problem.linearised(q)
    assert residuals == pytest.approx(problem.residuals(q))
    random = np.random.default_rng(1)
    for _ in range(4):  # directions that mix all parameters
        along = random.standard_normal(q.size)
        step = 1e-4
        change = problem.residuals(q + step * along) - problem.residuals(q - step * along)
        got, expected = slopes @ along, change / (2 * step)
        assert np.abs(got - expected).max() < 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize("value", [np.nan, 1e303])
def test_a_derivative_that_does_not_exist_counts_as_none(
    monkeypatch: pytest.MonkeyPatch, value: float
) -> None:
    """The root of what is left of room in a particle has none at 0.

    Along a potential that does not fall everywhere it grows without bound.
    """

    def broken(*given: Any, **options: Any) -> Sensitivities:
        s = sensitivity_of(*given, **options)
        s.voltage[-3:] = value
        return s

    problem, q = case()
    exact = problem.linearised(q)[1]
    monkeypatch.setattr("twin.calibrate.simulated.sensitivity_of", broken)
    slopes = problem.linearised(q)[1]
    lost = ~np.isclose(slopes, exact).all(axis=1)
    assert np.isfinite(slopes).all()
    assert 0 < lost.sum() <= 3
    assert np.all(slopes[lost] == 0.0)


def test_costs_of_many_points_are_those_of_each_and_always_finite() -> None:
    problem, _ = case()
    low, high = problem.bounds
    points = np.random.default_rng(0).random((6, low.size))
    costs = problem.costs(points)
    assert np.isfinite(costs).all()
    assert costs[2] == problem.cost(low + points[2] * (high - low))


def test_who_asks_again_for_a_point_waits_for_no_simulation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, q = case()
    plain, asked = problem._simulator.plain, []

    def counted(given: Sequence[Any]) -> list[Simulated]:
        asked.extend(given)
        return plain(given)

    monkeypatch.setattr(problem._simulator, "plain", counted)
    cost = problem.cost(q + 0.1)
    assert len(asked) == len(problem.tests)
    residuals = problem.residuals(q + 0.1)
    assert len(asked) == len(problem.tests)
    assert cost == 0.5 * float(residuals @ residuals)
    assert problem.cost(q) != cost
    assert len(asked) == 2 * len(problem.tests)


def test_whoever_comes_further_is_better() -> None:
    problem, truth = case()
    names = [p.name for p in problem.parameters]
    costs = []
    for capacity in (1.0, 0.8, 0.65):  # ever smaller cells are empty ever sooner
        q = truth.copy()
        place = names.index("capacity_C")
        parameter = problem.parameters[place]
        q[place] = parameter.coordinate(capacity * parameter.value(truth[place]))
        costs.append(problem.cost(q))
    assert costs == sorted(costs)
    assert costs[0] < 1e-2 * costs[1]


def test_what_coarse_steps_and_mesh_miss_is_added() -> None:
    problem, truth = case("lg_m50", 8)  # it keeps its salt: without, a minute is too long a step
    sample = problem.tests[0]
    load = refined(sample.load)
    fine = ReferenceTest(
        name="fine", time_s=load.time_s, current_A=load.current_A, voltage_V=0 * load.time_s
    )
    start_V = float(problem.values(truth)[-1])
    exact_V = problem.replayed(truth, fine, start_V)[::PARTS][sample.at]
    there = problem.refined(truth)
    assert there.simulated(truth, 0).voltage_V == pytest.approx(exact_V, abs=1e-9)
    coarse_V = problem.simulated(truth, 0).voltage_V
    assert np.sqrt(np.mean((coarse_V - exact_V) ** 2)) > 1e-4  # twenty times what a fit can tell
    near = truth + 0.02  # what is missed is nearly the same there
    again = there.simulated(near, 0).voltage_V - there.refined(near).simulated(near, 0).voltage_V
    assert np.sqrt(np.mean(again**2)) < 2e-5
    residuals, slopes = there.linearised(truth)
    assert residuals == pytest.approx(there.residuals(truth))
    assert slopes == pytest.approx(problem.linearised(truth)[1])


def test_what_is_held_stays_at_its_prior() -> None:
    problem, truth = case()
    held = problem.holding(["separator.porosity"])
    assert held.held.sum() == 1
    *_, last = polish(held, np.where(held.held, 0.0, truth))
    assert last.q[held.held] == 0.0
    assert np.abs(last.q[~held.held]).min() > 0
    assert not problem.of_other_tests(problem.tests).held.any()
    assert held.of_other_tests(problem.tests).held.sum() == 1


def test_values_that_no_cell_has_are_told() -> None:
    problem, truth = case()
    q = truth.copy()
    place = [p.name for p in problem.parameters].index("positive.stoichiometry_max")
    q[place] = problem.parameters[place].coordinate(0.2)  # the full end is at 0.24
    with pytest.raises(Infeasible):
        problem.mapped(q, 0)
    assert np.isfinite(problem.cost(q))


def test_an_electrode_does_not_hold_more_than_its_volume() -> None:
    """Below the least filler the misfit grows steeply, and its slope is that of the residuals."""
    problem, truth = case()
    q = truth.copy()
    place = [p.name for p in problem.parameters].index("negative.porosity")
    while problem.mapped(q, 0).derived[FILLERS][0] > -0.01:
        q[place] += 0.1
    missed = problem.missed_fillers(problem.mapped(q, 0).derived)[0]
    assert missed[0] > 15.0  # a hundredth below nothing; the prior alone says 2
    residuals, slopes = problem.linearised(q)
    step = np.zeros(q.size)
    step[place] = 1e-5
    change = (problem.residuals(q + step) - problem.residuals(q - step))[-2:] / 2e-5
    assert slopes[-2:, place] == pytest.approx(change, rel=1e-4, abs=1e-6)
    assert residuals == pytest.approx(problem.residuals(q))
