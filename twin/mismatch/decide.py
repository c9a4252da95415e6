"""From models and their probabilities to a verdict."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from twin.mismatch.choose import ALIKE, NEARLY_ALL, Model, judged, scale_of
from twin.mismatch.finding import Candidate, NamedEffect, Value, Verdict
from twin.mismatch.fit import OWN_ERROR, Fitted
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.problem import rms
from twin.mismatch.sizes import uncertainty

NUMERICS_V = 7.5e-4
"""Of a cell: what changes the voltage by less, rms, alone or beside others, cannot be told from the
error of the numerics. This twin and PyBaMM on fine meshes differ by 0.1 to 0.57 mV
(`tests/mismatch_cases`); of discharges by it to the end of a cell, with less lithium and a
resistance, salt of 1.04 that was not there took 0.58 mV."""
BY_CHANCE = 2.0  # standard deviations: of 44 predictions that are as good one seems so much worse
TOLD = 0.98  # of the prior's deviation, beyond which a recording tells nothing of a number
NOT_WHITE = (12.0, 70.0)
"""Over the root of the number of samples, and over that number: excess of what is left beyond 1,
above which it is not just noise. Of 100 residuals of pure noise one exceeds it, be they 5 samples
or 10 000 (`test_one_of_a_hundred_residuals_of_pure_noise_is_not_taken_for_noise`)."""
FEW = 6.63
"""That excess of few samples, which by their correlation tell as much as one: 1 % of chi-squared
with one degree of freedom is more."""
NOISE_KNOWN = 2.5
"""Relative deviation of a variance by the median of third differences, times the square root of the
number of samples: with few of them the noise is not known well, nor an excess."""
NOT_NOISE = 4.0
"""Times the noise, held out: only what the best model leaves beyond can be the error of a cell that
is not quite the right one. Nearer, what is left has to be noise."""
CELL_V = 0.1
"""Of a cell: what may be left in that case. Calibrated twins miss 10 to 90 mV of tests that they
have not seen (`benchmarks/calibration_real.py`); more is not explained."""
AT_MOST = 2.5
"""Times the stated error of a twin: of eleven real controls without much noise the worst is missed
by 2.4 of it (`docs/proof.md`)."""
AS_STATED = 2.0
"""Standard errors that a pack states of a number: within, it is known to be so, not left out."""
UNBELIEVED = 3.0
"""Such errors beyond which a number is not what was left out: by chance 1 of 370 is so far off."""
MOST_ALIKE = 3  # members of a list of equivalents that still is a name, if none is likely alone
LIKELY = 0.5
DELAYS = {"clock_shift": "shift_s", "sensor_lag": "lag_s"}
WITHIN = 0.5
"""Of a sample: shorter delays are told from each other by gusts that nobody sampled alone. A clock
0.14 s late at 2 Hz was named a lag twice, by odds of e^23 and e^39, with 1.2 and 2 times the noise
left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Decision:
    """A verdict, the model it rests on, the effects in it, and all models it was chosen from."""

    verdict: Verdict
    model: Model
    effects: tuple[NamedEffect, ...]
    among: tuple[Model, ...] = ()


