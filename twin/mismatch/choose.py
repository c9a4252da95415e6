"""Which effects stand out: fits of one to three hypotheses, and what evidence makes of them.

The linearised twin says what each effect, beside those that a model has already, could take from
the residuals; what could not make a model more probable by that is not fitted. Every model that was
has a probability: its evidence times what was believed before. Residuals of the best that are more
than noise (its excess) make all evidence worth less by that factor: none is then quite true.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from twin.calibrate.polish import bounded
from twin.mismatch.bagged import bagged
from twin.mismatch.fit import Data, Fitted, Known, fit, refit
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.problem import Problem

FloatArray = npt.NDArray[np.float64]

MOST_EFFECTS = 3
TRIED = 6
"""Larger combinations of each size that are fitted: those that the linearised twin, about each of
the smaller ones, says leave least."""
BENT = 0.3
"""Of what a linearised twin says that a model takes away, how much more it may truly take away: the
twin bends under large effects. What cannot come near the best even so is not fitted. One effect
alone is, if it promises anything: of real cells cold took 2.4 times as much as promised, and
particles that are three times as slow, in a flight by another simulator, four times."""
AHEAD = 2.0
"""What is held out is missed by so many times more than what is fitted: that promises nothing then,
and each effect is fitted."""
NOISY = 1.2  # squares a residual, of noise that was estimated
UNSAID = 2.5  # excess of the best above which every effect is fitted, whatever it promised
SLACK = 10.0  # squares that may be left beyond those of the best
NEARLY_ALL = 0.03
"""Of the squares beyond the noise, held out: what leaves no more is named though something else is
left, as it is where the twin's cell is not quite the one that flew. Of a combination less, by the
number of its effects: together they can shape themselves to much."""
NEAR = 2.0
"""Deviations of the prior: starts so near bend one effect, and promise together what it may take. A
clock has them farther apart, of which no fit can be at two."""
ALIKE = 3.0
"""Logarithm of the odds within which two models are one: Kass, Raftery, J. Am. Stat. Assoc. 90, 773
(1995): below 20 to 1 is not strong."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model:
    """Hypotheses at their best, and the probability that they and no others are what is left out.

    Attributes:
        fitted: the fit.
        log_evidence: of the recordings, and of so many effects before; where an error of the twin
            is stated `bagged`.
        probability: among all models that were looked at.
    """

    fitted: Fitted
    log_evidence: float
    probability: float

    @property
    def ids(self) -> tuple[str, ...]:
        """Of its hypotheses."""
        return self.fitted.ids


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """What an effect does to the whitened residuals of the fitted recordings, about one start.

    Attributes:
        slopes: (m, k) by its numbers there.
        columns: (m, c) at all starts NEAR it, the whole change since the effect was absent, slopes.
        low: (c,) least amount of each that the effect's bounds allow.
        high: (c,) and largest.
    """

    slopes: FloatArray
    columns: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Promise:
    """A model with one effect more, as it would be if the twin were linear.

    Attributes:
        base: without it.
        more: the effect.
        left: squares.
        log_evidence: of the fitted recordings, if only noise is left: by what smaller models leave
            above it, all that are larger look alike.
    """

    base: Fitted
    more: Hypothesis
    left: float
    log_evidence: float


def models(
    data: Data,
    hypotheses: Sequence[Hypothesis],
    *,
    most_effects: int = MOST_EFFECTS,
    most_alone: int | None = None,
    progress: Callable[[tuple[str, ...]], None] = lambda _: None,
) -> tuple[Model, ...]:
    """All that were fitted, the most probable first; at most so many effects in one, and alone.

    Where tails are heavy, least squares are looked for first, which the linearised twin speaks of,
    and each model is fitted again from there.
    """
    squared = data.squared
    looked = _Looked(squared, hypotheses, progress)
    looked.alone(most_alone)
    for size in range(2, most_effects + 1):
        looked.together(size)
    looked.about_the_best(most_effects)
    if squared is data:
        return judged(looked.done.values())

    def again(there: Fitted) -> Fitted:
        progress(there.ids)
        return refit(data, there)

    return judged(map(again, looked.done.values()))


