"""Stated probabilities beside how often they were right."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from proof.outcome import Judged, Named, Proof
from proof.page.words import between, not_there, points
from proof.tally import Share, recorded, simulated
from reports.section import Cell, Column, Section, Table

STATED = "probability (name or look-alikes)"
BINS = ((0.99, "> 99 %"), (0.95, "95 to 99 %"), (0.80, "80 to 95 %"), (-1.0, "< 80 %"))
"""More than, and in words."""
COLUMNS = (
    Column(title="trials", numeric=False, whole=True),
    Column(title=f"stated {STATED}", numeric=False, whole=True),
    Column(title="names"),
    Column(title="right: name or look-alikes"),
    Column(title="[%]"),
    Column(title="95 % interval [%]"),
    Column(title="right: first name alone"),
    Column(title="[%]"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scored:
    """A name that was given.

    Attributes:
        probability: as stated.
        right: it, or what is said to look like it, is there.
        first: it is there itself.
    """

    probability: float
    right: bool
    first: bool


def probabilities(proof: Proof) -> Section | None:
    """A table by group and probability; None if nothing was named."""
    groups = (("simulated", simulated), ("recorded", recorded))
    rows = tuple(
        row
        for what, member in groups
        for row in _rows(what, [s for t in proof.trials if member(t) for s in scored(t)])
    )
    if not rows:
        return None
    return Section(
        id="probabilities",
        title="Stated probabilities",
        lead=(
            "With each name the tool states a probability. It is that of the name or of what it "
            "says looks alike in these recordings. If it is honest, of names with more than 99 % "
            "hardly one is wrong. The last two columns ask more than was promised: that the first "
            "name itself is there.",
        ),
        tables=(Table(caption="Names by their probability", columns=COLUMNS, rows=rows),),
    )


def scored(t: Judged) -> Iterator[Scored]:
    """Every name of a verdict."""
    alone = replace(t, named=tuple(replace(n, equivalent=()) for n in t.named))
    for n, own in zip(t.named, alone.named, strict=True):
        yield Scored(probability=n.probability, right=_there(t, n), first=_there(alone, own))


def _there(t: Judged, n: Named) -> bool:
    return not any(n is other for other in not_there(t))


def _rows(what: str, own: Sequence[Scored]) -> Iterator[tuple[Cell, ...]]:
    most = 2.0
    for least, words in BINS:
        those = [s for s in own if least < s.probability <= most]
        most = least
        if those:
            right, first = (
                Share(count=sum(told), of=len(those))
                for told in ([s.right for s in those], [s.first for s in those])
            )
            yield (
                Cell(text=what), Cell(text=words), Cell(text=str(right.of)),
                Cell(text=str(right.count), doubt=right.count < right.of),
                Cell(text=points(right.value)), Cell(text=between(right)),
                Cell(text=str(first.count)), Cell(text=points(first.value)),
            )  # fmt: skip