def decide(models: Sequence[Model], scale: float, *, stated_V: float = 0.0) -> Decision:
    """Of all that was looked at, the most probable first.

    Args:
        models: with the one that leaves nothing out among them.
        scale: by which variances exceed what was expected.
        stated_V: error of the twin as whoever calibrated it states it; 0 if nobody did. An effect
            has to change the voltage by more, in what is fitted as in what is held out; or by more
            than OWN_ERROR of it in what is held out, where it was not fitted.
    """
    null = next(m for m in models if not m.ids)
    enough = _enough(models, stated_V) if stated_V else ()
    if enough:
        models, scale = enough, scale_of(m.fitted for m in enough)
    best = models[0] if enough else _simplest(models)
    changes_V = _changes_V(best.fitted, null.fitted)
    small = max(changes_V) < NUMERICS_V * _series(null.fitted)
    small |= min(changes_V) < stated_V and changes_V[1] < OWN_ERROR * stated_V
    own = bool(stated_V) and _errs_as_stated(null.fitted, stated_V)
    idle = not best.ids or null.probability > LIKELY or small or own
    if idle or _misleads(best.fitted, null.fitted):
        verdict = Verdict.NONE if nothing_left(null.fitted) or own else Verdict.UNKNOWN
        return Decision(verdict=verdict, model=null, effects=())
    if not enough and not nothing_left(best.fitted):
        models = [m for m in models if m.ids and nearly(m.fitted, null.fitted)]
        within = [m for m in models if set(m.ids) <= set(best.ids)]
        most_V = NOT_NOISE * best.fitted.judge.noise_V
        if not within or best.fitted.held_out_rms_V() < most_V:
            return Decision(verdict=Verdict.UNKNOWN, model=null, effects=())
        best = min(within, key=lambda m: len(m.ids))
    numbers = _numbers(best.fitted, scale)
    effects = tuple(
        _named(h, numbers[h.id], best, models, scale) for h in best.fitted.problem.hypotheses
    )
    verdict = Verdict.NAMED if all(_clear(e, models) for e in effects) else Verdict.AMBIGUOUS
    return Decision(verdict=verdict, model=best, effects=effects, among=tuple(models))


def _clear(e: NamedEffect, models: Sequence[Model]) -> bool:
    """Few look like it, or it alone is more probable than all others together."""
    alone = sum(m.probability for m in models if e.id in m.ids)
    return e.probability > LIKELY and (len(e.equivalent) <= MOST_ALIKE or alone > LIKELY)


def _enough(models: Sequence[Model], stated_V: float) -> tuple[Model, ...]:
    """Those of the fewest effects that leave what a calibrated twin may err by, if there are any.

    Its error is no noise of a known kind: what more effects take from it speaks for none of them.
    Of as few, those with none within its stated errors come first: one as fast as the noise would
    decide, however little it changes. None has a number that the pack states to be another. Where
    fewer effects, which leave more, are likelier than all of them, it is those. Beside them are as
    few that are as likely and leave up to AT_MOST of it.
    """
    believed = [m for m in models if m.ids and _believed(m.fitted)]
    within = [m for m in believed if m.fitted.within(OWN_ERROR * stated_V)]
    fewest = _of_fewest(within)
    if not fewest:
        return ()
    top, least = max(m.log_evidence for m in fewest), len(fewest[0].ids)
    smaller = [m for m in believed if len(m.ids) < least and m.log_evidence > top]
    beside = [
        m
        for m in believed
        if len(m.ids) == least
        and m not in fewest
        and top - m.log_evidence < ALIKE
        and m.fitted.within(AT_MOST * stated_V)
    ]
    chosen = [m.fitted for m in _of_fewest(smaller) or [*fewest, *beside]]
    return judged([f for f in chosen if not _as_stated(f)] or chosen)


def _of_fewest(models: Sequence[Model]) -> list[Model]:
    """Those with the fewest effects."""
    least = min((len(m.ids) for m in models), default=0)
    return [m for m in models if len(m.ids) == least]


def _as_stated(fitted: Fitted) -> bool:
    """Of one of its effects all numbers are within the errors that the pack states of them."""
    return any(
        own and all(off < AS_STATED and name in own for name, off in numbers.items())
        for own, numbers in _beside_stated(fitted)
    )


def _believed(fitted: Fitted) -> bool:
    """None of its numbers is far beyond the errors that the pack states of them."""
    return all(
        off < UNBELIEVED
        for own, numbers in _beside_stated(fitted)
        for name, off in numbers.items()
        if name in own
    )