class _Looked:
    """At these models so far: `done`, by their ids."""

    def __init__(
        self,
        data: Data,
        hypotheses: Sequence[Hypothesis],
        progress: Callable[[tuple[str, ...]], None],
    ) -> None:
        self._data, self._progress = data, progress
        self.done: dict[tuple[str, ...], Fitted] = {}
        self._alone: Mapping[str, Problem] = {}
        null = self._fitted(())
        self._hypotheses = [h for h in hypotheses if h.possible(null.problem.flights[0].pack)]
        self._alone = {h.id: data.problems([h])[0] for h in self._hypotheses}
        self._shapes = {name: shapes_of(own, null) for name, own in self._alone.items()}

    def alone(self, most: int | None) -> None:
        """One effect each that promises anything, at most so many.

        Where `most` is None, all of them if these leave much unsaid, or see AHEAD.
        """
        promises, null = self._promises(0)[:most], self.done[()]
        for promise in promises:  # the twin may bend more than was thought
            if _gained(promise) > _needed(promise):
                self._extended(promise)
        ahead = null.held_out_rms_V() > AHEAD * null.rms_V()
        if most is None and (self._scale > UNSAID or ahead):
            for promise in promises:
                self._extended(promise)

    def together(self, size: int) -> None:
        """So many effects each."""
        for promise in self._promises(size - 1)[:TRIED]:
            if self._may_win(promise):
                self._extended(promise)

    def about_the_best(self, most: int) -> None:
        """Is one of its effects not needed, would another do as well, is one missing?

        Asked again of a better one that this finds. Missing: among all combinations those of a
        clock promise so much that they leave no place for others.
        """
        asked: set[tuple[str, ...]] = set()
        while (best := judged(self.done.values())[0].fitted).ids not in asked:
            asked.add(best.ids)
            fewer = combinations(best.problem.hypotheses, max(len(best.ids) - 1, 0))
            bases = [self._fitted(rest, best) for rest in fewer]
            for base in (b for b in (*bases, best) if 0 < len(b.ids) < most):
                promises = sorted(self._promises_of(base), key=lambda p: p.left)
                for promise in promises[:TRIED]:
                    if self._may_win(promise):
                        self._extended(promise)

    def _fitted(self, chosen: Sequence[Hypothesis], base: Fitted | None = None) -> Fitted:
        ids = tuple(sorted(h.id for h in chosen))
        if ids not in self.done:
            self._progress(ids)
            ordered = sorted(chosen, key=lambda h: h.id)
            problem = self._alone[ids[0]] if len(ids) == 1 else None
            self.done[ids] = fit(self._data, ordered, self._known(ids, base), problem)
        return self.done[ids]

    def _known(self, ids: Sequence[str], base: Fitted | None) -> list[Known]:
        """Numbers to begin at: those of a smaller model, and with them what it lacks as if alone.

        A clock that is right beside nothing is at hand then where no start of its own comes near.
        """
        if base is None or not base.ids:
            return []
        own = base.problem.values(base.q)
        more = [self.done[one,] for one in ids if one not in base.ids and (one,) in self.done]
        alone = [f.problem.values(f.q) for f in more]
        return [own, *({**lacked, **own} for lacked in alone)]

    def _extended(self, promise: Promise) -> None:
        self._fitted([*promise.base.problem.hypotheses, promise.more], promise.base)

    @property
    def _scale(self) -> float:
        return scale_of(self.done.values())

    def _promises(self, size: int) -> list[Promise]:
        """All models of `size` effects, each with one to add; the most probable come first."""
        found: dict[tuple[str, ...], Promise] = {}
        for base in [f for f in self.done.values() if len(f.ids) == size]:
            for own in self._promises_of(base):
                ids = tuple(sorted((*base.ids, own.more.id)))
                found[ids] = min(found.get(ids, own), own, key=lambda p: p.left)
        return sorted(found.values(), key=lambda p: -p.log_evidence)

    def _promises_of(self, base: Fitted) -> list[Promise]:
        others = [h for h in self._hypotheses if h.id not in base.ids]
        return [_promise(base, h, self._shapes[h.id]) for h in others]

    def _may_win(self, promise: Promise) -> bool:
        """It may leave no more than the best so far, and gains what an effect more has to.

        It has to promise, too, that little more than noise is left: on what no effect explains,
        ever larger combinations would be tried in vain.
        """
        squares, gained = [_squares(f) for f in self.done.values()], _gained(promise)
        least = promise.left - BENT * gained
        noise = float(promise.base.there.residuals.size)
        said = least < NOISY * noise + NEARLY_ALL * (max(squares) - noise)
        near = least < min(squares) + SLACK * self._scale
        return said and near and gained > _needed(promise)


