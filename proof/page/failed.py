"""Whatever went wrong, before anything else and in full."""

from proof.outcome import Judged, Outcome, Proof
from proof.page.baselines import won
from proof.page.words import plural, probabilities, times, verdict, why
from proof.targets import over_floor
from reports.mismatch.summary import mV
from reports.quantity import significant
from reports.section import Cell, Column, Notice, Section, Severity, Table

ORDER = (Outcome.WRONG, Outcome.MISSED, Outcome.PART)  # the worst first
NOT_MADE = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="whose truth", numeric=False),
    Column(title="why", numeric=False),
)


def failed(proof: Proof) -> Section:
    """Every trial that is not right, was not made or compared, and baselines that were better."""
    own = [t for o in ORDER for t in proof.trials if t.outcome is o]
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
        notices=(
            *(Notice(text=told(t), severity=Severity.DOUBT) for t in own),
            *_not_compared(proof),
        ),
        tables=_not_made(proof),
    )


def _counted(proof: Proof, own: list[Judged]) -> str:
    if not own:
        return f"None of {plural(len(proof.trials), 'verdict')} is other than right."
    counts = [
        f"{sum(t.outcome is o for t in own)} {o.value}"
        for o in ORDER
        if any(t.outcome is o for t in own)
    ]
    return (
        f"{len(own)} of {plural(len(proof.trials), 'verdict')} are not right: {', '.join(counts)}. "
        "Each is listed."
    )


def told(j: Judged) -> str:
    """One failure: what was there, what was said, what is left."""
    likely = f" ({probabilities(j)})" if j.named else ""
    left = f"{mV(j.held_out_after_V)} of {mV(j.held_out_before_V)} mV"
    over, ratio = "", over_floor(j)
    if ratio is not None:
        over = f", {significant(ratio, 2)} × the floor of {mV(j.truth.ahead_V)} mV"
    return (
        f"{j.name}: {j.outcome.value}. In the data ({j.truth.kind}, {j.source}, "
        f"{times(j.truth.strength)} floor): {j.truth.said}. Said: {verdict(j)}{likely}. "
        f"Why: {why(j)}. Left on what was held out: {left}{over}."
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
