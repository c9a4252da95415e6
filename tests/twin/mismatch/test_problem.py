"""Points at which a twin is compared: several at once, possible or not."""

import numpy as np
import pytest

from tests.twin.mismatch.recordings import flown
from twin.cell import Cell
from twin.effects import ActiveMaterialLossPositive
from twin.effects.effect import Numbers
from twin.mismatch import HYPOTHESES
from twin.mismatch.problem import Problem
from twin.mismatch.split import split


def test_a_point_that_no_cell_has_costs_much_and_leaves_the_others_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Which is known only when it is simulated."""

    def changed(self: ActiveMaterialLossPositive, numbers: Numbers, _: Cell) -> Numbers:
        if self.lost > 0.3:
            raise ValueError
        return dict(numbers)

    monkeypatch.setattr(ActiveMaterialLossPositive, "changed", changed)
    flight = flown(seconds=20.0)
    lost = [h for h in HYPOTHESES if h.id == "active_material_loss_positive"]
    problem = Problem(split([flight], [flight]).fitted, lost)
    none_lost, too_much = np.zeros(2), np.array([problem.bounds[1][0], 0.0])
    alone = problem.costs([none_lost])[0]
    before, impossible, after = problem.costs([none_lost, too_much, none_lost])
    assert before == after == alone
    assert np.isfinite(impossible)
    assert impossible > 1e3 * alone
    assert problem.cost(too_much) == impossible
    assert np.all(problem.evidence(too_much).slopes[:, 0] == 0.0)
