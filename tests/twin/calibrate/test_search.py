import json
import pickle
from collections.abc import Callable
from itertools import islice

import numpy as np
import numpy.typing as npt
import pytest

from benchmarks.search_landscapes import LANDSCAPES
from twin.calibrate.search import MEMBERS, Best, Journal, SearchError, Stage, search
from twin.calibrate.search.landscape import landscape, suitability
from twin.calibrate.search.promise import expected, remaining

FloatArray = npt.NDArray[np.float64]
Cost = Callable[[FloatArray], FloatArray]

SOLVED_WITHIN = (  # evaluations, with room for other arithmetic
    ("sphere", 10, 1_500),
    ("sphere", 20, 2_500),
    ("ellipsoid, turned", 10, 3_000),
    ("ellipsoid, turned", 20, 11_000),
    ("rosenbrock", 10, 5_500),
    ("ackley, turned", 10, 3_000),
    ("ackley, turned", 20, 5_500),
    ("griewank, turned", 10, 15_000),
    ("schwefel", 10, 12_000),
)


def usual(cost: Cost, dimension: int) -> float:
    return float(np.median(cost(np.random.default_rng(99).random((1000, dimension)))))


def solved_after(
    name: str, dimension: int, seed: int, budget: int, members: tuple[str, ...] = tuple(MEMBERS)
) -> float:
    cost = LANDSCAPES[name].at(dimension, seed)
    goal = 1e-6 * usual(cost, dimension)
    steps = search(cost, dimension, seed=seed, evaluations=budget, members=members)
    return next((b.evaluations for b in steps if b.cost <= goal), np.inf)


@pytest.mark.parametrize(("name", "dimension", "budget"), SOLVED_WITHIN)
def test_finds_the_optimum_wherever_it_is(name: str, dimension: int, budget: int) -> None:
    assert solved_after(name, dimension, 3, budget) <= budget


@pytest.mark.parametrize("name", ["sphere", "rosenbrock", "ackley, turned"])
def test_where_one_member_suits_the_tests_of_the_others_cost_a_tenth_at_most(name: str) -> None:
    alone = solved_after(name, 10, 3, 6000, members=("cma",))
    assert solved_after(name, 10, 3, 6000) <= 1.12 * alone  # a tenth of all, ninth of the rest


def test_a_slow_member_that_goes_on_falling_takes_over_from_a_fast_one_that_ends_early() -> None:
    assert solved_after("rastrigin", 10, 2, 20_000, members=("cma",)) == np.inf
    assert solved_after("rastrigin", 10, 2, 20_000) <= 20_000


def test_rastrigin_is_left_alone_by_no_local_optimum() -> None:
    cost = LANDSCAPES["rastrigin"].at(5, 1)
    assert any(b.cost < 1e-3 for b in search(cost, 5, seed=1, evaluations=12_000))


def stamps(bests: list[Best]) -> list[tuple[object, ...]]:
    return [(*b.point, b.cost, b.evaluations, b.algorithm, b.stage) for b in bests]


@pytest.fixture(scope="module")
def rastrigin() -> Cost:
    return LANDSCAPES["rastrigin, turned"].at(6, 2)


@pytest.fixture(scope="module")
def whole(rastrigin: Cost) -> list[Best]:
    return list(search(rastrigin, 6, seed=4, evaluations=6000))


def test_the_seed_fixes_the_course(rastrigin: Cost, whole: list[Best]) -> None:
    np.random.seed(7)  # noqa: NPY002 - the libraries could draw from the global generator
    again = list(search(rastrigin, 6, seed=4, evaluations=6000))
    other = list(search(rastrigin, 6, seed=5, evaluations=500))
    assert stamps(again) == stamps(whole)
    assert stamps(other) != stamps(whole)[: len(other)]


def test_every_member_and_every_stage_has_its_turn(whole: list[Best]) -> None:
    assert {b.algorithm for b in whole} == {"sample", *MEMBERS}
    assert {b.stage for b in whole} == set(Stage)


