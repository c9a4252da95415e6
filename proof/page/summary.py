"""How many are right of how many, and the targets beside the figures."""

from collections.abc import Callable

from proof.outcome import Judged, Outcome, Proof
from proof.page.words import between, plural, points
from proof.tally import Share, Tally, by_class, control, kinds_not_run, real_effect, strong, tally
from proof.targets import Status, Target, targets
from reports.mismatch.words import listed
from reports.quantity import MISSING, fixed, significant
from reports.section import Cell, Column, Notice, Row, Section, Severity, Table

CLASSES = (
    Column(title="trials", numeric=False),
    Column(title="run"),
    *(Column(title=o.value) for o in Outcome),
    Column(title="right [%]"),
    Column(title="95 % interval [%]"),
)
TARGETS = (
    Column(title="target", numeric=False),
    Column(title="result", numeric=False),
    Column(title="wanted"),
    Column(title="measured"),
    Column(title="kept by", whole=True),
    Column(title="95 % interval [%]"),
)
SHOWN = {"1": ("%", 100.0, 1), "K": ("K", 1.0, 2), "V": ("mV", 1e3, 1), "": ("", 1.0, 0)}
RATIO = ("×", 1.0, 2)
RATIOS = (
    "held out simulated",
    "held out recorded",
    "held out floor",
)  # times, where other shares are percent


def summary(proof: Proof) -> Section:
    """Shares, then targets."""
    found = targets(proof.trials)
    shares = by_class(proof.trials)
    tables = [Table(caption="Targets", columns=TARGETS, rows=tuple(_target(t) for t in found))]
    if shares:
        rows = tuple(_class(t) for t in shares)
        tables.insert(0, Table(caption="Verdicts beside the truth", columns=CLASSES, rows=rows))
    return Section(
        id="summary",
        title="What came out",
        lead=(headline(proof),),
        notices=_notices(proof, found),
        rows=(
            Row(label="Trials judged", value=str(len(proof.trials))),
            Row(label="Trials not made or not judged", value=str(len(proof.not_made))),
        ),
        tables=tuple(tables),
        notes=(
            "Right: what is there was named, by its own name or one that these recordings cannot "
            "tell from it, and nothing else; or, where that is so, that nothing is there or that "
            "it has no name. Part: not all that is there was named. Wrong: something was named "
            "that is not there. Missed: nothing was named.",
            "Intervals are Wilson's: where the share among further trials may lie. What is "
            "measured of an error is the worst one; “kept by” counts those within the limit. "
            "Held-out errors are of trials in which something was named.",
        ),
    )


def headline(proof: Proof) -> str:
    """One sentence."""
    if not proof.trials:
        return "No trial was judged."
    parts = []
    if (of := _right(proof, strong)).of:
        parts.append(
            f"{of.count} of {of.of} simulated effects at three times the noise or more were "
            "judged right"
        )
    if (of := _right(proof, control)).of:
        alarms = plural(of.of - of.count, "false alarm")
        parts.append(f"{alarms} in {plural(of.of, 'control')}")
    if (of := _right(proof, real_effect)).of:
        parts.append(f"{of.count} of {of.of} right on recordings of real cells")
    if not parts:
        right = sum(t.outcome is Outcome.RIGHT for t in proof.trials)
        parts.append(f"{right} of {plural(len(proof.trials), 'verdict')} right")
    return f"{'; '.join(parts)}."


def _right(proof: Proof, member: Callable[[Judged], bool]) -> Share:
    return tally("", "", filter(member, proof.trials)).right


def _notices(proof: Proof, found: tuple[Target, ...]) -> tuple[Notice, ...]:
    missed = [t.what for t in found if t.status is Status.MISSED]
    waiting = [t.what for t in found if t.status is Status.NOT_RUN]
    absent = kinds_not_run(proof.trials)
    out = []
    if missed:
        text = f"{plural(len(missed), 'target')} of {len(found)} missed: {'; '.join(missed)}."
        out.append(Notice(text=text, severity=Severity.DOUBT))
    if waiting:
        out.append(Notice(text=f"Not run, so nothing is known of: {'; '.join(waiting)}."))
    if absent and proof.trials:
        out.append(Notice(text=f"Kinds without a trial in this run: {listed(absent)}."))
    return tuple(out)


def _class(t: Tally) -> tuple[Cell, ...]:
    counts = tuple(
        Cell(text=str(n), doubt=o is not Outcome.RIGHT and n > 0) for o, n in t.outcomes.items()
    )
    share = Cell(text=points(t.right.value)), Cell(text=between(t.right))
    return (Cell(text=t.what), Cell(text=str(t.right.of)), *counts, *share)


def _target(t: Target) -> tuple[Cell, ...]:
    return (
        Cell(text=t.what),
        Cell(text=result(t), doubt=t.status is Status.MISSED),
        Cell(text=f"{'≥' if t.at_least else '≤'} {shown(t, t.limit, exact=True)}"),
        Cell(text=MISSING if t.measured is None else shown(t, t.measured)),
        Cell(text=f"{t.within} of {t.of}" if t.of else MISSING),
        Cell(text=between(t.kept)),
    )


def result(t: Target) -> str:
    """Met, or by how much not."""
    if t.status is not Status.MISSED:
        return str(t.status.value)
    by = f" by {shown(t, t.short).replace('%', 'points')}" if t.short else ""
    absent = f"{t.absent} without a figure" if t.absent else ""
    more = "; ".join(filter(None, (absent, t.lacking)))
    return f"missed{by}" + f"{'; ' if by else ': '}{more}" * bool(more)


def shown(t: Target, value: float, *, exact: bool = False) -> str:
    """With its unit."""
    unit, factor, decimals = RATIO if t.id in RATIOS else SHOWN[t.unit]
    number = f"{factor * value:g}" if exact else fixed(factor * value, decimals)
    if value and not float(number):  # what is missed by little is still missed
        number = significant(factor * value, 1)
    return f"{number} {unit}".strip()
