"""Tests of one cell in the cold and in the warm: where each starts, and what they tell."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.calibrate.synthetic import NOISE_V, RELAX, Stage, cell_pack, load_of
from twin.calibrate.answer import Verdict
from twin.calibrate.objective import SPAN_K
from twin.calibrate.out import calibrated_cell, pack_text
from twin.calibrate.parameters import ACTIVATIONS, MOUNT, OWN, TEST_STD, WARMING, cell_table
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import conclude, fit, problem_of
from twin.constants import ZERO_CELSIUS_K
from twin.effects import SelfHeating
from twin.load import Between, Load
from twin.pack import Pack
from twin.pack_file import effects_of, parse_pack_file
from twin.simulate import simulate

PACK = """[pack]
name = "mine"
cell = "lipo_2200"
series = 1
"""
ONE_C: tuple[Stage, ...] = ((0.0, 60.0, 10.0), (1.0, 1800.0, 2.0), *RELAX)


FAST: tuple[Stage, ...] = ((0.0, 60.0, 10.0), (10.0, 300.0, 0.5), *RELAX)


def of(
    pack: Pack,
    celsius: float,
    seed: int = 0,
    noise_V: float = 0.0,
    stages: tuple[Stage, ...] = ONE_C,
) -> ReferenceTest:
    """A discharge of a cell as warm as the room, then a rest."""
    kelvin = celsius + ZERO_CELSIUS_K
    time_s, current_A = load_of(stages, pack.cell.nominal_capacity_C / 3600)
    load = Load(time_s=time_s, current_A=current_A, between=Between.HOLD, ambient_K=kelvin)
    voltage_V = simulate(replace(pack, initial_K=kelvin), load).voltage_V
    noise = np.random.default_rng(seed).standard_normal(voltage_V.size)
    return ReferenceTest(
        name=f"{celsius:g} degC", time_s=time_s[: voltage_V.size],
        current_A=current_A[: voltage_V.size], voltage_V=voltage_V + noise_V * noise,
        between=Between.HOLD, ambient_K=kelvin,
    )  # fmt: skip


def test_a_test_starts_as_warm_as_its_surroundings() -> None:
    pack = cell_pack()
    tests = [of(pack, celsius) for celsius in (0.0, 25.0)]
    problem = problem_of(pack, tests)
    for test in tests:
        start_V = float(test.voltage_V[0])
        got_V = problem.replayed(np.zeros(len(problem.free)), test, start_V)
        assert np.abs(got_V - test.voltage_V)[:900].max() < 2e-3  # of a finer mesh
    apart_V = tests[0].voltage_V - tests[1].voltage_V[: tests[0].voltage_V.size]
    assert np.abs(apart_V).max() > 0.05


def test_activation_energies_are_free_where_tests_were_warm_and_cold() -> None:
    pack, heated = cell_pack(), replace(cell_pack(), effects=(SelfHeating(),))
    one = of(pack, 25.0)
    near = replace(one, name="near", ambient_K=one.ambient_K + 0.9 * SPAN_K)
    cold = replace(one, name="cold", ambient_K=one.ambient_K - 1.1 * SPAN_K)
    rise_K = 1.1 * SPAN_K * np.linspace(0.0, 1.0, one.time_s.size)
    warmed = replace(one, name="warmed", temperature_K=one.ambient_K + rise_K)
    for given, tests, free in (
        (pack, [one, near], False),
        (pack, [one, cold], True),
        (heated, [one, warmed], False),  # with its charge falls what it loses, as with its warmth
        (heated, [warmed, cold], True),
    ):
        names = {p.name for p in problem_of(given, tests).parameters}
        assert names.issuperset(ACTIVATIONS) == free, (given.effects, tests[1].name)


def test_activation_energies_are_found() -> None:
    pack = cell_pack()
    own = pack.cell
    truth = replace(
        own,
        negative=replace(own.negative, rate_activation_J_mol=40e3),
        positive=replace(own.positive, rate_activation_J_mol=58e3),
        electrolyte=replace(own.electrolyte, conductivity_activation_J_mol=20e3),
    )
    made = replace(pack, cell=truth)
    tests = [of(made, c, seed, NOISE_V) for seed, c in enumerate((5.0, 25.0, 45.0))]
    problem = problem_of(pack, tests, only=ACTIVATIONS)
    *_, last = fit(problem)
    found = conclude(last.problem, last.q, tests, cross_validate=False)
    for test in found.fitted:
        assert test.rms_V == pytest.approx(NOISE_V, rel=0.15)
    cell = replace(pack, cell=calibrated_cell(found))
    unseen = of(made, 12.0)
    got_V = simulate(
        replace(cell, initial_K=unseen.ambient_K),
        Load(time_s=unseen.time_s, current_A=unseen.current_A, ambient_K=unseen.ambient_K),
    ).voltage_V
    assert np.sqrt(np.mean((got_V - unseen.voltage_V[: got_V.size]) ** 2)) < NOISE_V
    estimates = {e.name: e for e in found.answer.estimates}
    for name, value in (
        ("negative.rate_activation_J_mol", 40e3), ("positive.rate_activation_J_mol", 58e3),
        ("electrolyte.conductivity_activation_J_mol", 20e3),
    ):  # fmt: skip
        assert abs(estimates[name].value - value) < 3 * estimates[name].std, name


def test_a_temperature_that_was_not_measured_tells_nothing() -> None:
    """Of a thermometer that failed: its last value was taken for all that followed."""
    pack = replace(cell_pack(), effects=(SelfHeating(heat_transfer_W_m2_K=12.0),))
    test = of(pack, 25.0, 1, NOISE_V, FAST)
    warm_K = test.ambient_K + np.linspace(0.0, 5.0, test.time_s.size)
    failed_K = np.where(test.time_s < 200.0, warm_K, np.nan)
    q, both = np.zeros(len(WARMING) + 1), []
    for own_K in (warm_K, failed_K):
        problem = problem_of(pack, [replace(test, temperature_K=own_K)], only=WARMING)
        residuals, slopes = problem.linearised(q)
        assert problem.residuals(q) == pytest.approx(residuals, abs=1e-9)
        (sample,) = problem.tests
        both.append((residuals[-sample.at.size :], slopes[-sample.at.size :]))
    known = sample.load.time_s[sample.at] < 200.0
    for whole, part in zip(*both, strict=True):
        assert part[known] == pytest.approx(whole[known])
        assert not part[~known].any()
        assert whole[~known].any()


def test_how_a_cell_warms_is_found_and_told() -> None:
    """By its temperature; the voltage alone leaves heat capacity and cooling nearly as unknown."""
    pack = replace(cell_pack(), effects=(SelfHeating(heat_transfer_W_m2_K=12.0),))
    own = pack.cell
    heating = SelfHeating(heat_transfer_W_m2_K=25.0)
    warm = replace(own, heat_capacity_J_K=1.2 * own.heat_capacity_J_K)
    truth = replace(pack, cell=warm, effects=(heating,))
    test = of(truth, 25.0, 1, NOISE_V, FAST)
    load = Load(time_s=test.time_s, current_A=test.current_A, between=Between.HOLD)
    measured_K = simulate(truth, load).temperature_K
    assert np.ptp(measured_K) > 2.0
    test = replace(test, temperature_K=measured_K)
    problem = problem_of(pack, [test], only=WARMING)
    *_, last = fit(problem)
    found = conclude(last.problem, last.q, [test], cross_validate=False)
    assert found.numbers["heat_capacity_J_K"] == pytest.approx(
        1.2 * own.heat_capacity_J_K, rel=0.05
    )
    assert found.numbers["heat_transfer_W_m2_K"] == pytest.approx(25.0, rel=0.05)
    told = {e.name: e for e in found.answer.estimates}
    assert all(told[name].verdict is Verdict.IDENTIFIED for name in WARMING)
    assert calibrated_cell(found).heat_capacity_J_K == found.numbers["heat_capacity_J_K"]
    written = pack_text(found, pack, parse_pack_file(PACK, name="pack.toml"), cell="cell.bpx.json")
    transfer = found.numbers["heat_transfer_W_m2_K"]
    file = parse_pack_file(written, name="calibrated pack.toml")
    assert SelfHeating(heat_transfer_W_m2_K=transfer) in effects_of(file)
    assert file.environment.heat_transfer_std_W_m2_K == pytest.approx(
        told["heat_transfer_W_m2_K"].std
    )


def test_derivatives_of_temperatures_are_those_of_the_residuals() -> None:
    pack = replace(cell_pack(), effects=(SelfHeating(),))
    test = of(pack, 25.0, stages=FAST)
    test = replace(test, temperature_K=np.full(test.time_s.size, 299.0))
    problem = problem_of(pack, [test])
    q = np.zeros(len(problem.free))
    residuals, slopes = problem.linearised(q)
    assert residuals == pytest.approx(problem.residuals(q))
    along = np.random.default_rng(2).standard_normal(q.size)
    step = 1e-4
    change = problem.residuals(q + step * along) - problem.residuals(q - step * along)
    warm = slice(-problem.tests[0].at.size, None)
    got, expected = (slopes @ along)[warm], (change / (2 * step))[warm]
    assert np.abs(expected).max() > 0.1
    assert np.abs(got - expected).max() < 1e-3 * np.abs(expected).max()


def test_no_cooling_is_looked_for_that_a_pack_file_does_not_take() -> None:
    pack = replace(cell_pack(), effects=(SelfHeating(heat_transfer_W_m2_K=200.0),))
    table = {p.name: p for p in cell_table(pack, warming=True)}
    assert table[WARMING[1]].upper == 1000.0
    least, _ = table[WARMING[1]].bounds
    assert table[WARMING[1]].value(least) == pytest.approx(200.0 / 30)


def warming_in(celsius: float, transfer: float, noise_K: float = 0.05) -> ReferenceTest:
    """A fast discharge of a cell in a mount that cools so, its temperature measured."""
    heating = SelfHeating(heat_transfer_W_m2_K=transfer)
    truth = replace(cell_pack(), effects=(heating,), initial_K=celsius + ZERO_CELSIUS_K)
    test = of(truth, celsius, int(transfer), NOISE_V, FAST)
    load = Load(
        time_s=test.time_s, current_A=test.current_A, between=Between.HOLD,
        ambient_K=test.ambient_K,
    )  # fmt: skip
    noise = np.random.default_rng(int(celsius)).standard_normal(test.time_s.size)
    measured_K = simulate(truth, load).temperature_K + noise_K * noise
    return replace(test, name=f"mount {transfer:g}", temperature_K=measured_K)


def test_each_test_cools_as_its_mount_does() -> None:
    """Two mounts, a third of the cooling apart: one number would make both wrong by kelvins."""
    pack = replace(cell_pack(), effects=(SelfHeating(heat_transfer_W_m2_K=25.0),))
    tests = [warming_in(25.0, 20.0), warming_in(24.0, 30.0)]
    problem = problem_of(pack, tests, only=WARMING)
    *_, last = fit(problem)
    own = [last.problem.mapped(last.q, k).numbers[WARMING[1]] for k in range(2)]
    assert own == pytest.approx([20.0, 30.0], rel=0.03)
    found = conclude(last.problem, last.q, tests, cross_validate=False)
    assert 20.0 < found.numbers[WARMING[1]] < 30.0  # what the cell has on the whole
    one = problem_of(pack, tests[:1])
    assert not any(p.name.startswith(f"{MOUNT}:") for p in one.parameters)


def test_tests_in_one_mount_share_how_it_cools() -> None:
    """But for a little of each; a test without a temperature cools as those beside it."""
    pack = replace(cell_pack(), effects=(SelfHeating(heat_transfer_W_m2_K=25.0),))
    told = [(25.0, 20.0, "still"), (24.0, 30.0, "windy"), (23.0, 30.0, "windy")]
    tests = [replace(warming_in(c, w), name=f"{c:g}", mount=mount) for c, w, mount in told]
    blind = replace(tests[2], name="blind", temperature_K=None)
    problem = problem_of(pack, [*tests, blind], only=WARMING)
    names = [p.name for p in problem.parameters if p.name.startswith((f"{MOUNT}:", f"{OWN}:"))]
    mounts, own = names[:2], names[2:]
    assert mounts == [f"{MOUNT}:still", f"{MOUNT}:windy"]
    assert own == [f"{OWN}:24", f"{OWN}:23"]
    *_, last = fit(problem)
    cooling = [last.problem.mapped(last.q, k).numbers[WARMING[1]] for k in range(4)]
    assert cooling == pytest.approx([20.0, 30.0, 30.0, 30.0], rel=0.03)
    start_V = float(last.problem.values(last.q)[-1])
    beside = last.problem.replayed(last.q, blind, start_V)
    alone = last.problem.replayed(last.q, replace(blind, mount="elsewhere"), start_V)
    assert np.abs(beside - alone).max() > 1e-4
    one = problem_of(pack, [replace(t, mount="still") for t in tests])
    stds = {p.name: p.std for p in one.parameters if p.name.startswith((f"{MOUNT}:", f"{OWN}:"))}
    assert stds == {f"{OWN}:{t.name}": TEST_STD for t in tests}


def test_derivatives_by_a_mount_are_those_of_the_residuals() -> None:
    pack = replace(cell_pack(), effects=(SelfHeating(),))
    tests = [warming_in(25.0, 20.0), warming_in(24.0, 30.0), warming_in(23.0, 28.0)]
    tests = [replace(t, mount=m) for t, m in zip(tests, ("a", "b", "b"), strict=True)]
    problem = problem_of(pack, tests)
    q = np.full(len(problem.free), 0.1)
    _, slopes = problem.linearised(q)
    step = 1e-4
    for k, p in enumerate(problem.parameters):
        if p.name.startswith((f"{MOUNT}:", f"{OWN}:")) or p.name == WARMING[1]:
            ahead, behind = q.copy(), q.copy()
            ahead[k], behind[k] = q[k] + step, q[k] - step
            expected = (problem.residuals(ahead) - problem.residuals(behind)) / (2 * step)
            assert np.abs(slopes[:, k] - expected).max() < 1e-3 * np.abs(expected).max(), p.name
