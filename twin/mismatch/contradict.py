"""Do the recordings contradict each other? Each alone, where together they stay unexplained."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from math import hypot

import numpy as np

from twin.mismatch.choose import scale_of
from twin.mismatch.decide import Decision, decide
from twin.mismatch.finding import NamedEffect, Value, Verdict
from twin.mismatch.flight import Flight, MismatchError
from twin.mismatch.hypothesis import Hypothesis
from twin.mismatch.search import search
from twin.mismatch.split import split

AGREEING = 3.0  # standard deviations between numbers that are the same


def contradiction(
    together: Decision, flights: Sequence[Flight], hypotheses: Sequence[Hypothesis], *,
    slow_V: float | None, progress: Callable[[tuple[str, ...]], None],
) -> tuple[Decision, tuple[str, ...]]:  # fmt: skip
    """`together`, or that it is ambiguous, with what each recording says.

    It is if every recording alone is at the noise with one effect at most, and they do not agree,
    in these or what looks like them: then that is all that is unexplained. What all say alike, and
    is not so of all together, is what each is too short to tell apart from something else.
    """
    own = {flight.name: flight for flight in flights}
    if together.verdict is not Verdict.UNKNOWN or len(own) == 1:
        return together, ()
    alone: dict[str, Decision] = {}
    for name, flight in own.items():
        try:
            data = split([flight], (), slow_V=slow_V)
        except MismatchError:
            return together, ()
        data, found = search(
            data, hypotheses, stated=slow_V is not None, progress=progress, most_effects=1
        )
        scale = scale_of(m.fitted for m in found)
        alone[name] = decide(found, scale, stated_V=slow_V or 0.0)
        if alone[name].verdict is Verdict.UNKNOWN:
            return together, ()
    if agree(list(alone.values())):
        return together, ()
    named: dict[str, list[NamedEffect]] = {}
    for decision in alone.values():
        for e in decision.effects:
            named.setdefault(e.id, []).append(e)
    effects = tuple(_of_all(own) for own in named.values())
    remarks = tuple(f"{name} alone: {_words(decision)}" for name, decision in alone.items())
    return replace(together, verdict=Verdict.AMBIGUOUS, effects=effects), remarks


def agree(decisions: Sequence[Decision]) -> bool:
    """Of any two each has effects that may be one of the other's."""
    return all(
        len(a.effects) == len(b.effects)
        and all(any(_may_be_one(e, other) for other in b.effects) for e in a.effects)
        for a, b in combinations(decisions, 2)
    )


def _may_be_one(one: NamedEffect, other: NamedEffect) -> bool:
    """They, or what looks like them, with numbers within AGREEING of their deviations."""
    both = [{e.id: e.parameters, **e.instead} for e in (one, other)]
    return any(_near(both[0][name], both[1][name]) for name in both[0].keys() & both[1].keys())


def _near(one: Sequence[Value], other: Sequence[Value]) -> bool:
    """In all numbers that both tell."""
    own, others = ({v.name: v for v in values} for values in (one, other))
    return all(
        abs(own[name].value - others[name].value)
        < AGREEING * hypot(own[name].std, others[name].std)
        for name in own.keys() & others.keys()
    )


def _of_all(own: Sequence[NamedEffect]) -> NamedEffect:
    """What recordings say of one effect: the mean of each number, which scatters as they do."""
    told: dict[str, list[Value]] = {}
    for v in (v for e in own for v in e.parameters):
        told.setdefault(v.name, []).append(v)
    return replace(own[0], parameters=tuple(_mean(values) for values in told.values()))


def _mean(own: Sequence[Value]) -> Value:
    """Of one number; it is off by its own error and by what they differ."""
    values, stds = ([getattr(v, name) for v in own] for name in ("value", "std"))
    std = hypot(float(np.sqrt(np.mean(np.square(stds)))), float(np.std(values)))
    return replace(own[0], value=float(np.mean(values)), std=std)


def _words(decision: Decision) -> str:
    if not decision.effects:
        return "nothing left out"
    return "; ".join(
        f"{e.id} with {', '.join(f'{v.name} {v.value:.3g} +- {v.std:.1g}' for v in e.parameters)}"
        for e in decision.effects
    )