def _beside_stated(fitted: Fitted) -> Iterator[tuple[Collection[str], Mapping[str, float]]]:
    """Of each effect the numbers that the pack states, and how far off all are, in its errors."""
    q = iter(np.abs(fitted.q).tolist())
    known = fitted.problem.flights[0].pack.standard_errors
    for h in fitted.problem.hypotheses:
        yield known.get(h.id, {}), {name: next(q) for name in h.fitted}


def _simplest(models: Sequence[Model]) -> Model:
    """The most probable, without those of its effects for which the evidence is not strong.

    Nor those that spoil what was not fitted, or change the voltage by less than numerics err, where
    only noise is left without.
    """
    best = models[0]
    near = [
        m
        for m in models
        if set(m.ids) <= set(best.ids)
        and (
            best.log_evidence - m.log_evidence < ALIKE
            or _misleads(best.fitted, m.fitted)
            or _hardly_less(m.fitted, best.fitted)
        )
    ]
    return min(near, key=lambda m: len(m.ids))


def _hardly_less(fitted: Fitted, best: Fitted) -> bool:
    """What `best` says beyond is within the error of the numerics, and only noise is left."""
    changes_V = (*_changes_V(best, fitted), *_changes_V(fitted, best))  # for the better, the worse
    return nothing_left(fitted) and max(changes_V) < NUMERICS_V * _series(best)


def _misleads(fitted: Fitted, without: Fitted) -> bool:
    """What was not fitted is predicted worse than without, beyond chance.

    It says nothing of the cell: residuals within the twin's own error look like noise to the
    evidence, however slow they are. Starts of what was held out are at their best: one that is a
    little off, which nobody fitted, would make the right effect the worse.
    """
    left_V, before_V = fitted.started_V(), without.started_V()
    chance_V = BY_CHANCE * fitted.judge.lasting_V / sqrt(left_V.size)
    more = float(np.mean(left_V**2 - before_V**2))
    return more > 2.0 * chance_V * rms(left_V - before_V)


def _errs_as_stated(null: Fitted, stated_V: float) -> bool:
    """The twin misses no more beside noise, with its starts fitted or as configured."""
    as_configured_V = null.problem.rms_V(np.zeros(null.problem.size))
    configured = as_configured_V < hypot(stated_V, null.problem.noise_V)
    ahead = null.held_out_rms_V() < hypot(stated_V, null.judge.noise_V)
    return null.within(stated_V) or (configured and ahead)


def _changes_V(fitted: Fitted, null: Fitted) -> tuple[float, float]:
    """Rms of what a model takes from the residuals that were fitted, and from those held out."""
    squares = (
        null.rms_V() ** 2 - fitted.rms_V() ** 2,
        null.held_out_rms_V() ** 2 - fitted.held_out_rms_V() ** 2,
    )
    return sqrt(max(squares[0], 0.0)), sqrt(max(squares[1], 0.0))


def _series(fitted: Fitted) -> int:
    return min(f.pack.series for f in fitted.judge.flights)


def nothing_left(fitted: Fitted) -> bool:
    """Nothing but noise, or what the numerics of two solvers differ by."""
    return white(fitted) or fitted.within(NUMERICS_V * _series(fitted))


def white(fitted: Fitted) -> bool:
    """Nothing but noise is left."""
    samples = max(min(fitted.there.residuals.size, fitted.ahead.residuals.size), 1)
    return fitted.excess < most_of_noise(samples) * (1.0 + NOISE_KNOWN / sqrt(samples))


def most_of_noise(samples: int) -> float:
    """Excess of so many samples of noise whose variance is known, see NOT_WHITE."""
    return min(FEW, 1.0 + NOT_WHITE[0] / sqrt(samples) + NOT_WHITE[1] / samples)


def nearly(fitted: Fitted, null: Fitted) -> bool:
    """Little is left on what was not fitted, see NEARLY_ALL."""
    noise_V = fitted.judge.noise_V
    left_V, share = fitted.held_out_rms_V(), NEARLY_ALL / len(fitted.ids)
    little = left_V**2 - noise_V**2 < share * (null.held_out_rms_V() ** 2 - noise_V**2)
    most_V = max(CELL_V * _series(fitted), OWN_ERROR * fitted.judge.own_V)
    return little and left_V < most_V


