"""Which hypotheses are worth a fit, by what the linearised twin says of each."""

from collections.abc import Sequence

import numpy as np

from twin.mismatch.fit import Data
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.problem import Evidence, FloatArray


def promising(
    data: Data, hypotheses: Sequence[Hypothesis], most: int
) -> tuple[Hypothesis, ...]:  # fmt: skip
    """The `most` that take away most of the squares of the fitted recordings, in their order."""
    null = data.problems(())[0]
    before = null.evidence(np.zeros(null.size))
    gains = {h.id: _gain(h, data, before) for h in hypotheses}
    best = sorted(gains, key=lambda name: (-gains[name], name))[:most]
    return tuple(h for h in hypotheses if h.id in best)


def _gain(h: Hypothesis, data: Data, before: Evidence) -> float:
    """Squares that one effect takes from the residuals, from where a fit starts; starts aside."""
    problem = data.problems([h])[0]
    there = problem.evidence(problem.starts()[0])
    whole = (there.residuals - before.residuals)[:, None]
    columns = np.hstack([whole, there.slopes[:, : len(h.fitted)]])
    own = before.slopes
    return _explained(before.residuals, np.hstack([own, columns])) - _explained(
        before.residuals, own
    )


def _explained(residuals: FloatArray, columns: FloatArray) -> float:
    toward = columns.T @ residuals
    information = np.eye(columns.shape[1]) + columns.T @ columns
    return float(toward @ np.linalg.solve(information, toward))
