"""Which effects stand out: fits of one to three hypotheses, and what evidence makes of them.

A larger combination is looked at only where the smaller ones leave something unsaid, and only the
additions that the linearised twin says could say it. Every model looked at has a probability: its
evidence times what was believed before. Residuals of the best that are more than noise (its excess)
make all evidence worth less by that factor: none of the models is then quite true.
"""

from collections.abc import Callable, Iterable, Sequence
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
BEAM = 3  # models of one size from which the next larger ones grow
PLAUSIBLE = 6  # additions that are fitted in full, the best by the linearised twin
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
    for size in range(1, MOST_EFFECTS):
        if min(f.excess for f in done.values()) < SAID:
            break
        for base in _best(done.values(), size):
            for h in _additions(base, hypotheses, done):
                fitted([*base.problem.hypotheses, h], base)
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


def _best(fits: Iterable[Fitted], size: int) -> list[Fitted]:
    """The BEAM best models of one size."""
    whole = [f for f in fits if len(f.ids) == size]
    scale = scale_of(whole)
    return sorted(whole, key=lambda f: -f.log_evidence(scale))[:BEAM]


def _additions(
    base: Fitted, hypotheses: Sequence[Hypothesis], done: dict[tuple[str, ...], Fitted]
) -> list[Hypothesis]:
    """Hypotheses that could say most of what `base` leaves, by their slopes when alone."""
    r, own = base.there.residuals, base.there.slopes
    gains = []
    for h in hypotheses:
        if h.id in base.ids:
            continue
        alone = done[(h.id,)].there.slopes[:, : len(h.fitted)]
        gains.append((_explained(r, own, alone), h))
    gains.sort(key=lambda pair: -pair[0])
    return [h for _, h in gains[:PLAUSIBLE]]


def _explained(residuals: FloatArray, own: FloatArray, more: FloatArray) -> float:
    """Squares that columns `more` take from `residuals`, with priors, beyond columns `own`."""

    def left(columns: FloatArray) -> float:
        toward = columns.T @ residuals
        information = np.eye(columns.shape[1]) + columns.T @ columns
        return float(toward @ np.linalg.solve(information, toward))

    return left(np.hstack([own, more])) - left(own)
