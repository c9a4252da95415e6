"""Which effects stand out: fits of one to three hypotheses, and what evidence makes of them.

A larger combination is looked at only where the smaller ones leave something unsaid, and only the
additions that the linearised twin says could say it. Every model looked at has a probability: its
evidence times what was believed before. Residuals of the best that are more than noise (its excess)
make all evidence worth less by that factor: none of the models is then quite true.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.mismatch.fit import Data, Fitted, fit
from twin.mismatch.hypothesis import Hypothesis

FloatArray = npt.NDArray[np.float64]

PRIOR = 0.02
"""Of an effect, before anything is seen; of the controls, that nothing is left out, 1 / (1 + 20 x)
of it remains when twenty of them are looked for."""
MOST_EFFECTS = 3
TRIED = 12
"""Larger combinations of each size that are fitted: those that the linearised twin, about each of
the smaller ones, says leave least."""
SAID = 2.0
"""Excess below which nothing is left to say: of 100 residuals of pure noise one exceeds it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """Hypotheses at their best, and the probability that they and no others are what is left out.

    Attributes:
        fitted: the fit.
        log_evidence: of the recordings, and of so many effects before.
        probability: among all models that were looked at.
    """

    fitted: Fitted
    log_evidence: float
    probability: float

    @property
    def ids(self) -> tuple[str, ...]:
        """Of its hypotheses."""
        return self.fitted.ids


def models(
    data: Data,
    hypotheses: Sequence[Hypothesis],
    *,
    progress: Callable[[tuple[str, ...]], None] = lambda _: None,
) -> tuple[Model, ...]:
    """All that were looked at, the most probable first."""
    done: dict[tuple[str, ...], Fitted] = {}

    def fitted(chosen: Sequence[Hypothesis], base: Fitted | None = None) -> None:
        ids = tuple(sorted(h.id for h in chosen))
        if ids not in done:
            progress(ids)
            ordered = sorted(chosen, key=lambda h: h.id)
            known = base.problem.values(base.q) if base else {}
            done[ids] = fit(data, ordered, known)

    fitted(())
    for h in hypotheses:
        fitted([h])
    shapes = {h.id: _shapes(h, done[()], data) for h in hypotheses}
    for size in range(1, MOST_EFFECTS):
        if min(f.excess for f in done.values()) < SAID:
            break
        for base, h in _larger(size, hypotheses, done, shapes):
            fitted([*base.problem.hypotheses, h], base)
        best = _judged(done.values())[0].fitted  # is one of its effects not needed?
        for k in range(len(best.ids)):
            rest = best.problem.hypotheses
            fitted([*rest[:k], *rest[k + 1 :]], best)
    return _judged(done.values())


def scale_of(fits: Iterable[Fitted]) -> float:
    """How much larger variances are than expected, by what leaves least."""
    return max(1.0, min(f.excess for f in fits))


def _judged(fits: Iterable[Fitted]) -> tuple[Model, ...]:
    whole = list(fits)
    scale = scale_of(whole)
    logs = np.array([f.log_evidence(scale) + len(f.ids) * np.log(PRIOR) for f in whole])
    share = np.exp(logs - logs.max())
    share /= share.sum()
    out = [
        Model(fitted=f, log_evidence=log, probability=p)
        for f, log, p in zip(whole, logs.tolist(), share.tolist(), strict=True)
    ]
    return tuple(sorted(out, key=lambda m: -m.log_evidence))


def _larger(
    size: int, hypotheses: Sequence[Hypothesis], done: Mapping[tuple[str, ...], Fitted],
    shapes: Mapping[str, FloatArray],
) -> list[tuple[Fitted, Hypothesis]]:  # fmt: skip
    """Models of `size` effects, each with one to add, that promise to leave least."""
    promised: dict[tuple[str, ...], tuple[float, Fitted, Hypothesis]] = {}
    for base in [f for f in done.values() if len(f.ids) == size]:
        r, own = base.there.residuals, base.there.slopes
        for h in hypotheses:
            ids = tuple(sorted({*base.ids, h.id}))
            left = float(r @ r) - _explained(r, own, shapes[h.id])
            if len(ids) > size and (ids not in promised or left < promised[ids][0]):
                promised[ids] = (left, base, h)
    return [(base, h) for _, base, h in sorted(promised.values(), key=lambda p: p[0])[:TRIED]]


def _shapes(h: Hypothesis, null: Fitted, data: Data) -> FloatArray:
    """(m, columns) what an effect does to the whitened residuals of the fitted recordings.

    Where a fit starts: the whole change since it was absent, and the slopes by its numbers.
    """
    problem = data.problems([h])[0]
    columns = []
    for start in problem.starts():
        there = problem.evidence(start)
        before = null.problem.evidence(np.zeros(null.problem.size)).residuals
        columns += [(there.residuals - before)[:, None], there.slopes[:, : len(h.fitted)]]
    return np.hstack(columns)


def _explained(residuals: FloatArray, own: FloatArray, more: FloatArray) -> float:
    """Squares that columns `more` take from `residuals`, with priors, beyond columns `own`."""

    def left(columns: FloatArray) -> float:
        toward = columns.T @ residuals
        information = np.eye(columns.shape[1]) + columns.T @ columns
        return float(toward @ np.linalg.solve(information, toward))

    return left(np.hstack([own, more])) - left(own)
