"""Models of recordings, with what flowed before these where that is likely."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations

from twin.mismatch.begun import begins_under_load
from twin.mismatch.choose import ALIKE, MOST_EFFECTS, Model, models
from twin.mismatch.fit import Data, Fitted, fit
from twin.mismatch.flight import Flight
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.noise import Noise, Whitener
from twin.mismatch.split import Recorded, own_whitener
from twin.pack import Pack

MOST_ROUNDS = 3
"""In which a twin is asked anew what a flight before left in it, and models are fitted anew."""
MOST_ASKED = 4
"""Models of which each is asked what a flight before left in its own twin."""


def search(  # noqa: PLR0913
    data: Data, hypotheses: Sequence[Hypothesis], *, stated: bool,
    progress: Callable[[tuple[str, ...]], None],
    most_effects: int = MOST_EFFECTS, most_alone: int | None = None,
) -> tuple[Data, tuple[Model, ...]]:  # fmt: skip
    """All models that were fitted, see `models`, and the recordings as they were seen by them.

    Whether a pack had flown before is asked of effects one by one: all of them would be fitted
    twice. `stated`: an error of the twin is, which is as slow: it is not asked then.
    """

    def of(own: Data, most: int) -> tuple[Model, ...]:
        return models(own, hypotheses, progress=progress, most_effects=most, most_alone=most_alone)

    if stated or not _any_begins_under_load(data):
        return data, of(data, most_effects)
    rested, found = data, of(data, 1)
    alone = found
    for _ in range(MOST_ROUNDS):
        begun = flown_before(data, [m.fitted for m in found])
        if begun is None:
            break
        data, found = begun, of(begun, most_effects)
    best = found[0].fitted
    if data is not rested and _log_of((best, data)) > _log_of((_at(best, rested), rested)):
        return data, found
    return rested, alone if most_effects == 1 else of(rested, most_effects)


def flown_before(data: Data, found: Sequence[Fitted]) -> Data | None:
    """With packs that had flown before recordings that begin under load.

    None if none begins so, or that is hardly more probable than the best that was `found`, be it
    by all of its effects or by fewer: some may have stood for what flowed before.
    """
    best = max(found, key=lambda f: _log_of((f, data)))
    if not _any_begins_under_load(data) or (_any_flown(data) and set(best.ids) == set(data.near)):
        return None
    there, before = max((_settled(data, best, own) for own in _parts(best)), key=_log_of)
    return before if _log_of((there, before)) - _log_of((best, data)) > ALIKE else None


def again(data: Data, found: Sequence[Fitted]) -> Data:
    """Where packs had flown before, what that left by the likeliest of what was `found`, the first.

    Each by its own twin: by what it left in another's, and in noise that was taken too large, the
    truth may have looked the worse. As it was, if that is hardly more probable.
    """
    if not _any_flown(data):
        return data
    asked = (_settled(data, own, own.problem.hypotheses) for own in found[:MOST_ASKED])
    there = max(asked, key=_log_of)
    as_was = _at(found[0], data), data
    return there[1] if _log_of(there) - _log_of(as_was) > ALIKE else data


def _settled(data: Data, best: Fitted, own: Sequence[Hypothesis]) -> tuple[Fitted, Data]:
    """These effects at their best, and what flowed before by the twin that has them.

    Particles that are slow keep more of it, and for longer. How slow they are is told first by what
    it left in the twin as configured, then by what it left in the one so found, while that is more
    probable.
    """
    before = replace(_flown(data), near=best.problem.values(best.q))
    now = fit(before, own), before
    for _ in range(MOST_ROUNDS if own else 0):
        before = replace(_flown(data, now[0]), near=now[0].problem.values(now[0].q))
        then = _at(now[0], before), before
        if _log_of(then) - _log_of(now) < ALIKE:
            break
        now = then
    fitted, before = now
    return fitted, replace(before, near=fitted.problem.values(fitted.q))


def _at(there: Fitted, data: Data) -> Fitted:
    """Its effects in these recordings, from where it is."""
    return fit(data, there.problem.hypotheses, [there.problem.values(there.q)])


def _log_of(seen: tuple[Fitted, Data]) -> float:
    """Of the probability of all samples, in volts."""
    fitted, data = seen
    return fitted.log_evidence(1.0) + fitted.log_before - data.log_size


def _any_begins_under_load(data: Data) -> bool:
    own = (f for f, _ in (*data.fitted, *data.held_out))
    return any(begins_under_load(f.pack, f.recorded_load) for f in own)


def _flown(data: Data, about: Fitted | None = None) -> Data:
    """Where a recording begins under load, by the twin as configured or as it is `about` there."""

    def of(own: Recorded, packs: Sequence[Pack | None]) -> Recorded:
        out = []
        for (flight, w), pack in zip(own, packs, strict=True):
            if begins_under_load(flight.pack, flight.recorded_load):
                noise = replace(w.noise, flown=True)
                w = own_whitener(flight, noise, pack) if pack else _as_configured(flight, noise)
            out.append((flight, w))
        return tuple(out)

    unsaid = tuple([None] * len(own) for own in (data.fitted, data.held_out))
    fitted, ahead = about.packs if about else unsaid
    return replace(data, fitted=of(data.fitted, fitted), held_out=of(data.held_out, ahead))


@lru_cache(maxsize=16)  # of recordings: each set of effects asks for it first
def _as_configured(flight: Flight, noise: Noise) -> Whitener:
    return own_whitener(flight, noise)


def _any_flown(data: Data) -> bool:
    return any(w.noise.flown for _, w in (*data.fitted, *data.held_out))


def _parts(fitted: Fitted) -> Iterator[tuple[Hypothesis, ...]]:
    """Its hypotheses, all and fewer."""
    own = fitted.problem.hypotheses
    for size in range(len(own) + 1):
        yield from combinations(own, size)
