"""A hypothesis at its best, and how much the recordings speak for it.

Evidence is the probability of the recordings, numbers of the hypothesis integrated out (Laplace:
the posterior is taken as normal around its peak): MacKay, Information Theory, Inference, and
Learning Algorithms (2003), chapter 28. It is that of the fitted recordings times that of the
held-out ones given the fit: numbers that only fit are paid for, numbers that predict are not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import hypot, log

import numpy as np
import numpy.typing as npt

from twin.calibrate.polish import Polished, polish
from twin.correlation import correlation_time
from twin.mismatch.flight import Flight
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.noise import Whitener
from twin.mismatch.problem import Evidence, Problem
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

MOST_STEPS = 25
MOST_FOLLOWED = 3  # of the starts, those that miss least
SMALL_GAIN = 1e-3  # of the cost, expected of the last step: what is left after it is far less
LITTLE = 2.0  # squares
OWN_ERROR = 2.0
"""Times the stated error of a twin, which may be left: at other rates and in other air than those
of its calibration it errs more (`benchmarks/calibration_real.py`: LG M50 19 mV at 0.5C and 25 degC,
46 at 1C and 10 degC)."""
SAME_WAY = 0.1  # deviations of the prior, between points on two ways down
Known = Mapping[str, Mapping[str, float]]  # hypothesis -> number -> value


@dataclass(frozen=True, slots=True, eq=False)
class Data:
    """What is fitted and what is held out: each flight with its whitener.

    A flight may be in both, with other samples judged in each.

    Attributes:
        fitted: by which numbers are told.
        held_out: by which they are judged.
        beyond: samples that do not count, since a cell is beyond its cut-off there,
        alone: since they stand alone, far from those before and after,
        unheard: and since a clock that is off leaves no current there.
        near: numbers that some hypotheses had when the noise was found: fits begin there too.
    """

    fitted: tuple[tuple[Flight, Whitener], ...]
    held_out: tuple[tuple[Flight, Whitener], ...]
    beyond: int = 0
    alone: int = 0
    unheard: int = 0
    near: Known = field(default_factory=dict)

    @property
    def noise_V(self) -> float:
        """Noise of what is held out, by voltage and current."""
        return float(np.sqrt(np.mean([w.noise.by_chance_V**2 for _, w in self.held_out])))

    @property
    def log_size(self) -> float:
        """Logarithm of the product of all deviations that whitened samples are in."""
        own = (*self.fitted, *self.held_out)
        return float(sum(np.sum(np.log(w.unexpected.deviation)) for _, w in own))

    @property
    def squared(self) -> "Data":
        """The same with squares as the loss of all samples, however far off; itself if it is so."""
        if not any(w.noise.heavy_tailed for _, w in (*self.fitted, *self.held_out)):
            return self
        fitted, held_out = (
            tuple((f, replace(w, noise=replace(w.noise, heavy_tailed=False))) for f, w in own)
            for own in (self.fitted, self.held_out)
        )
        return replace(self, fitted=fitted, held_out=held_out)

    def problems(self, hypotheses: Sequence[Hypothesis]) -> tuple[Problem, Problem]:
        """Of the fitted and of the held-out recordings."""
        return Problem(self.fitted, hypotheses), Problem(self.held_out, hypotheses)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """Hypotheses at their best values.

    Attributes:
        problem: of the fitted recordings.
        judge: of the held-out ones.
        q: (k,) coordinates in `problem`.
        there: residuals and slopes of the fitted recordings at q.
        ahead_q: (k,) coordinates in `judge`: the same numbers; starts that were not fitted as
            configured, those that are open at their best.
        ahead: of the held-out ones, there.
        kept: share of what the linearised twin says that the held-out ones would gain by numbers
            of their own, within the errors of these, which they do gain.
    """

    problem: Problem
    judge: Problem
    q: FloatArray
    there: Evidence
    ahead_q: FloatArray
    ahead: Evidence
    kept: float = 1.0

    @property
    def ids(self) -> tuple[str, ...]:
        """Of the hypotheses, sorted: what is in does not depend on the order."""
        return tuple(sorted(h.id for h in self.problem.hypotheses))

    @property
    def log_before(self) -> float:
        """Logarithm of the probability of these effects before anything is seen."""
        pack = self.problem.flights[0].pack
        return sum(log(h.before(pack)) for h in self.problem.hypotheses)

    @property
    def excess(self) -> float:
        """Mean square of whitened residuals times their correlation time; 1 if all is said.

        Of the fitted or the held-out recordings, whichever is more; the starts of those that were
        held out are taken at their best within their tolerance.
        """
        return max(excess_of(self.there.residuals), excess_of(self._started))

    def log_likelihood(self, scale: float) -> float:
        """Of all recordings at the best numbers, the starts of those held out at theirs."""
        there, ahead = self.there.residuals, self._started
        return -0.5 * float(there @ there + ahead @ ahead) / scale

    def by_stretch(self, scale: float) -> list[FloatArray]:
        """(b,) of each recording: `log_likelihood` of its stretches, see `Problem.stretches`."""
        out: list[FloatArray] = []
        for own, r in ((self.problem, self.there.residuals), (self.judge, self._started)):
            places = own.stretches()
            ends = np.cumsum([at.size for at in places])[:-1]
            parts = zip(places, np.split(r, ends), strict=True)
            out += [np.bincount(at, -0.5 / scale * part**2).astype(float) for at, part in parts]
        return out

    @property
    def _started(self) -> FloatArray:
        """Residuals held out, each recording's start at its best within its tolerance."""
        own = self.ahead.slopes[:, self._shared :]
        return np.asarray(self.ahead.residuals + own @ self._moved_starts)

    @property
    def _moved_starts(self) -> FloatArray:
        """(flights,) from where the starts of what was held out are to their best."""
        own = self.ahead.slopes[:, self._shared :]
        inner = np.eye(own.shape[1]) + own.T @ own
        pulled = own.T @ self.ahead.residuals + self._off[self._shared :]
        return np.asarray(-np.linalg.solve(inner, pulled))

    @property
    def _shared(self) -> int:
        """Coordinates that fitted and held-out recordings have in common, the first ones."""
        return self.q.size - len(self.problem.flights)

    def log_evidence(self, scale: float) -> float:
        """Of all recordings, variances being `scale` times what was expected."""
        return self._log_fitted(scale) + self._log_ahead(scale)

    def _log_fitted(self, scale: float) -> float:
        r, j = self.there.residuals, self.there.slopes
        information = np.eye(self.q.size) + j.T @ j / scale
        size = float(r @ r) / scale + float(self.q @ self.q)
        return -0.5 * (size + float(np.linalg.slogdet(information)[1]))

    def _log_ahead(self, scale: float) -> float:
        """Of what was held out, by the posterior of the numbers; its own starts by their prior."""
        before, after, pulled = self._pulled(scale)
        r, j, off = self.ahead.residuals, self.ahead.slopes, self._off
        size = (float(r @ r) + self.kept * float(r @ j @ pulled)) / scale
        size += float(off @ off) + self.kept * float(off @ pulled)
        dets = [float(np.linalg.slogdet(m)[1]) for m in (after, before)]
        return -0.5 * (size + dets[0] - dets[1])

    def _pulled(self, scale: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Information on the numbers before what was held out and after, and where that pulls."""
        shared = self._shared
        r, j = self.ahead.residuals, self.ahead.slopes
        before = np.eye(j.shape[1])
        before[:shared, :shared] = np.linalg.inv(self.covariance(scale)[:shared, :shared])
        after = before + j.T @ j / scale
        return before, after, np.asarray(-np.linalg.solve(after, j.T @ r / scale + self._off))

    @property
    def _off(self) -> FloatArray:
        """(k,) by which starts that were not fitted are off their prior.

        The numbers are where they are, and so is the start of a recording of which parts were
        fitted: that is paid for there.
        """
        fitted = {f.name for f in self.problem.flights}
        own = np.array([f.name not in fitted for f in self.judge.flights])
        return np.append(np.zeros(self._shared), self.ahead_q[self._shared :] * own)

    def verified(self) -> "Fitted":
        """With `kept`, where much is promised: beyond a bound or a bend there is nothing to gain.

        A clock that is right is at such a bend: between samples a shift makes more of the noise of
        a current, be it early or late.
        """
        before, _, pulled = self._pulled(1.0)
        r, off = self.ahead.residuals, self._off
        promised = -float(r @ self.ahead.slopes @ pulled + off @ pulled)
        if promised < LITTLE:
            return self
        there = np.concatenate(self.judge.whitened([self.ahead_q + pulled])[0])
        gained = float(r @ r - there @ there - (2.0 * off + pulled @ before) @ pulled)
        return replace(self, kept=min(max(gained / promised, 0.0), 1.0))

    def covariance(self, scale: float) -> FloatArray:
        """(k, k) of the coordinates, by the fitted recordings."""
        j = self.there.slopes
        return np.asarray(np.linalg.inv(np.eye(self.q.size) + j.T @ j / scale))

    def rms_V(self) -> float:
        """Recorded minus simulated, judged samples of the fitted recordings."""
        return self.there.rms_V

    def held_out_rms_V(self) -> float:
        """The same of the held-out ones."""
        return self.ahead.rms_V

    def within(self, most_V: float) -> bool:
        """All that is missed beside noise, fitted or held out, is less, rms."""
        there = self.rms_V() < hypot(most_V, self.problem.noise_V)
        return there and self.held_out_rms_V() < hypot(most_V, self.judge.noise_V)

    def started_V(self) -> FloatArray:
        """(s,) the same, of each sample, their starts at their best within their tolerance."""
        return np.asarray(self.ahead.left_V + self.ahead.by_start_V @ self._moved_starts)

    def starts_std(self) -> dict[str, float]:
        """Recording -> standard deviation of the state of charge at its start."""
        _, after, _ = self._pulled(1.0)
        both = ((self.judge, np.linalg.inv(after)), (self.problem, self.covariance(1.0)))
        return {
            f.name: f.start_std * float(np.sqrt(variance))
            for problem, covariance in both
            for f, variance in zip(
                problem.flights, np.diag(covariance)[self._shared :], strict=True
            )
        }

    @property
    def packs(self) -> tuple[list[Pack], list[Pack]]:
        """As they are by this: one each of the fitted recordings, and of the held-out ones."""
        both = ((self.problem, self.q), (self.judge, self.ahead_q))
        fitted, ahead = ([p.pack(q, k) for k in range(len(p.flights))] for p, q in both)
        return fitted, ahead


def fit(
    data: Data, hypotheses: Sequence[Hypothesis],
    known: Sequence[Known] = (), problem: Problem | None = None,
) -> Fitted:  # fmt: skip
    """The best of the fits from all starts.

    Of many starts the best MOST_FOLLOWED are followed. `known` are numbers of hypotheses in smaller
    models: they are starts too, and then only the best of all is followed. `problem` is that of the
    fitted recordings if it is there already.
    """
    own, judge = data.problems(hypotheses)
    problem = problem or own
    starts = problem.starts()
    if hypotheses and all(h.id in data.near for h in hypotheses):
        starts += problem.starts_from(data.near)
    for numbers in known:
        starts += problem.starts_from(numbers)
    return _descended(problem, judge, _least(problem, starts, 1 if known else MOST_FOLLOWED))


def refit(data: Data, there: Fitted) -> Fitted:
    """The same hypotheses by another loss, from where they are; one alone from its starts too.

    Of all these the best MOST_FOLLOWED are followed. Where none leaves only what a twin is stated
    to err by, though it did from where they are, they stay there: to a loss that tames single
    samples a level that is off all along is one, after which the filter expects it. Of 27 mOhm put
    into a recorded discharge of an LG M50 at 0 degC squares find 24, such a loss 40.
    """
    problem, judge = data.problems(there.problem.hypotheses)
    starts = [there.q, *(problem.starts() if len(there.ids) == 1 else [])]
    best = _descended(problem, judge, _least(problem, starts, MOST_FOLLOWED))
    most_V = OWN_ERROR * judge.own_V
    if not most_V or best.within(most_V):
        return best
    stayed = _at(problem, judge, there.q)
    return stayed if stayed.within(most_V) else best


def _least(problem: Problem, starts: Sequence[FloatArray], most: int) -> list[FloatArray]:
    """At most so many of the starts, those that cost least, the least first."""
    if len(starts) <= most:
        return list(starts)
    costs = problem.costs(starts)
    return [starts[k] for k in np.argsort(costs, kind="stable")[:most]]


def _descended(problem: Problem, judge: Problem, starts: Sequence[FloatArray]) -> Fitted:
    been: list[Polished] = []
    for start in starts:
        own: list[Polished] = []
        for step in polish(problem, start, most_steps=MOST_STEPS, small_gain=SMALL_GAIN):
            own.append(step)
            if any(_lower_beside(step, other) for other in been):
                break
        been += own
    return _at(problem, judge, min(been, key=lambda p: p.cost).q)


def _at(problem: Problem, judge: Problem, q: FloatArray) -> Fitted:
    ahead_q = _ahead(q, problem, judge)
    return Fitted(
        problem=problem,
        judge=judge,
        q=q,
        there=problem.evidence(q),
        ahead_q=ahead_q,
        ahead=judge.evidence(ahead_q),
    ).verified()


def _lower_beside(step: Polished, other: Polished) -> bool:
    """A way from another start went on from there, so that this one would end where that did."""
    return other.cost <= step.cost and float(np.abs(other.q - step.q).max()) < SAME_WAY


def excess_of(residuals: FloatArray) -> float:
    """Variance of the mean of whitened residuals over that of independent ones."""
    if residuals.size == 0:
        return 1.0
    return float(np.mean(residuals**2)) * correlation_time(residuals)


def _ahead(q: FloatArray, of: Problem, to: Problem) -> FloatArray:
    """(k,) see `Fitted.ahead_q`."""
    shared = q.size - len(of.flights)
    starts = dict(zip((f.name for f in of.flights), q[shared:].tolist(), strict=True))
    carried = np.append(q[:shared], [starts.get(f.name, 0.0) for f in to.flights])
    own = [shared + k for k, f in enumerate(to.flights) if f.start_open and f.name not in starts]
    if not own:
        return carried
    *_, best = polish(_Some(to, carried, own), carried[own], small_gain=SMALL_GAIN)
    carried[own] = best.q
    return carried


@dataclass(frozen=True, slots=True, eq=False)
class _Some:
    """Some coordinates of a problem, the others held at q (k,)."""

    problem: Problem
    q: FloatArray
    own: Sequence[int]

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        low, high = self.problem.bounds
        return low[self.own], high[self.own]

    def linearised(self, own_q: FloatArray) -> tuple[FloatArray, FloatArray]:
        residuals, slopes = self.problem.linearised(self._at(own_q))
        return residuals, slopes[:, self.own]

    def cost(self, own_q: FloatArray) -> float:
        return self.problem.cost(self._at(own_q))

    def _at(self, own_q: FloatArray) -> FloatArray:
        out = self.q.copy()
        out[self.own] = own_q
        return out
