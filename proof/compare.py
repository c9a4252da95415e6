"""A verdict beside the truth, after it was opened."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, permutations
from typing import Any

import numpy as np

from proof.judge import NO_VERDICT
from proof.outcome import Named, Opened, Outcome, Sized
from proof.question import Question
from proof.truth import CONTROLS, Channel, Truth
from twin.mismatch import HYPOTHESES, Hidden, HiddenTable, MismatchError, reveal
from twin.pack import Pack

MOST_EQUIVALENT = 3  # an effect that looks like more than so many others is not named by them


def named_in(verdict: Mapping[str, Any]) -> tuple[Named, ...]:
    """Effects of a verdict that names some."""
    if verdict["verdict"] != "named":
        return ()
    return tuple(
        Named(id=e["id"], probability=e["probability"], equivalent=tuple(e["equivalent"]))
        for e in verdict["effects"]
    )


def outcome(truth: Truth, said: str, named: Sequence[Named]) -> Outcome:
    """Right or not; what looks alike by the recordings counts as what it was named for."""
    if said in NO_VERDICT:
        return Outcome.MISSED
    if said != "named":
        if said in truth.verdicts:
            return Outcome.RIGHT
        return Outcome.MISSED if truth.kind not in CONTROLS else Outcome.WRONG
    if "named" not in truth.verdicts:
        return Outcome.WRONG
    found = met(truth.effects, named)
    rest = [n for place, n in enumerate(named) if place not in found.values()]
    if not all(hit(n, truth.also) for n in rest):
        return Outcome.WRONG
    return Outcome.RIGHT if len(found) == len(truth.effects) else Outcome.PART


def hit(named: Named, alike: Sequence[str]) -> bool:
    """What was named, or one of the few that look the same, is among those that are right."""
    return bool({named.id, *named.equivalent[:MOST_EQUIVALENT]} & set(alike))


def met(effects: Sequence[Sequence[str]], named: Sequence[Named]) -> Mapping[int, int]:
    """Place of an effect of the truth -> place of what was named for it; each counts once."""
    slots, places = range(len(effects)), range(len(named))
    most = min(len(slots), len(places))
    tried = (
        {s: p for s, p in zip(some, order, strict=True) if hit(named[p], effects[s])}
        for some in permutations(slots, most)
        for order in combinations(places, most)
    )
    return max(tried, key=len, default={})


NAMES = {
    Hidden.TEMPERATURE: "temperature",
    Hidden.WEAKEST_CELL: "weakest cell",
    Hidden.OTHER_CELLS: "other cells",
}


def adopted(
    pack: Pack, verdict: Mapping[str, Any], about: Collection[str] = frozenset()
) -> Pack | None:
    """The twin with what was named; None if nothing was.

    Of effects that look alike, the first that is `about` what is asked for; else what was named.
    """
    if verdict["verdict"] != "named":
        return None
    known = {h.id: h for h in HYPOTHESES}
    for effect in verdict["effects"]:
        alike = _alike(effect)
        chosen = next((i for i in alike if i in about), effect["id"])
        numbers = {p["name"]: p["value"] for p in alike[chosen]}
        own = replace(known[chosen], fitted=tuple(numbers))
        pack = own.within(pack, list(numbers.values()))
    return pack


def _alike(effect: Mapping[str, Any]) -> Mapping[str, Any]:
    """An effect of a verdict and those that look like it -> their numbers."""
    return {effect["id"]: effect["parameters"], **effect["instead"]}


def sized(truth: Truth, verdict: Mapping[str, Any]) -> tuple[Sized, ...]:
    """Numbers whose true value is known, beside those of what was named or looks like it."""
    effects = verdict["effects"] if verdict["verdict"] == "named" else []
    found = {(i, p["name"]): p for e in effects for i, own in _alike(e).items() for p in own}
    return tuple(
        Sized(
            effect=n.effect,
            name=n.name,
            unit=n.unit,
            true=n.value,
            found=own["value"] if own else None,
            std=own["std"] if own else None,
        )
        for n in truth.numbers
        for own in (found.get((n.effect, n.name)),)
    )


def opened(question: Question, truth: Truth, verdict: Mapping[str, Any]) -> tuple[Opened, ...]:
    """What was concealed, beside the twin as given and the one with what was named.

    Each channel is predicted by what was named, and by the first of effects that look alike that is
    about it.
    """
    named = adopted(question.pack, verdict)
    return tuple(
        o
        for channel in truth.channels
        for one, about in _each(channel)
        for o in _opened(question, one, adopted(question.pack, verdict, about), named)
    )


def _each(channel: Channel) -> Iterator[tuple[Channel, Collection[str]]]:
    """Temperature and cells apart, with the effects that are about them."""
    if channel.temperature_K is not None:
        yield replace(channel, cell_voltage_V=None), ("self_heating", "cold_pack")
    if channel.cell_voltage_V is not None:
        yield replace(channel, temperature_K=None), ("weak_cell",)


def _opened(
    question: Question, channel: Channel, better: Pack | None, named: Pack | None
) -> Iterator[Opened]:
    recordings = {r.name: r for r in (*question.fitted, *question.held_out)}
    cells = channel.cell_voltage_V
    table = HiddenTable(
        name=channel.recording,
        time_s=channel.time_s,
        temperature_K=channel.temperature_K,
        cell_voltage_V=np.zeros((0, channel.time_s.size)) if cells is None else cells.T,
    )
    load = question.load(recordings[channel.recording])
    try:
        found, plain = (
            reveal(table, flight=channel.recording, load=load, configured=question.pack, adopted=p)
            for p in (better, named)
        )
    except MismatchError:  # no simulation reaches it
        return
    for r, own in zip(found, plain, strict=True):
        yield Opened(
            recording=channel.recording,
            channel=NAMES[r.channel],
            unit="K" if r.unit == "K" else "V",
            time_s=r.time_s,
            measured=r.measured,
            before=r.before,
            after=r.after,
            rms_before=r.rms(r.before),
            rms_after=None if r.after is None else r.rms(r.after),
            rms_named=None if own.after is None else own.rms(own.after),
        )
