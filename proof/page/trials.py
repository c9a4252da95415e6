"""Every trial in a row."""

from collections.abc import Sequence

from proof.outcome import Judged, Outcome, Proof
from proof.page.words import plural, probabilities, times, verdict
from proof.tally import control, recorded, simulated
from reports.mismatch.summary import mV
from reports.quantity import MISSING
from reports.section import Cell, Column, Section, Table

COLUMNS = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="outcome", numeric=False, whole=True),
    Column(title="kind", numeric=False, whole=True),
    Column(title="in the data", numeric=False),
    Column(title="strength"),
    Column(title="said", numeric=False),
    Column(title="probability"),
    Column(title="before [mV]"),
    Column(title="after [mV]"),
    Column(title="noise [mV]"),
    Column(title="floor [mV]"),
)


def trials(proof: Proof) -> Section | None:
    """Tables by where the truth comes from; None without a trial."""
    groups = (
        ("Simulated by PyBaMM, something in it", [t for t in proof.trials if _effect(t)]),
        ("Simulated by PyBaMM, nothing in it", [t for t in proof.trials if _nothing(t)]),
        ("Recorded on real cells", [t for t in proof.trials if recorded(t)]),
    )
    tables = tuple(_table(caption, own) for caption, own in groups if own)
    if not tables:
        return None
    return Section(
        id="trials",
        title="All trials",
        lead=(
            "Floor: of a simulated trial the noise put in, that of the current as the twin "
            "answers to it; of a recorded one the base twin's error in tests that it has not "
            "seen, or in its own where that is more. Strength: by how much what is to be found "
            "changes the voltage of the fitted recordings, root mean square, over the floor; of "
            "age and transport how much the twin as configured misses. Before and after: "
            "recorded minus simulated, root mean square, on recordings that nothing was fitted "
            "to, by the twin as configured and with what was named. Noise: as the tool "
            "estimates it there.",
        ),
        tables=tables,
    )


def _effect(t: Judged) -> bool:
    return simulated(t) and not control(t)


def _nothing(t: Judged) -> bool:
    return simulated(t) and control(t)


def _table(caption: str, own: Sequence[Judged]) -> Table:
    right = sum(t.outcome is Outcome.RIGHT for t in own)
    text = f"{caption}: {right} right of {plural(len(own), 'trial')}"
    return Table(caption=text, columns=COLUMNS, rows=tuple(_row(t) for t in own))


def _row(t: Judged) -> tuple[Cell, ...]:
    there = t.truth.said if simulated(t) else f"{t.source}: {t.truth.said}"
    outcome = Cell(text=t.outcome.value, doubt=t.outcome is not Outcome.RIGHT)
    texts = (
        t.truth.kind, there, times(t.truth.strength), verdict(t),
        probabilities(t) or MISSING, mV(t.held_out_before_V), mV(t.held_out_after_V),
        mV(t.noise_V), mV(t.truth.floor_V),
    )  # fmt: skip
    return (Cell(text=t.name), outcome, *(Cell(text=x) for x in texts))
