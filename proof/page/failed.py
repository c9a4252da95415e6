"""Whatever went wrong, before anything else and in full."""

from proof.outcome import Judged, Proof
from proof.page.baselines import won
from proof.page.causes import cause
from proof.page.told import in_data, where
from proof.page.words import WORST_FIRST, plural, probabilities, times, verdict
from proof.targets import over_floor
from reports.quantity import MISSING, significant
from reports.section import Cell, Column, Notice, Section, Severity, Table

NOT_MADE = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="whose truth", numeric=False),
    Column(title="why", numeric=False),
)
FAILURES = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="outcome", numeric=False, whole=True),
    Column(title="cell: recording", numeric=False, wide=True),
    Column(title="in the data", numeric=False, wide=True),
    Column(title="said", numeric=False, wide=True),
    Column(title="strength"),
    Column(title="why", numeric=False, wide=True),
    Column(title="left over the floor"),
)


def failed(proof: Proof) -> Section:
    """Every trial that is not right, was not made or compared, and baselines that were better."""
    own = [t for o in WORST_FIRST for t in proof.trials if t.outcome is o]
    better = won(proof.trials)
    lead = [_counted(proof, own)]
    if better:
        lead.append(
            f"A baseline predicted what was held out better than what the tool said, in "
            f"{plural(len({trial.name for trial, _ in better}), 'trial')}: see the baselines."
        )
    return Section(
        id="failed",
        title="What failed",
        lead=tuple(lead),
        notices=_not_compared(proof),
        tables=(*_failures(own), *_not_made(proof)),
    )


def _counted(proof: Proof, own: list[Judged]) -> str:
    if not own:
        return f"None of {plural(len(proof.trials), 'verdict')} is other than right."
    counts = [
        f"{sum(t.outcome is o for t in own)} {o.value}"
        for o in WORST_FIRST
        if any(t.outcome is o for t in own)
    ]
    return (
        f"{len(own)} of {plural(len(proof.trials), 'verdict')} are not right: {', '.join(counts)}. "
        "Each is listed."
    )


def _failures(own: list[Judged]) -> tuple[Table, ...]:
    if not own:
        return ()
    caption = (
        "Not right. Left over the floor: the error on what was held out, with the best that the "
        "tool found, over what even the true answer leaves"
    )
    return (Table(caption=caption, columns=FAILURES, rows=tuple(map(_failure, own))),)


def _failure(j: Judged) -> tuple[Cell, ...]:
    """What was there, what was said, why, and what is left."""
    likely = f" ({probabilities(j)})" if j.named else ""
    over = over_floor(j)
    return (
        Cell(text=j.name),
        Cell(text=j.outcome.value, doubt=True),
        where(j),
        Cell(text=in_data(j)),
        Cell(text=f"{verdict(j)}{likely}"),
        Cell(text=times(j.truth.strength)),
        Cell(text=cause(j)),
        Cell(text=MISSING if over is None else f"{significant(over, 2)} ×"),
    )


def _not_compared(proof: Proof) -> tuple[Notice, ...]:
    return tuple(
        Notice(text=f"{t.name}: {t.not_compared}", severity=Severity.DOUBT)
        for t in proof.trials
        if t.not_compared
    )


def _not_made(proof: Proof) -> tuple[Table, ...]:
    if not proof.not_made:
        return ()
    return (
        Table(
            caption=f"{plural(len(proof.not_made), 'trial')} not made or not judged; in no share",
            columns=NOT_MADE,
            rows=tuple(
                (Cell(text=n.name), Cell(text=n.source), Cell(text=n.reason))
                for n in proof.not_made
            ),
        ),
    )
