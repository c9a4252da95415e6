"""Which tests a base is calibrated to, and which is predicted by the others to state its error."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from proof.recorded.base import (
    Base,
    Body,
    Given,
    _key,
    _missed_V,
    apart,
    base_of,
    nearest,
    without_faster,
)
from proof.recorded.cooling import cooled, of_mounts
from proof.recorded.measured import RealTest
from twin.builtin import load_cell
from twin.calibrate.answer import answer
from twin.calibrate.parameters import MOUNT_STD, TEST_STD, WARMING
from twin.calibrate.run import fit, problem_of
from twin.effects import SelfHeating
from twin.load import Load
from twin.mismatch.tested import Tested
from twin.pack import Pack
from twin.simulate import simulate

CAPACITY_C = 3600.0


def discharge(rate: float, share: float = 0.9) -> RealTest:
    """At so many times 1 A, of a share of the charge."""
    time_s = np.linspace(0.0, share * CAPACITY_C / rate, 50)
    return RealTest(
        name=f"{rate:g}C",
        time_s=time_s,
        current_A=np.full(50, rate),
        voltage_V=np.linspace(4.1, 3.4, 50),
    )


def given(tests: Iterable[RealTest], asked: float, unseen: Iterable[RealTest] = ()) -> Given:
    return Given(
        start=Pack(cell=load_cell("lg_m50")),
        tests=tuple(tests),
        unseen=tuple(unseen),
        body=Body(heat_capacity_J_K=40.0, cooling_area_m2=0.005),
        asked_A=asked,
    )


def chosen(rates: Iterable[float], asked: float, unseen: Iterable[float] = ()) -> list[str]:
    g = given(map(discharge, rates), asked, map(discharge, unseen))
    near = nearest(g, [t.reference(ambient_K=298.0) for t in g.tests])
    return [g.tests[k].name for k in near]


@pytest.mark.parametrize(
    ("rates", "asked", "names"),
    [
        ((0.1, 1.0, 2.0), 5.0, ["2C"]),  # beyond all: the fastest, from slower ones
        ((0.1, 1.0, 0.95, 9.0), 3.0, ["1C", "0.95C"]),  # between them: those below
        ((0.1, 1.0, 2.0), 2.1, ["2C"]),
        ((0.1, 1.0), 0.0, []),  # of another cell
        ((1.0,), 2.0, []),  # nothing is left to fit to
    ],
)
def test_the_error_is_that_of_the_tests_nearest_to_the_trial_and_not_faster(
    rates: tuple[float, ...], asked: float, names: list[str]
) -> None:
    assert chosen(rates, asked) == names


@pytest.mark.parametrize(
    ("rates", "asked", "groups"),
    [
        ((0.1, 1.0, 2.0, 2.1), 2.0, [["2C"], ["2.1C"]]),  # the other one stays in the base
        ((0.1, 1.0, 2.0, 2.1), 2.4, [["2C"], ["2.1C"]]),
        ((0.1, 1.0, 2.0, 2.1), 4.0, [["2C", "2.1C"]]),  # nothing there is as fast as the trial
    ],
)
def test_what_a_base_keeps_predicts_the_others_too(
    rates: tuple[float, ...], asked: float, groups: list[list[str]]
) -> None:
    g = given(map(discharge, rates), asked)
    tests = [t.reference(ambient_K=298.0) for t in g.tests]
    found = apart(g, tests, nearest(g, tests))
    assert [[g.tests[k].name for k in group] for group in found] == groups


def test_short_tests_say_nothing_of_it() -> None:
    slow, pulse = discharge(0.1), discharge(4.0, share=0.1)
    g = given((slow, discharge(1.0), pulse), 5.0)
    assert nearest(g, [t.reference(ambient_K=298.0) for t in g.tests]) == (1,)


def test_a_faster_test_that_is_not_fitted_at_all_tells_more() -> None:
    assert chosen((0.1, 0.5), 4.0, unseen=(1.0,)) == []
    assert chosen((0.1, 1.0), 4.0, unseen=(1.0,)) == ["1C"]


@pytest.mark.parametrize(
    ("rates", "asked", "left"),
    [
        ((0.1, 1.0, 2.0, 3.0, 3.1), 1.0, [["0.1C", "1C", "2C"], ["0.1C", "1C"]]),
        ((0.1, 1.0, 2.0), 1.9, []),  # nothing is faster than the trial
        ((0.1, 1.0, 9.0), 5.0, []),  # nothing else is as fast
        ((0.1, 1.0, 2.0), 0.0, []),  # of another cell
        ((0.9, 1.0, 2.0, 3.0), 0.2, [["0.9C", "1C", "2C"], ["0.9C", "1C"]]),
        ((1.0, 3.0), 1.0, []),  # one alone tells no losses
    ],
)
def test_what_is_faster_than_the_trial_may_be_left_out_if_something_is_as_fast(
    rates: tuple[float, ...], asked: float, left: list[list[str]]
) -> None:
    g = given(map(discharge, rates), asked)
    assert [[t.name for t in s.tests] for s in without_faster(g)] == left


def test_a_calibration_is_kept_under_all_that_it_is_made_of() -> None:
    """The same tests in other groups, or a start of another charge, make another one."""
    slow, fast = discharge(0.1), discharge(1.0)
    both = given((slow, fast), 2.0)
    ways = [
        both,
        replace(both, tests=(slow,), driven=(fast,)),
        replace(both, tests=(slow,), unseen=(fast,)),
        replace(both, start=replace(both.start, initial_soc=0.9)),
        replace(both, start=replace(both.start, initial_K=290.0)),
        replace(both, asked_A=3.0),
    ]
    assert len({_key(g) for g in ways}) == len(ways)
    assert _key(given((discharge(0.1), discharge(1.0)), 2.0)) == _key(both)


def test_a_fast_pulse_is_not_left_out() -> None:
    pulse, tests = discharge(4.0, share=0.1), (discharge(0.1), discharge(1.0))
    assert list(without_faster(given((*tests, pulse), 1.0))) == []
    (left,) = without_faster(given((*tests, pulse, discharge(2.0)), 1.0))
    assert [t.name for t in left.tests] == ["0.1C", "1C", "4C"]


def test_the_base_is_what_states_the_least_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def kept(g: Given, cache: Path) -> Base:  # noqa: ARG001
        return Base(
            pack=g.start, series_resistance_ohm=0.0, cooling={}, warming_K=0.0, full_soc=1.0,
            fitted_V={},
            errors_V={"own": least if len(g.tests) == 2 else 0.02, "other": 0.01},
        )  # fmt: skip

    def tested(g: Given, base: Base, cache: Path) -> Tested:  # noqa: ARG001
        return {"reaction_kinetics": {"negative_factor": float(len(g.tests))}}

    monkeypatch.setattr("proof.recorded.base._kept", kept)
    monkeypatch.setattr("proof.recorded.base._tested", tested)
    g = given(map(discharge, (0.1, 1.0, 2.0)), 1.0)
    for least in (0.015, 0.03):
        base = base_of(g, Path())
        assert base.error_V == min(least, 0.02)
        (told,) = base.pack.standard_errors["reaction_kinetics"].values()
        assert told == (2.0 if least < 0.02 else 3.0)  # of the same one
        assert base.pack.heat_transfer_W_m2_K is None  # no test measured a temperature


@pytest.mark.parametrize(("unseen_V", "states_V"), [(0.012, 0.022), (0.03, 0.03)])
def test_a_base_states_no_less_than_what_it_misses_of_a_test_it_was_fitted_to(
    unseen_V: float, states_V: float
) -> None:
    base = Base(
        pack=Pack(cell=load_cell("lg_m50")), series_resistance_ohm=0.0, cooling={}, warming_K=0.0,
        full_soc=1.0, fitted_V={"slow": 0.022, "fast": 0.004}, errors_V={"another": unseen_V},
    )  # fmt: skip
    assert base.error_V == states_V


def warmed(transfer: float, current_A: float, name: str = "") -> RealTest:
    """A discharge of an LG M50 cooled by so many W/(m2 K), for 12000 C, by its own losses."""
    time_s = np.linspace(0.0, 12000.0 / current_A, 100)
    load = Load(time_s=time_s, current_A=np.full(100, current_A), ambient_K=298.15)
    heating = SelfHeating(heat_transfer_W_m2_K=transfer)
    pack = Pack(cell=load_cell("lg_m50"), effects=(heating,))
    done = simulate(pack, load)
    return RealTest(
        name=name, time_s=time_s, current_A=load.current_A, voltage_V=done.voltage_V,
        temperature_K=done.temperature_K,
    )  # fmt: skip


def test_the_cooling_is_that_of_the_fastest_test_that_the_pack_follows_to_its_end() -> None:
    """At 4C it is empty long before, and what is told of its warmth false."""
    start = Pack(cell=load_cell("lg_m50"), effects=(SelfHeating(heat_transfer_W_m2_K=20.0),))
    time_s = np.linspace(0.0, 3000.0, 300)
    load = Load(time_s=time_s, current_A=np.full(300, 5.0), ambient_K=298.15)
    warm = RealTest(
        name="1C", time_s=time_s, current_A=load.current_A, voltage_V=np.full(300, 3.7),
        temperature_K=simulate(start, load).temperature_K,
    )  # fmt: skip
    cold = RealTest(
        name="4C", time_s=time_s / 4, current_A=4 * load.current_A, voltage_V=np.full(300, 3.7),
        temperature_K=np.full(300, 298.15),
    )  # fmt: skip
    (heating,) = cooled(Pack(cell=start.cell), (cold, warm)).effects
    assert isinstance(heating, SelfHeating)
    assert heating.heat_transfer_W_m2_K == pytest.approx(20.0, rel=0.05)


@pytest.mark.long
def test_the_cooling_of_a_mount_is_that_of_the_tests_in_it() -> None:
    """Cooled by 18 and 22 W/(m2 K); of a third mount it is told what these have in common."""
    pack = replace(
        Pack(cell=load_cell("lg_m50")), effects=(SelfHeating(heat_transfer_W_m2_K=20.0),)
    )
    tests = [
        replace(warmed(transfer, 5.0, f"{transfer:g}"), mount=mount).reference(ambient_K=298.15)
        for transfer, mount in ((18.0, "one"), (22.0, "other"))
    ]
    problem = problem_of(pack, tests, only=WARMING)
    *_, best = fit(problem)
    found = of_mounts(best.problem, best.q, answer(best.problem, best.q))
    assert list(found) == ["one", "other", ""]
    assert found["one"][0] == pytest.approx(18.0, rel=0.02)
    assert found["other"][0] == pytest.approx(22.0, rel=0.02)
    value, std = found[""]
    assert 19.0 < value < 21.0
    assert std > MOUNT_STD * value > 2.0 * max(found["one"][1], found["other"][1])
    assert min(std for _, std in found.values()) > TEST_STD * 18.0
    alike = problem_of(pack, [replace(t, mount="one") for t in tests], only=WARMING)
    *_, best = fit(alike)
    found = of_mounts(best.problem, best.q, answer(best.problem, best.q))
    assert list(found) == ["one", ""]
    assert found["one"][0] == found[""][0]
    assert 19.0 < found["one"][0] < 21.0
    cold = problem_of(pack, [replace(t, temperature_K=None) for t in tests])
    q = np.zeros(len(cold.free))
    assert of_mounts(cold, q, answer(cold, q)) == {}


@pytest.mark.long
def test_a_base_states_the_cooling_of_the_mount_of_its_trial(tmp_path: Path) -> None:
    slow, fast = warmed(18.0, 2.5, "0.5C"), warmed(40.0, 5.0, "1C")
    cell = load_cell("lg_m50")
    body = Body(heat_capacity_J_K=cell.heat_capacity_J_K, cooling_area_m2=cell.cooling_area_m2)
    tests = (replace(slow, mount="still"), replace(fast, mount="windy"))
    told = replace(given(tests, 2.5), only=(), body=body)
    cooling = {
        mount: base_of(replace(told, mount=mount), tmp_path).pack
        for mount in ("still", "windy", "elsewhere")
    }
    transfers = {mount: pack.heat_transfer_W_m2_K for mount, pack in cooling.items()}
    assert transfers["still"] == pytest.approx(18.0, rel=0.1)
    assert transfers["windy"] == pytest.approx(40.0, rel=0.1)
    assert 20.0 < transfers["elsewhere"] < 38.0
    assert len(list(tmp_path.iterdir())) == 1  # a calibration does not depend on it


def test_what_was_not_fitted_is_cooled_as_in_its_mount() -> None:
    """By cooling of the other mount these tests are missed; in a mount of their own, not at all."""
    pack = Pack(cell=load_cell("lg_m50"))
    cooling = {"still": (5.0, 1.0), "fan": (80.0, 10.0), "": (20.0, 5.0)}
    flow = discharge(5.0, share=4.0)  # of 5 Ah

    def in_its(mount: str) -> RealTest:
        own = SelfHeating(heat_transfer_W_m2_K=cooling[mount][0])
        load = Load(time_s=flow.time_s, current_A=flow.current_A, ambient_K=298.15)
        got = simulate(replace(pack, effects=(own,)), load).require()
        return replace(flow, voltage_V=got.voltage_V, mount=mount)

    tests = [in_its(mount) for mount in ("still", "fan")]
    assert _missed_V(pack, cooling, 1.0, tests) < 1e-6
    other = [replace(t, mount="fan") for t in tests]
    assert _missed_V(pack, cooling, 1.0, other) > 5e-3
    assert _missed_V(pack, {}, 1.0, tests) > 5e-3
