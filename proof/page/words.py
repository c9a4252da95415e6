"""Verdicts and truths in words."""

from collections.abc import Sequence

from proof.compare import hit, met
from proof.outcome import Judged, Named, Outcome
from proof.tally import Share, control
from reports.mismatch.words import listed, name, percent
from reports.quantity import fixed, significant

ABSTAINED = {
    "none": "nothing left out",
    "unknown": "something it has no name for",
    "ambiguous": "not settled",
    "failed": "no verdict, the tool failed",
    "stopped": "no verdict, stopped from outside",
}

WORST_FIRST = (Outcome.WRONG, Outcome.MISSED, Outcome.PART)  # of what is not right
FEW = 2  # names that are right for one effect, in a sentence
LONGEST = 40  # letters of a name in a drawing
FATE = {
    "none": "taken for noise",
    "unknown": "seen, but not named",
    "ambiguous": "not told from something else",
}


def plural(count: int, one: str) -> str:
    """`1 trial`, `2 trials`."""
    return f"{count} {one if count == 1 else one + 's'}"


def short(text: str, longest: int = LONGEST) -> str:
    """With both its ends, if it is too long."""
    if len(text) <= longest:
        return text
    half = (longest - 1) // 2
    return f"{text[:half]}…{text[-half:]}"


def times(strength: float) -> str:
    """Of the floor."""
    return f"{significant(strength, 2)} ×"


def points(share: float | None) -> str:
    """A share in percent, without its sign."""
    return fixed(None if share is None else 100 * share, 0)


def between(share: Share) -> str:
    """Its 95 % interval in percent."""
    low, high = share.interval
    return f"{fixed(100 * low, 0)}–{fixed(100 * high, 0)}" if share.of else fixed(None, 0)


def _one(n: Named) -> str:
    alike = listed([name(i) for i in n.equivalent], "or")
    return f"{name(n.id)} (or {alike})" if alike else name(n.id)


def verdict(j: Judged) -> str:
    """What the tool said."""
    effects = listed([_one(n) for n in j.named])
    if j.verdict == "named":
        return effects or "named nothing"
    said = ABSTAINED.get(j.verdict, j.verdict)
    return f"{said}: {effects}" if j.verdict == "ambiguous" and effects else said


def probabilities(j: Judged) -> str:
    """Of what was named, in its order."""
    return ", ".join(percent(n.probability).replace(" ", "\N{NO-BREAK SPACE}") for n in j.named)


def not_there(j: Judged) -> tuple[Named, ...]:
    """Named, though no truth has it and it does not come with one either."""
    found = met(j.truth.effects, j.named).values()
    return tuple(n for p, n in enumerate(j.named) if p not in found and not hit(n, j.truth.also))


def not_named(j: Judged) -> tuple[tuple[str, ...], ...]:
    """In the truth, though nothing that was named is it."""
    found = met(j.truth.effects, j.named)
    return tuple(alike for s, alike in enumerate(j.truth.effects) if s not in found)


def why(j: Judged) -> str:
    """What is wrong with a verdict; "" of a right one."""
    if j.outcome is Outcome.RIGHT:
        return ""
    lost = listed([_wanted(alike) for alike in not_named(j)])
    if j.verdict != "named":
        return _abstained(j, lost)
    extra = listed([name(n.id) for n in not_there(j)])
    if extra and lost:
        return f"{extra} named instead of {lost}"
    if extra:
        return f"{extra} named, which is not there"
    if lost:
        return f"{lost} not named"
    return f"right would be: {listed([ABSTAINED.get(v, v) for v in j.truth.verdicts], 'or')}"


def _abstained(j: Judged, lost: str) -> str:
    if j.verdict == "failed":
        return "the tool failed"
    if j.verdict == "stopped":
        return f"stopped from outside after {fixed(j.seconds, 0)} s"
    if control(j):
        return "there is nothing, and something was said to be there"
    return f"{lost or 'what is there'} {FATE.get(j.verdict, 'not named')}"


def _wanted(alike: Sequence[str]) -> str:
    """Of many that are right the first stands for all."""
    if len(alike) > FEW:
        return f"{name(alike[0])} or the like"
    return " or ".join(name(i) for i in alike)
