"""What else might have mended the voltage, judged on the same recordings."""

from collections.abc import Iterable, Sequence
from math import inf, isfinite

import numpy as np

from proof.baselines import BASE
from proof.outcome import Baseline, Judged, Outcome, Proof
from proof.page.spread import Method, spread
from proof.page.words import plural
from proof.tally import recorded
from reports.mismatch.summary import mV
from reports.quantity import MISSING, fixed, significant
from reports.section import Cell, Column, Figure, Section, Table

OURS = "what the tool said"
MOST_LISTED = 12  # of the cases in which a baseline won; the others are folded
WORDS = {
    "refit": "base twin refitted",
    "correction": "correction without physics",
    "random": "effects drawn by chance",
}
HOW = {
    "refit": "all numbers of the base twin at once, without new physics",
    "correction": "a sparse regression of the residual on quantities of load and twin",
    "random": "as many other effects as were named, with about as many numbers",
}
CLOSE, CLOSE_SAID = 0.05, "5 %"  # of the other error: neither is the better one
AGAINST = (
    Column(title="baseline", numeric=False),
    Column(title="trials"),
    Column(title=f"worse by more than {CLOSE_SAID}"),
    Column(title=f"within {CLOSE_SAID}"),
    Column(title=f"better by more than {CLOSE_SAID}"),
    Column(title="its error over ours, median"),
)
WON = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="baseline", numeric=False),
    Column(title="numbers fitted"),
    Column(title="better by [%]"),
    Column(title="its error [mV]"),
    Column(title="with what the tool said [mV]"),
    Column(title="floor [mV]"),
    Column(title="it holds the truth", numeric=False),
    Column(title="the verdict was", numeric=False),
)
Win = tuple[Judged, Baseline]


def baselines(proof: Proof) -> Section | None:
    """A drawing, who won where, and all errors; None if nothing was compared."""
    own = [t for t in proof.trials if t.baselines]
    if not own:
        return None
    ids = present(own)
    better = won(own)
    return Section(
        id="baselines",
        title="What else would have mended it",
        lead=(
            "A smaller error alone shows no understanding. On the same recordings, fitted on the "
            "same part and judged on the same held-out part: "
            + "; ".join(f"{WORDS.get(i, i)} ({_what(own, i)})" for i in ids)
            + ". Only trials in which something was named have baselines.",
            "Where what was left out is one of the base twin's own numbers, the refit holds the "
            "truth too, among others: it can be as good.",
            *_not_favoured(own),
        ),
        figures=(_figure(own),),
        tables=(_against(own, ids), *_won_table(better), _table(own, ids)),
        notes=("The tick of a row is its median.",),
    )


def present(own: Iterable[Judged]) -> list[str]:
    """Ids of baselines, the known ones first."""
    ids = {b.id for t in own for b in t.baselines}
    return [i for i in WORDS if i in ids] + sorted(ids - set(WORDS))


def won(trials: Iterable[Judged]) -> tuple[Win, ...]:
    """Baselines whose held-out error is the smaller one, by however little; the clearest first."""
    every = ((t, b) for t in trials for b in t.baselines)
    own = [(t, b) for t, b in every if b.held_out_V < t.held_out_after_V]
    return tuple(sorted(own, key=lambda win: win[1].held_out_V / win[0].held_out_after_V))


def holds_truth(t: Judged, b: Baseline) -> bool:
    """All that is there is among the numbers that a refit of the base twin has."""
    slots = t.truth.effects
    return b.id == "refit" and bool(slots) and all(set(alike) & set(BASE) for alike in slots)


def methods(own: Sequence[Judged]) -> tuple[Method, ...]:
    """The tool and each baseline, as they are drawn: errors over the floor."""
    out = [Method(name=OURS, ours=True, points=_points((t, t.held_out_after_V) for t in own))]
    for i in present(own):
        errors = ((t, b.held_out_V) for t in own for b in t.baselines if b.id == i)
        out.append(Method(name=WORDS.get(i, i), ours=False, points=_points(errors)))
    return tuple(out)


def _points(errors: Iterable[tuple[Judged, float]]) -> tuple[tuple[float, Judged], ...]:
    """Errors over the floor that can be drawn on a logarithmic scale."""
    return tuple(
        (error_V / t.truth.ahead_V, t)
        for t, error_V in errors
        if t.truth.ahead_V > 0 and isfinite(error_V) and error_V > 0
    )


def _what(own: Sequence[Judged], of: str) -> str:
    """How it is described, and how many numbers it fits."""
    those = [b for t in own for b in t.baselines if b.id == of]
    least, most = min(b.numbers for b in those), max(b.numbers for b in those)
    numbers = plural(most, "number") if least == most else f"{least} to {most} numbers"
    return f"{HOW.get(of, those[0].what)}; {numbers}"


