"""Where least squares begin."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from tests.twin.calibrate.synthetic import cell_pack, measured
from twin.calibrate import run, starts
from twin.calibrate.cell_map import Infeasible
from twin.calibrate.objective import Problem
from twin.calibrate.polish import SMALL_GAIN
from twin.calibrate.run import fit, fit_from_everywhere, problem_of
from twin.calibrate.settle import MISSED_V, Settled, least_squares
from twin.calibrate.table import CalibrationError

FloatArray = npt.NDArray[np.float64]
ONLY = ("capacity_C", "series_resistance_ohm", "positive.diffusivity_m2_s")


def problem(off_V: float) -> Problem:
    """A fast discharge with a wave of no cell."""
    (fast,), _, _ = measured(cell_pack(), 1, ("2C",))
    wave_V = off_V * np.sin(fast.time_s / 200.0)
    return problem_of(cell_pack(), [replace(fast, voltage_V=fast.voltage_V + wave_V)], only=ONLY)


def test_points_are_drawn_about_the_windows_and_the_best_come_first() -> None:
    own = problem(0.0)
    names = [p.name for p in own.parameters]
    windows = np.linspace(0.1, 0.4, len(names))
    found = list(starts.drawn(own, windows))
    assert len(found) == starts.TRIED
    costs = [own.cost(q) for q in found]
    assert costs == sorted(costs)
    free = names.index("positive.diffusivity_m2_s")
    assert len({q[free] for q in found}) == starts.TRIED
    for q in found:
        assert np.array_equal(np.delete(q, free), np.delete(windows, free))


@pytest.mark.parametrize("off_V", [0.0, 0.05])
def test_they_are_tried_where_the_windows_lead_to_a_twin_that_misses_much(
    off_V: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def drawn(own: Problem, q: FloatArray) -> Iterator[FloatArray]:
        asked.append(own)
        yield q

    monkeypatch.setattr(starts, "drawn", drawn)
    list(fit(problem(off_V)))
    assert len(asked) == (off_V > 0.0)


def test_all_are_tried_for_the_likeliest_of_those_that_explain_the_tests(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own, asked = problem(0.0), []

    def drawn(_: Problem, q: FloatArray) -> Iterator[FloatArray]:
        for point in (q, q + 0.5):
            asked.append(point)
            yield point

    monkeypatch.setattr(starts, "drawn", drawn)
    steps = list(fit_from_everywhere(own))
    assert len(asked) == 2
    *_, first = fit(own)
    assert steps[-1].cost <= first.cost * (1 + 1e-6)


def test_the_valley_that_was_chosen_from_afar_is_gone_down_to_its_floor(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(run, "SIGHTED", 1.0)
    *_, last = fit(problem(0.01))
    *_, floor = least_squares(last.problem, last.q)
    assert last.cost - floor.cost < 3 * SMALL_GAIN * last.cost


def test_points_that_no_cell_has_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    own = problem(0.0)
    begin = starts.of_windows(own)

    def unless_there(problem: Problem, q: FloatArray, *, small_gain: float) -> Iterator[Settled]:
        if np.array_equal(q, begin):
            raise Infeasible("the positive window is empty", by=0.1)
        yield from least_squares(problem, q, small_gain=small_gain)

    monkeypatch.setattr(run, "least_squares", unless_there)
    *_, last = fit(own)
    assert last.rms_V < MISSED_V
    monkeypatch.setattr(starts, "drawn", lambda *_: iter(()))
    with pytest.raises(CalibrationError, match="no cell"):
        list(fit(own))