def _gained(promise: Promise) -> float:
    """Squares, if the twin were linear."""
    return _squares(promise.base) - promise.left


def _needed(promise: Promise) -> float:
    """Squares that an effect more has to take."""
    return -2.0 * float(np.log(promise.more.before(promise.base.problem.flights[0].pack)))


def scale_of(fits: Iterable[Fitted]) -> float:
    """How much larger variances are than expected, by what leaves least."""
    return max(1.0, min(f.excess for f in fits))


def judged(fits: Iterable[Fitted]) -> tuple[Model, ...]:
    """With their evidence and probabilities beside each other, the most probable first.

    Where an error of the twin is stated, none is quite true: `bagged`.
    """
    whole = list(fits)
    scale = scale_of(whole)
    logs = np.array([f.log_evidence(scale) + f.log_before for f in whole])
    if whole[0].problem.heavy_tailed:
        logs = bagged(logs, map(np.array, zip(*(f.by_stretch(scale) for f in whole), strict=True)))
    share = np.exp(logs - logs.max())
    share /= share.sum()
    out = [
        Model(fitted=f, log_evidence=log, probability=p)
        for f, log, p in zip(whole, logs.tolist(), share.tolist(), strict=True)
    ]
    return tuple(sorted(out, key=lambda m: -m.log_evidence))


def shapes_of(problem: Problem, null: Fitted) -> tuple[Shape, ...]:
    """Of a problem's one hypothesis, about the twin as configured and each start, see NEAR."""
    before = null.problem.evidence(np.zeros(null.problem.size)).residuals
    own, starts, alone = problem.size - len(problem.flights), np.array(problem.starts()), []
    for start in starts:
        there = problem.evidence(start)
        slopes = there.slopes[:, :own]
        low, high = (end[:own] - start[:own] for end in problem.bounds)
        columns = np.column_stack([there.residuals - before, slopes])
        alone.append(Shape(slopes, columns, np.append(0.0, low), np.append(np.inf, high)))
    groups: dict[tuple[int, ...], Shape] = {}  # the same group once, about the first of its starts
    for start, shape in zip(starts, alone, strict=True):
        near = np.flatnonzero(np.abs(starts - start).max(axis=1) <= NEAR).tolist()
        groups.setdefault(tuple(near), shape)
    return tuple(_together(shape, [alone[k] for k in near]) for near, shape in groups.items())


def _together(about: Shape, near: Sequence[Shape]) -> Shape:
    return Shape(
        slopes=about.slopes,
        columns=np.hstack([s.columns for s in near]),
        low=np.concatenate([s.low for s in near]),
        high=np.concatenate([s.high for s in near]),
    )


def _promise(base: Fitted, h: Hypothesis, shapes: Sequence[Shape]) -> Promise:
    """About the start that promises most: a fit cannot be everywhere at once."""
    explained = [_explained(base, shape) for shape in shapes]
    best = int(np.argmax(explained))
    left = _squares(base) - explained[best]
    columns = np.hstack([base.there.slopes, shapes[best].slopes])
    information = np.eye(columns.shape[1]) + columns.T @ columns
    return Promise(base, h, left, -0.5 * (left + float(np.linalg.slogdet(information)[1])))


def _squares(f: Fitted) -> float:
    """Of the fitted recordings, with those of the prior."""
    return float(f.there.residuals @ f.there.residuals + f.q @ f.q)


def _explained(base: Fitted, more: Shape) -> float:
    """Squares that `more` takes from a fit, what that has being fitted again, with priors."""
    columns, k = np.hstack([base.there.slopes, more.columns]), base.q.size
    low, high = (end - base.q for end in base.problem.bounds)
    change = bounded(
        np.vstack([columns, np.eye(columns.shape[1])]),
        np.concatenate([base.there.residuals, base.q, np.zeros(more.low.size)]),
        (np.append(low, more.low), np.append(high, more.high)),
    )
    left = base.there.residuals + columns @ change
    drawn = base.q + change[:k]
    return _squares(base) - float(left @ left + drawn @ drawn + change[k:] @ change[k:])
