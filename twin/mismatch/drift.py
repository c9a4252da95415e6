"""A voltage that drifts: what every effect has to be more probable than, `beside_drift`.

A sensor whose zero or gain moves as it warms, a contact that ages, a reference that is wrong by
what it was an hour ago: each adds to a voltage what is slow and follows nothing the twin knows.
Effects together can shape themselves to that, in recordings that were held out too if it is alike
there: of drifts of 50 and 65 mV a flight hysteresis with a gain was named, and three effects. The
rival has no physics: in each recording something wanders smoothly. Its numbers, how far and how
fast, are as likely to be any of SHARES and FORGETS_S, and its evidence is that of all of them.

Source of the wander: Rasmussen, Williams, Gaussian Processes for Machine Learning (2006), section
4.2, Matern's covariance with nu 3/2; of the evidence, chapter 2.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from scipy.special import logsumexp

from twin.mismatch.choose import Model
from twin.mismatch.decide import Decision, most_of_noise
from twin.mismatch.finding import Verdict
from twin.mismatch.fit import Data, Fitted, excess_of
from twin.mismatch.flight import FloatArray
from twin.mismatch.hypothesis import PRIOR
from twin.mismatch.wander import Wander

FORGETS_S = (100.0, 300.0, 1000.0, 3000.0)
SHARES = tuple(2.5e-4 * 2.0**k for k in range(7))  # of the voltage, rms: 3 to 190 mV of 12 V
FINE, MOST = 16.0, 256  # points in the time that it takes to forget, and in all at most
LEAST = 1e-6  # of a variance, below which a way to wander is none


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """A wander of the voltage, and how probable it is.

    Attributes:
        moves_V: by how much the likeliest goes up and down within one recording, at most.
        log_evidence: as that of a `Model`, by all sizes and times.
        all_said: with it only noise is left.
    """

    moves_V: float
    log_evidence: float
    all_said: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Whitened rows of one recording: without its start, by its start, and by ways to wander.

    Attributes:
        residuals: (m,) with the start as configured.
        start: (m,) by one deviation of it.
        ways: (m, k) of 1 V each, of every time in FORGETS_S.
        courses_V: (n, k) the same as they are, not whitened.
    """

    residuals: FloatArray
    start: FloatArray
    ways: Sequence[FloatArray]
    courses_V: Sequence[FloatArray]

    def log_evidence(self, k: int, size_V: float, scale: float) -> float:
        """All amounts integrated out: exact, the twin being linear about its start."""
        _, information, pulled = self._normal(k, size_V, scale)
        size = float(self.residuals @ self.residuals) / scale
        size -= float(pulled @ np.linalg.solve(information, pulled))
        return -0.5 * (size + float(np.linalg.slogdet(information)[1]))

    def likeliest(self, k: int, size_V: float, scale: float) -> tuple[FloatArray, float]:
        """(m,) what is left with all amounts at their likeliest, and how far the drift goes [V]."""
        columns, information, pulled = self._normal(k, size_V, scale)
        amounts = np.linalg.solve(information, pulled)
        moves_V = float(np.ptp(self.courses_V[k] @ amounts[1:])) * size_V
        return self.residuals - columns @ amounts, moves_V

    def _normal(self, k: int, size_V: float, scale: float) -> tuple[FloatArray, ...]:
        columns = np.column_stack([self.start, size_V * self.ways[k]])
        information = np.eye(columns.shape[1]) + columns.T @ columns / scale
        return columns, information, columns.T @ self.residuals / scale


