"""Points at which a twin is compared: several at once, possible or not."""

import numpy as np

from tests.twin.mismatch.recordings import flown
from twin.mismatch import HYPOTHESES
from twin.mismatch.problem import Problem
from twin.mismatch.split import split


def test_a_point_that_no_cell_has_costs_much_and_leaves_the_others_alone() -> None:
    """So much material lost that the cell is never empty: known only when it is simulated."""
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