def test_costs_never_rise_and_evaluations_add_up(whole: list[Best]) -> None:
    costs = np.array([b.cost for b in whole])
    counts = np.array([b.evaluations for b in whole])
    assert (np.diff(costs) <= 0).all()
    assert (np.diff(counts) > 0).all()
    assert counts[-1] == 6000
    assert np.median(np.diff(counts)) >= 8  # batches that fill the cores


@pytest.mark.parametrize("batches", [0, 1, 7, 150])
def test_goes_on_from_its_journal_as_if_never_stopped(
    rastrigin: Cost, whole: list[Best], batches: int
) -> None:
    journal = Journal()
    list(islice(search(rastrigin, 6, seed=4, evaluations=6000, state=journal), batches))
    before = len(journal)
    kept = Journal.from_json(journal.to_json())
    rest = list(search(rastrigin, 6, seed=4, evaluations=6000, state=kept))
    assert stamps(rest) == stamps(whole)[max(0, batches - 1) :]
    assert len(kept) == 6000
    assert (kept.costs[:before] == pickle.loads(pickle.dumps(journal)).costs).all()


def test_a_batch_cut_short_by_the_budget_is_completed_later(
    rastrigin: Cost, whole: list[Best]
) -> None:
    journal = Journal()
    list(search(rastrigin, 6, seed=4, evaluations=1003, state=journal))
    assert len(journal) == 1003
    rest = list(search(rastrigin, 6, seed=4, evaluations=6000, state=journal))
    assert stamps(rest) == stamps(whole)[-len(rest) :]


def test_a_finished_journal_is_not_evaluated_again(rastrigin: Cost) -> None:
    journal = Journal()
    last = list(search(rastrigin, 6, seed=4, evaluations=800, state=journal))[-1]

    def never(points: FloatArray) -> FloatArray:
        raise AssertionError(points)

    [again] = search(never, 6, seed=4, evaluations=800, state=journal)
    assert (again.cost, again.evaluations) == (last.cost, last.evaluations)


def test_the_journal_of_another_search_is_refused(rastrigin: Cost) -> None:
    journal = Journal()
    list(search(rastrigin, 6, seed=4, evaluations=300, state=journal))
    with pytest.raises(SearchError, match="another seed"):
        list(search(rastrigin, 6, seed=5, evaluations=600, state=journal))
    with pytest.raises(SearchError, match="another seed"):
        list(search(rastrigin, 7, seed=4, evaluations=600, state=journal))


def test_no_point_is_outside_even_if_the_optimum_is() -> None:
    outside = np.array([-0.3, 0.0, 1.0, 1.4, 0.5])

    def cost(points: FloatArray) -> FloatArray:
        assert ((points >= 0) & (points <= 1)).all()
        return np.asarray(((points - outside) ** 2).sum(axis=1))

    last = list(search(cost, 5, seed=0, evaluations=4000))[-1]
    assert last.point == pytest.approx(np.clip(outside, 0, 1), abs=1e-4)
    assert last.cost == pytest.approx(0.3**2 + 0.4**2, abs=1e-6)


def test_finds_its_way_off_a_plateau_of_failures() -> None:
    inner = LANDSCAPES["ellipsoid, turned"].at(6, 0)
    there = np.random.default_rng([0, 6]).uniform(0.2, 0.8, 6)  # as the landscape draws it
    assert inner(there[None])[0] == 0

    def cost(points: FloatArray) -> FloatArray:
        failed = (np.abs(points[:, :3] - there[:3]) > 0.25).any(axis=1)
        return np.where(failed, 1e6, inner(points))

    *_, first = search(cost, 6, seed=1, evaluations=48)
    assert first.evaluations == 48
    assert (cost(np.random.default_rng(0).random((1000, 6))) == 1e6).mean() > 0.8
    goal = 1e-6 * usual(inner, 6)
    assert any(b.cost <= goal for b in search(cost, 6, seed=1, evaluations=8000))


