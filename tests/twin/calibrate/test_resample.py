"""Few samples that tell as much as all."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import PROTOCOLS, cell_pack, empty_tests
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import STEEP, local_means, noise_of, sampled
from twin.calibrate.run import problem_of
from twin.load import Between


def of(name: str) -> tuple[Problem, ReferenceTest]:
    """A test of the cell as it is given, without noise, of what can be simulated."""
    pack = cell_pack()
    (blank,) = empty_tests(pack, (name,))
    problem = problem_of(pack, [blank])
    voltage_V = problem.replayed(np.zeros(len(problem.free)), blank, pack.cell.upper_cut_off_V)
    test = replace(blank, voltage_V=voltage_V)
    over = ~(voltage_V >= pack.cell.lower_cut_off_V)
    stop = int(np.argmax(over)) if over.any() else voltage_V.size
    cut = {n: getattr(test, n)[:stop] for n in ("time_s", "current_A", "voltage_V")}
    return problem, replace(test, **cut)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_the_charge_is_kept_to_rounding(name: str) -> None:
    _, test = of(name)
    few = sampled(test, 7920.0)
    assert few.load.charge_C() == pytest.approx(test.drawn_C()[-1], rel=1e-12)
    assert few.drawn_C == pytest.approx(few.load.drawn_C()[few.at], abs=1e-6)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_long_steps_and_means_miss_less_than_half_a_millivolt(name: str) -> None:
    problem, test = of(name)
    few = sampled(test, 7920.0)
    start = np.zeros(len(problem.free))
    there = problem.of_other_tests((replace(few, start_V=problem.pack.cell.upper_cut_off_V),))
    error = there.simulated(start, 0).voltage_V - few.voltage_V
    settled = few.voltage_V > 3.3  # below, the fall itself takes a few seconds
    assert np.sqrt(np.mean(error[settled] ** 2)) < 2e-4
    assert np.abs(error[settled]).max() < 2e-3
    assert few.load.time_s.size < 1500


def test_ten_hours_do_not_drown_pulses() -> None:
    slow, pulsed = (sampled(of(name)[1], 7920.0) for name in ("0.1C", "pulses"))
    weight = [float(np.sum(t.sigma_V**-2.0)) for t in (slow, pulsed)]
    assert 0.5 < weight[0] / weight[1] < 2.0


def test_noise_is_seen_in_a_voltage_that_moves() -> None:
    random = np.random.default_rng(0)
    t = np.arange(5000.0)
    test = ReferenceTest(
        name="t", time_s=t, current_A=np.where(t < 2500, 1.0, 2.0),
        voltage_V=4.0 - 1e-4 * t - 0.1 * (t >= 2500) + 2e-3 * random.standard_normal(t.size),
    )  # fmt: skip
    assert noise_of(test) == pytest.approx(2e-3, rel=0.05)  # 5000 samples: 2 % of the median


def test_a_mean_over_uneven_times_keeps_a_slope() -> None:
    t = np.array([0.0, 1, 2, 3, 4, 7, 10, 13, 16, 19, 22, 25, 28])
    test = ReferenceTest(name="t", time_s=t, current_A=np.ones(t.size), voltage_V=4.0 - 1e-3 * t)
    index = np.array([0, 4, 8, 12])
    voltage_V, count = local_means(test, index, np.array([0]))
    assert count.tolist() == [1, 5, 5, 1]
    assert voltage_V == pytest.approx(test.voltage_V[index], abs=1e-12)


def test_a_current_that_runs_straight_keeps_every_sample() -> None:
    random = np.random.default_rng(0)
    t = np.arange(0.0, 30.0, 0.1)
    test = ReferenceTest(
        name="t", time_s=t, current_A=1.0 + random.random(t.size),
        voltage_V=np.full(t.size, 4.0), between=Between.LINEAR,
    )  # fmt: skip
    few = sampled(test, 7920.0)
    assert few.load.time_s == pytest.approx(t)
    assert few.load.charge_C() == pytest.approx(test.drawn_C()[-1])


def test_a_test_that_starts_under_load_tells_its_start_no_better_than_the_loss() -> None:
    """3 A of a 3 Ah cell with 60 mOhm: it rests within two deviations of what is told."""
    t = np.arange(0.0, 1000.0)
    test = ReferenceTest(
        name="t", time_s=t, current_A=np.full(1000, 3.0), voltage_V=4.02 - 2e-4 * t
    )
    few = sampled(test, 3.0 * 3600)
    assert abs(few.start_V - (4.02 + 3 * 0.06)) < 2 * few.start_sigma_V
    assert few.start_sigma_V > 0.05


@pytest.mark.parametrize("between", Between)
def test_it_starts_where_it_rests_not_where_a_current_flows(between: Between) -> None:
    """Two samples of rest, then a load that takes 0.2 V at once."""
    current_A = np.append(np.zeros(2), np.full(200, 4.0)) * (1.0 + 0.1 * np.sin(np.arange(202.0)))
    test = ReferenceTest(
        name="t", time_s=30.0 * np.arange(202.0), current_A=current_A,
        voltage_V=4.0 - 0.05 * current_A, between=between,
    )  # fmt: skip
    assert sampled(test, 3 * 3600.0).start_V == pytest.approx(4.0, abs=1e-6)


def diving(between: Between = Between.HOLD) -> ReferenceTest:
    """10 min of rest, 1C: it bends at once, falls by half a volt a charge, at the end by 50."""
    t = np.arange(0.0, 4200.0)
    drawn = np.maximum(t - 600.0, 0.0) / 3600.0
    bent_V = 0.1 * (1.0 - np.exp(-30.0 * np.sqrt(drawn)))
    return ReferenceTest(
        name="t", time_s=t, current_A=np.where(t < 600.0, 0.0, 1.0), between=between,
        voltage_V=4.0 - bent_V - 0.5 * drawn - 50.0 * np.maximum(drawn - 0.98, 0.0),
    )  # fmt: skip


def test_what_a_model_may_miss_of_the_charge_counts_where_the_voltage_dives() -> None:
    few = sampled(diving(), 3600.0)
    dives = few.drawn_C > 0.985 * 3600.0
    assert few.shape[few.drawn_C < 0.97 * 3600.0].max() < 1.001
    assert few.shape[dives] == pytest.approx(STEEP * 50.0, rel=0.05)
    loose = few.of_a_model(5e-3, few.at.size)
    assert loose.sigma_V[dives] == pytest.approx(5e-3 * STEEP * 50.0, rel=0.05)
    assert few.sigma_V[dives].max() < 2e-3  # of the cell itself nothing is missed


def test_no_dive_is_seen_where_the_current_runs() -> None:
    assert np.all(sampled(diving(Between.LINEAR), 3600.0).shape == 1.0)
