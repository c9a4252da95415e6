"""What is in a trial's data, in words: effects by name with their numbers, cell and recording."""

import re
from collections.abc import Mapping
from math import exp

from proof.outcome import Judged
from proof.tally import recorded
from proof.truth import Number
from reports.mismatch.words import listed, name, number, unit
from reports.quantity import significant
from reports.section import Cell

PUT_IN = re.compile(r"(?:foreign:)?(\w+): (-?[\d.]+(?:e[-+]?\d+)?) \(([^)]*)\)")
"""How `proof.simulated` says an effect in `Truth.said`: id, size and what the size means."""
LOGARITHM = "-ln of the factor"


def in_data(t: Judged) -> str:
    """Effects with number and unit; else what the truth says, without what the row has beside."""
    known = _numbers(t)
    if recorded(t) and known:
        return listed(list(known.values()))
    said = t.truth.said.removesuffix(f" ({t.source})")
    return PUT_IN.sub(lambda m: known.get(m[1]) or _sized(*m.groups()), said)


def where(t: Judged) -> Cell:
    """The cell, and which of its recordings; the whole source, with owner, when pointed at."""
    kept = (t.truth.details or {}).items()
    which = [str(value) for key, value in kept if re.fullmatch(r"recording \d+", key)]
    cell = re.split(r", | \(", t.source)[0]
    return Cell(text=": ".join(filter(None, (cell, listed(which)))), whole=t.source)


def _numbers(t: Judged) -> Mapping[str, str]:
    """Effect -> its name with all numbers of it that are known."""
    own: dict[str, list[Number]] = {}
    for n in t.truth.numbers:
        own.setdefault(n.effect, []).append(n)
    return {e: f"{name(e)}: {', '.join(_number(n) for n in those)}" for e, those in own.items()}


def _number(n: Number) -> str:
    """Its own name only where that of the effect does not hold it."""
    shown, factor = unit(n.unit)
    what = number(n.name)
    said = "" if set(what.split()) <= set(name(n.effect).split()) else what
    size = "\N{NO-BREAK SPACE}".join(filter(None, (f"{factor * n.value:.4g}", shown)))
    return " ".join(filter(None, (said, size)))


def _sized(effect: str, size: str, meaning: str) -> str:
    if meaning == LOGARITHM:
        return f"{name(effect)}: {significant(exp(-float(size)), 3)} times as much"
    return f"{name(effect)}: {size} " + (f"({meaning})" if "," in meaning else meaning)
