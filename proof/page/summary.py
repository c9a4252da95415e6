"""How many are right of how many, and the targets beside the figures."""

from collections.abc import Callable

from proof.outcome import Judged, Outcome, Proof
from proof.page.controls import controls
from proof.page.words import between, plural, points
from proof.tally import (
    Share,
    Tally,
    by_class,
    by_source,
    control,
    kinds_not_run,
    real_effect,
    recorded,
    simulated,
    strong,
    tally,
)
from proof.targets import Status, Target, targets
from reports.mismatch.words import listed, sentence
from reports.quantity import MISSING, fixed, significant
from reports.section import Cell, Column, Notice, Row, Section, Severity, Table

VERDICTS = (
    Column(title="run"),
    *(Column(title=o.value) for o in Outcome),
    Column(title="right [%]"),
    Column(title="95 % interval [%]"),
)
CLASSES = (Column(title="trials", numeric=False), *VERDICTS)
SOURCES = (Column(title="cell or pack, owner", numeric=False, wide=True), *VERDICTS)
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
RATIOS = ("held out simulated", "held out floor")  # times, where other shares are percent
TRIAL = (
    "In each trial the data hold an effect that the twin, the tool's model of the battery, lacks: "
    "a simulation or a known fault put it in, or it is there in a recording of a real cell. The "
    "tool is given current and voltage, and says what is missing. Only then is the truth, which "
    "was sealed before, opened and compared."
)
WORDS = (
    "Right: the tool named what is there, or what these recordings cannot tell from it, and "
    "nothing else. Where nothing is there, or nothing that it has a name for, right is to say so. "
    "Part: not all that is there was named. Wrong: something was named that is not there. Missed: "
    "something is there, and nothing was named.",
    "Floor: the error that even the true answer leaves. It is noise and, for a real cell, what its "
    "twin errs by itself. Control: a trial in which there is nothing to be found.",
)
LIMITS = (
    (recorded, "Recorded: the list of recordings is fixed and was seen while the tool was "
     "developed, so it is no blind sample; docs/proof.md says which of them were blind when they "
     "were first run."),
    (simulated, "Simulated: the truth has the twin's own equations but for the effect, and noise "
     "that is white, so it is easier than a real cell."),
)  # fmt: skip
"""Of the trials that there are."""


def summary(proof: Proof) -> Section:
    """What a trial is, shares, then targets."""
    found = targets(proof.trials)
    run = [t for t in found if t.status is not Status.NOT_RUN]
    tables = (
        *_shares("Verdicts beside the truth", CLASSES, by_class(proof.trials)),
        *((Table(caption="Targets", columns=TARGETS, rows=tuple(map(_target, run))),) * bool(run)),
        *controls(proof),
        *_shares("Recorded verdicts by cell, controls not counted", SOURCES,
                 by_source(proof.trials)),
    )  # fmt: skip
    return Section(
        id="summary",
        title="What came out",
        lead=(
            TRIAL,
            headline(proof),
            *(said for member, said in LIMITS if any(map(member, proof.trials))),
            *WORDS,
        ),
        notices=_notices(proof, found),
        rows=(
            Row(label="Trials judged", value=str(len(proof.trials))),
            Row(label="Trials not made or not judged", value=str(len(proof.not_made))),
        ),
        tables=tables,
        notes=(
            "Intervals are Wilson's: where the share might lie if trials were independent and "
            "drawn anew. What is measured of an error is the worst one; “kept by” counts those "
            "within the limit. Held-out errors are of trials in which something was named.",
        ),
    )


def _shares(caption: str, columns: tuple[Column, ...], of: tuple[Tally, ...]) -> tuple[Table, ...]:
    return (Table(caption=caption, columns=columns, rows=tuple(map(_class, of))),) if of else ()


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
    missed = sum(t.status is Status.MISSED for t in found)
    waiting = sum(t.status is Status.NOT_RUN for t in found)
    absent = kinds_not_run(proof.trials)
    out = []
    if missed:
        text = f"{plural(missed, 'target')} of {len(found) - waiting} missed, see below."
        out.append(Notice(text=text, severity=Severity.DOUBT))
    left_out = (
        f"kinds without a trial in this run: {listed(absent)}" * bool(absent),
        f"{plural(waiting, 'target')} that no trial tells of left out" * bool(waiting),
    )
    if proof.trials and any(left_out):
        out.append(Notice(text=sentence("; ".join(filter(None, left_out)))))
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