def test_nothing_but_plateau_is_survived() -> None:
    flat = list(search(lambda p: np.full(len(p), 1e6), 4, seed=0, evaluations=2000))
    assert flat[-1].evaluations == 2000
    assert flat[-1].cost == 1e6


def test_the_start_is_evaluated_first_and_used() -> None:
    cost = LANDSCAPES["schwefel"].at(10, 3)
    asked: list[FloatArray] = []

    def watched(points: FloatArray) -> FloatArray:
        asked.append(points)
        return cost(points)

    start = np.full((2, 10), [[0.25], [0.75]])
    next(iter(search(watched, 10, seed=0, evaluations=50, start=start)))
    assert (asked[0][:2] == start).all()


def test_works_in_one_dimension() -> None:
    cost = LANDSCAPES["rastrigin"].at(1, 0)
    assert any(b.cost < 1e-6 for b in search(cost, 1, seed=0, evaluations=1000))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_costs_that_are_no_numbers_are_refused(value: float) -> None:
    with pytest.raises(SearchError, match="large finite cost"):
        next(search(lambda p: np.full(len(p), value), 2, seed=0, evaluations=100))


def test_arguments_that_do_not_fit_are_refused() -> None:
    def cost(points: FloatArray) -> FloatArray:
        return points[:1, 0]

    with pytest.raises(SearchError, match=r"\(1,\) costs"):
        next(search(cost, 2, seed=0, evaluations=100))
    with pytest.raises(SearchError, match="start"):
        search(cost, 2, seed=0, evaluations=100, start=[0.5])
    with pytest.raises(SearchError, match="within 0 and 1"):
        search(cost, 2, seed=0, evaluations=100, start=[0.5, 1.1])
    with pytest.raises(SearchError, match="members"):
        search(cost, 2, seed=0, evaluations=100, members=("best",))
    with pytest.raises(SearchError, match="evaluations 0"):
        search(cost, 2, seed=0, evaluations=0)
    for text in ("[]", "{}", json.dumps({"points": [[1.0]], "costs": [1.0, 2.0]}), "no"):
        with pytest.raises(SearchError, match="journal"):
            Journal.from_json(text)


def test_a_straight_line_is_believed_as_far_as_it_is_told() -> None:
    line = [10.0 - k for k in range(5)]
    assert expected(line, 1.0) == pytest.approx(10.0 - 8.0)
    assert expected(line, 4.0) == pytest.approx(10.0 - 20.0)
    assert expected(line[:1], 1.0) == -np.inf
    assert remaining(line) == np.inf


@pytest.mark.parametrize("slices", [3, 8, 17])
def test_what_remains_of_a_geometric_series_is_exact(slices: int) -> None:
    levels = [7.0 + 3.0 * 0.6**k for k in range(slices + 1)]
    assert remaining(levels) == pytest.approx(levels[-1] - 7.0)
    assert remaining([5.0, 4.0, 4.0]) == 0.0


def test_features_tell_a_bowl_from_a_rugged_plane() -> None:
    random = np.random.default_rng(0)
    points = random.random((200, 5))
    bowl = landscape(points, LANDSCAPES["sphere"].at(5, 0)(points))
    rugged = landscape(points, random.random(200))
    assert bowl.bowl > 0.8 > 0.2 > rugged.bowl
    assert bowl.funnel > 0.5 > 0.2 > abs(rugged.funnel)
    assert rugged.ruggedness > 0.7 > bowl.ruggedness
    assert rugged.dispersion > bowl.dispersion
    assert suitability(bowl)["cma"] > suitability(rugged)["cma"]
    assert suitability(bowl)["de"] < suitability(rugged)["de"]


def test_features_do_not_depend_on_the_scale_of_the_cost() -> None:
    points = np.random.default_rng(1).random((100, 4))
    costs = LANDSCAPES["rosenbrock"].at(4, 0)(points)
    assert landscape(points, costs) == landscape(points, np.exp(costs / costs.max()) - 7)
