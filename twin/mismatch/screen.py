"""The short form: one step of a fit for every hypothesis, a whole fit for the one ahead."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from twin.mismatch.choose import ALIKE
from twin.mismatch.decide import MOST_ALIKE, Decision
from twin.mismatch.finding import Verdict
from twin.mismatch.fit import Data
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.problem import Problem

BENT = 0.005
"""Of the evidence gained, by how much the linear twin may be wrong: what comes so near to the most
promising one was not told from it."""


def promised(data: Data, hypotheses: Sequence[Hypothesis]) -> Mapping[str, float]:
    """Id -> logarithm of the evidence one Gauss-Newton step gains, the largest first.

    Over that of the twin as configured, of the fitted recordings; the twin is taken as linear about
    where a fit starts.
    """
    null = data.problems(())[0]
    before = -null.cost(np.zeros(null.size))
    found = {h.id: _evidence(data.problems([h])[0]) - before for h in hypotheses}
    return dict(sorted(found.items(), key=lambda pair: (-pair[1], pair[0])))


def alike(gains: Mapping[str, float]) -> tuple[str, ...]:
    """The others that one step does not tell from the first of `promised`."""
    (_, best), *others = gains.items()
    return tuple(name for name, gain in others if best - gain < ALIKE + BENT * max(best, 0.0))


def widened(decision: Decision, like: tuple[str, ...]) -> Decision:
    """With those that were not told from the effect; if they are many, nothing is settled."""
    if not decision.effects or not like:
        return decision
    (effect,) = decision.effects
    few = len(like) <= MOST_ALIKE and decision.verdict is Verdict.NAMED
    return replace(
        decision,
        verdict=Verdict.NAMED if few else Verdict.AMBIGUOUS,
        effects=(replace(effect, equivalent=like),),
    )


def _evidence(problem: Problem) -> float:
    residuals, slopes = problem.linearised(problem.starts()[0])
    information = slopes.T @ slopes  # that of the prior is among its rows
    toward = slopes.T @ residuals
    left = float(residuals @ residuals) - float(toward @ np.linalg.solve(information, toward))
    return -0.5 * (left + float(np.linalg.slogdet(information)[1]))
