"""What the tests of a twin leave open of a flight: as much as the cells that they allow differ."""

from dataclasses import replace

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown
from twin.calibrate.doubt import Other
from twin.effects import (
    ActiveMaterialLossPositive,
    SelfHeating,
    SolidDiffusionPositive,
)
from twin.mismatch import HYPOTHESES, Verdict, explain
from twin.mismatch.allowed import CELLS, open_V

RESISTANCE, DIFFUSION = "series_resistance_ohm", "positive.diffusivity_factor"
OFF_OHM = 2e-3
SOME = [
    h
    for h in HYPOTHESES
    if h.id in ("series_resistance", "voltage_gain", "solid_diffusion_positive")
]


def drawn(name: str, deviation: float) -> tuple[Other, ...]:
    """Cells that differ in one number."""
    sizes = np.random.default_rng(0).normal(0.0, deviation, CELLS)
    return tuple(Other(moved=((name, float(size)),)) for size in sizes)


def test_a_number_that_is_open_leaves_as_much_as_it_may_be_off() -> None:
    """Of four cells in series, where it counts."""
    flight = replace(flown(seed=1), allowed=drawn(RESISTANCE, OFF_OHM))
    flight = replace(flight, judged=flight.time_s > 30.0)
    sizes_ohm = np.array([size for other in flight.allowed for _, size in other.moved])
    mean_A2 = np.mean(flight.load.current_A[flight.judged] ** 2)
    expected_V = 4.0 * np.sqrt(mean_A2 * np.mean(sizes_ohm**2))
    assert open_V([flight]) == pytest.approx(expected_V, rel=1e-3)
    assert open_V([flight, replace(flight, allowed=())]) == pytest.approx(
        expected_V / np.sqrt(2.0), rel=1e-3
    )
    assert open_V([]) == open_V([flown(seed=1)]) == 0.0


def test_a_cell_that_is_empty_before_is_none_that_flew_this() -> None:
    nearly, long_ago = (Other(moved=((DIFFUSION, x),)) for x in (-0.05, -0.9999))
    with_it, without, it = (
        open_V([replace(flown(seed=1), allowed=own)])
        for own in ((nearly, long_ago), (nearly,), (long_ago,))
    )
    assert with_it == without > 0.0
    assert it == 0.0


def test_a_cell_that_an_effect_takes_too_much_of_is_left_out() -> None:
    flight = flown(seed=1)
    less = Other(moved=(("negative.stoichiometry_max", 0.9),))
    lost = replace(flight.pack, effects=(ActiveMaterialLossPositive(lost=0.5),))
    with pytest.raises(ValueError, match="no cell with"):
        less.instead(lost)
    assert open_V([replace(flight, pack=lost, allowed=(less,))]) == 0.0


def test_another_cell_cools_as_its_tests_say() -> None:
    heated = replace(flown(seed=1).pack, effects=(SelfHeating(heat_transfer_W_m2_K=20.0),))
    other = Other(moved=(), cools=1.5).instead(heated)
    assert other.effects == (SelfHeating(heat_transfer_W_m2_K=30.0),)


def test_what_the_tests_leave_open_is_told_where_it_is_more_than_is_stated() -> None:
    """The verdict is that of the twin as it is."""
    truth = [SolidDiffusionPositive(diffusivity_factor=0.6)]
    flights = [replace(flown(truth, seed=k), allowed=drawn(DIFFUSION, 0.25)) for k in (1, 2, 3)]
    found = explain(flights, hypotheses=SOME)
    closed = explain([replace(f, allowed=()) for f in flights], hypotheses=SOME)
    assert found.verdict is closed.verdict is Verdict.NAMED
    (remark,) = set(found.remarks) - set(closed.remarks)
    fitted_V, ahead_V = (open_V(own) for own in (flights[:2], flights[2:]))
    assert f"{1e3 * fitted_V:.3g} mV rms in what was fitted" in remark
    assert f"{1e3 * ahead_V:.3g} mV in what was held out" in remark
    stated = explain(flights, hypotheses=SOME, slow_V=2.0 * max(fitted_V, ahead_V))
    assert not any("calibration's tests" in r for r in stated.remarks)