def _not_favoured(own: Sequence[Judged]) -> tuple[str, ...]:
    """In how many trials a refit is as good, in words."""
    refitted = [(t, b) for t in own for b in t.baselines if b.id == "refit"]
    if not refitted:
        return ()
    as_good = [(t, b) for t, b in refitted if _over(t, b) <= 1.0 + CLOSE]
    real = sum(recorded(t) for t, _ in as_good)
    holding = sum(holds_truth(t, b) for t, b in as_good)
    return (
        f"In {len(as_good)} of {plural(len(refitted), 'trial')} the held-out error does not "
        f"favour what was named over a refit: the refit is within {CLOSE_SAID} or better "
        f"({real} recorded, {len(as_good) - real} simulated). In {holding} of these it holds the "
        "truth.",
    )


def _over(t: Judged, b: Baseline) -> float:
    """Its error over that of what was named; infinite where it has none."""
    over = b.held_out_V / t.held_out_after_V if t.held_out_after_V else inf
    return over if isfinite(over) else inf


def _against(own: Sequence[Judged], ids: Sequence[str]) -> Table:
    """How often each was worse, as good and better."""
    return Table(
        caption="Baselines beside what the tool said, by the error on what was held out",
        columns=AGAINST,
        rows=tuple(
            _compared(i, [_over(t, b) for t in own for b in t.baselines if b.id == i]) for i in ids
        ),
    )


def _compared(of: str, over: Sequence[float]) -> tuple[Cell, ...]:
    worse, better = sum(x > 1.0 + CLOSE for x in over), sum(x < 1.0 - CLOSE for x in over)
    return (
        Cell(text=WORDS.get(of, of)),
        *(Cell(text=str(n)) for n in (len(over), worse, len(over) - worse - better)),
        Cell(text=str(better), doubt=better > 0),
        Cell(text=f"{significant(float(np.median(over)), 2)} ×"),
    )


def _figure(own: Sequence[Judged]) -> Figure:
    drawn = methods(own)
    medians = [
        f"{m.name} {significant(float(np.median([x for x, _ in m.points])), 2)} ×"
        for m in drawn
        if m.points
    ]
    return Figure(
        caption="Error on what was held out over the floor: the noise put in or, of recorded "
        f"trials, noise and the base twin's own error. Medians: {'; '.join(medians)}.",
        description=f"Held-out errors over the floor, a row a method. "
        f"Medians: {'; '.join(medians)}.",
        svg=spread(drawn, "baselines"),
    )


def _won_table(better: tuple[Win, ...]) -> tuple[Table, ...]:
    if not better:
        return ()
    rows = tuple(
        (
            Cell(text=t.name), Cell(text=f"{WORDS.get(b.id, b.id)}: {b.what}"),
            Cell(text=str(b.numbers)),
            Cell(text=fixed(100 * (1 - b.held_out_V / t.held_out_after_V), 1)),
            Cell(text=mV(b.held_out_V)),
            Cell(text=mV(t.held_out_after_V)), Cell(text=mV(t.truth.ahead_V)),
            Cell(text="yes" if holds_truth(t, b) else "no"),
            Cell(text=t.outcome.value, doubt=t.outcome is not Outcome.RIGHT),
        )
        for t, b in better
    )  # fmt: skip
    first = Table(caption="Where a baseline won", columns=WON, rows=rows[:MOST_LISTED])
    if not (rest := rows[MOST_LISTED:]):
        return (first,)
    more = f"Where a baseline won by less: {plural(len(rest), 'more case')}"
    return first, Table(caption=more, columns=WON, rows=rest, folded=True)


def _table(own: Sequence[Judged], ids: Sequence[str]) -> Table:
    columns = (
        Column(title="trial", numeric=False, whole=True),
        Column(title="outcome", numeric=False),
        *(Column(title=f"{title} [mV]") for title in (OURS, *(WORDS.get(i, i) for i in ids))),
        Column(title="floor [mV]"),
    )
    return Table(
        caption="Error of each on what was held out, rms",
        columns=columns,
        rows=tuple(_row(t, ids) for t in own),
        folded=True,
    )


def _row(t: Judged, ids: Sequence[str]) -> tuple[Cell, ...]:
    errors = {b.id: b.held_out_V for b in t.baselines}
    cells = (
        Cell(text=mV(errors[i]), doubt=errors[i] < t.held_out_after_V)
        if i in errors
        else Cell(text=MISSING)
        for i in ids
    )
    return (
        Cell(text=t.name),
        Cell(text=t.outcome.value, doubt=t.outcome is not Outcome.RIGHT),
        Cell(text=mV(t.held_out_after_V)),
        *cells,
        Cell(text=mV(t.truth.ahead_V)),
    )