def candidates(models: Sequence[Model]) -> tuple[Candidate, ...]:
    """All of them, for a table."""
    top = models[0].log_evidence
    return tuple(
        Candidate(
            ids=m.ids,
            held_out_rms_V=m.fitted.held_out_rms_V(),
            delta_bic=2.0 * (top - m.log_evidence),
            probability=m.probability,
            excess=m.fitted.excess,
        )
        for m in models
    )


def _named(
    h: Hypothesis, numbers: tuple[Value, ...], best: Model, models: Sequence[Model], scale: float
) -> NamedEffect:
    alike = _alike(h.id, best, models, scale)
    probability = sum(m.probability for m in models if {h.id, *alike} & set(m.ids))
    return NamedEffect(
        id=h.id,
        pack_id=h.kind.id,
        probability=min(probability, 1.0),  # of all models the sum is 1 but for rounding
        parameters=numbers,
        instead={other: _numbers(m.fitted, scale)[other] for other, m in alike.items()},
        equation=h.kind.equation,
        source=h.kind.source,
        signature=h.kind.signature,
    )


def _numbers(fitted: Fitted, scale: float) -> dict[str, tuple[Value, ...]]:
    """Of each effect of a model, those that the recordings tell."""
    told = fitted.problem.told(np.sqrt(np.diag(fitted.covariance(scale))), TOLD)
    values = fitted.problem.values(fitted.q)
    errors = fitted.problem.stds(fitted.q, uncertainty(fitted, scale))
    return {
        h.id: tuple(
            Value(name=p.name, value=values[h.id][p.name], std=errors[h.id][p.name], unit=p.unit)
            for p in h.parameters
            if p.name in told[h.id]
        )
        for h in fitted.problem.hypotheses
    }


def _alike(effect: str, best: Model, models: Sequence[Model], scale: float) -> dict[str, Model]:
    """Effects that may stand in the place of `effect`, the best first, and the models with them."""
    return _as_likely(effect, best, models, scale) | _as_late(effect, best, models)


def _as_late(effect: str, best: Model, models: Sequence[Model]) -> dict[str, Model]:
    """Of `_alike` another of DELAYS, if both are but part of a sample: see WITHIN."""
    if effect not in DELAYS or not _brief(effect, best):
        return {}
    rest = set(best.ids) - {effect}
    return {
        other: m
        for m in models
        for other in DELAYS.keys() - {effect}
        if set(m.ids) == {*rest, other} and _brief(other, m)
    }


def _brief(delay: str, m: Model) -> bool:
    """It is shorter than WITHIN of a sample in each recording."""
    problem = m.fitted.problem
    size_s = abs(problem.values(m.fitted.q)[delay][DELAYS[delay]])
    loads = (f.recorded_load for f in problem.flights)
    return all(size_s < WITHIN * np.median(np.diff(load.time_s)) for load in loads)


def _as_likely(effect: str, best: Model, models: Sequence[Model], scale: float) -> dict[str, Model]:
    """Of `_alike` by what is left.

    Those whose model is as probable; where they are few, also those that only have more numbers
    than they need: a cell with a bad contact is a resistance of the pack.
    """
    rest = set(best.ids) - {effect}
    out: dict[str, Model] = {}
    for how in (_evidence, _likelihood):
        for m in models:
            other = set(m.ids) - rest
            near = how(best, scale) - how(m, scale) < ALIKE
            if near and rest < set(m.ids) and len(other) == 1 and not other & {effect, *out}:
                out |= dict.fromkeys(other, m)
            if how is _likelihood and len(out) >= MOST_ALIKE:
                return out
    return out


def _evidence(m: Model, scale: float) -> float:  # noqa: ARG001
    return m.log_evidence


def _likelihood(m: Model, scale: float) -> float:
    return m.fitted.log_likelihood(scale)