def beside_drift(
    decision: Decision, data: Data, found: Sequence[Model], scale: float
) -> tuple[Decision, tuple[str, ...]]:
    """`decision`, or that what was left out is unknown where a drift is more probable, and why.

    Where nothing is named of all recordings together, only the words, if it leaves nothing unsaid.

    Args:
        decision: one that nothing is left out stays.
        data: the recordings; where an error of the twin is stated, that is as slow.
        found: all models it was chosen from, the most probable first.
        scale: by which variances exceed what was expected.
    """
    null = next(m for m in found if not m.ids)
    if null.fitted.problem.heavy_tailed or decision.verdict is Verdict.NONE:
        return decision, ()
    named = bool(decision.model.ids)
    own, best = (scale, decision.model.fitted) if named else (1.0, found[0].fitted)
    drift = drift_in(data, null.fitted, own)
    likely = drift.log_evidence > best.log_evidence(own) + best.log_before
    if not likely or not (named or drift.all_said):
        return decision, ()
    remark = (
        f"A voltage that drifts slowly, by {1e3 * drift.moves_V:.2g} mV within a recording, is "
        f"more probable than {' + '.join(best.ids) or 'that nothing is left out'}: a sensor that "
        "warms, or something slow of the cells that has no name here"
    )
    unknown = Decision(verdict=Verdict.UNKNOWN, model=null, effects=())
    return unknown if named else decision, (remark,)


def drift_in(data: Data, null: Fitted, scale: float) -> Drift:
    """The likeliest in what a twin leaves that has nothing but its starts fitted, `null`.

    Variances are `scale` times what was expected.
    """
    rows = list(_rows(data, null))
    usual_V = float(np.mean([np.nanmean(f.voltage_V) for f, _ in data.fitted]))
    points = [(k, share * usual_V) for k in range(len(FORGETS_S)) for share in SHARES]
    logs = np.array([sum(own.log_evidence(*at, scale) for own in rows) for at in points])
    k, size_V = points[int(logs.argmax())]
    parts, moves_V = zip(*(own.likeliest(k, size_V, scale) for own in rows), strict=True)
    left = np.concatenate(parts)
    return Drift(
        moves_V=max(moves_V),
        log_evidence=float(logsumexp(logs)) - log(logs.size) + log(PRIOR),
        all_said=excess_of(left) < most_of_noise(left.size),
    )


def _rows(data: Data, null: Fitted) -> Iterator[_Rows]:
    """Of each recording; of a single one those that were fitted and those held out."""
    parts: dict[str, list[_Rows]] = {}
    for own, problem, q, there in (
        (data.fitted, null.problem, null.q, null.there),
        (data.held_out, null.judge, null.ahead_q, null.ahead),
    ):
        ends = np.cumsum([at.size for at in problem.stretches()])
        for k, (flight, whiten) in enumerate(own):
            at = slice(ends[k - 1] if k else 0, ends[k])
            start = there.slopes[at, k]
            more = start.size - whiten.samples.size  # of channels, in which nothing drifts
            courses_V = list(_ways(flight.time_s))
            ways = [np.pad(whiten(w), ((0, more), (0, 0))) for w in courses_V]
            parts.setdefault(flight.name, []).append(
                _Rows(there.residuals[at] - start * q[k], start, ways, courses_V)
            )
    for own_parts in parts.values():
        yield _Rows(
            np.concatenate([p.residuals for p in own_parts]),
            np.concatenate([p.start for p in own_parts]),
            [np.vstack(w) for w in zip(*(p.ways for p in own_parts), strict=True)],
            own_parts[0].courses_V,
        )


def _ways(time_s: FloatArray) -> Iterator[FloatArray]:
    """(n, k) for each of FORGETS_S: the principal components of a wander of 1 V."""
    for forgets_s in FORGETS_S:
        count = min(int((time_s[-1] - time_s[0]) / forgets_s * FINE) + 2, MOST)
        at_s = np.linspace(time_s[0], time_s[-1], count)
        apart_s = np.abs(at_s[:, None] - at_s).ravel()
        wander = Wander(size_V=1.0, forgets_s=forgets_s, damping=1.0)
        variances, shapes = np.linalg.eigh(wander.follows(apart_s).reshape(count, count))
        kept = variances > LEAST * variances[-1]
        ways = shapes[:, kept] * np.sqrt(variances[kept])
        yield np.column_stack([np.interp(time_s, at_s, way) for way in ways.T])
