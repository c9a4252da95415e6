"""Which test of a base is predicted by the others, to state its error."""

import numpy as np
import pytest

from proof.recorded.base import Body, Given, nearest
from proof.recorded.measured import RealTest
from twin.builtin import load_cell
from twin.pack import Pack

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


def chosen(rates: tuple[float, ...], asked: float, unseen: tuple[float, ...] = ()) -> list[str]:
    tests = tuple(discharge(rate) for rate in rates)
    given = Given(
        start=Pack(cell=load_cell("lg_m50")),
        tests=tests,
        unseen=tuple(discharge(rate) for rate in unseen),
        body=Body(heat_capacity_J_K=40.0, cooling_area_m2=0.005),
        asked_A=asked,
    )
    return [tests[k].name for k in nearest(given, [t.reference(ambient_K=298.0) for t in tests])]


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


def test_short_tests_say_nothing_of_it() -> None:
    slow, pulse = discharge(0.1), discharge(4.0, share=0.1)
    given = Given(
        start=Pack(cell=load_cell("lg_m50")),
        tests=(slow, discharge(1.0), pulse),
        body=Body(heat_capacity_J_K=40.0, cooling_area_m2=0.005),
        asked_A=5.0,
    )
    assert nearest(given, [t.reference(ambient_K=298.0) for t in given.tests]) == (1,)


def test_a_faster_test_that_is_not_fitted_at_all_tells_more() -> None:
    assert chosen((0.1, 0.5), 4.0, unseen=(1.0,)) == []
    assert chosen((0.1, 1.0), 4.0, unseen=(1.0,)) == ["1C"]
