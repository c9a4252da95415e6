"""Every trial in a row."""

from collections.abc import Sequence

from proof.outcome import Judged, Outcome, Proof
from proof.page.probabilities import STATED
from proof.page.told import in_data, where
from proof.page.words import WORST_FIRST, plural, probabilities, times, verdict
from proof.tally import simulated
from proof.truth import CONTROLS, KINDS, RECORDED, SIMULATED
from reports.mismatch.summary import mV
from reports.quantity import MISSING
from reports.section import Cell, Column, Section, Table

COLUMNS = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="outcome", numeric=False, whole=True),
    Column(title="in the data", numeric=False, wide=True),
    Column(title="strength"),
    Column(title="said", numeric=False, wide=True),
    Column(title=STATED, numeric=False),
    Column(title="before [mV]"),
    Column(title="after [mV]"),
    Column(title="noise [mV]"),
    Column(title="floor [mV]"),
)
IN_ORDER = sorted(KINDS, key=lambda kind: (kind in RECORDED, kind in CONTROLS))
ORDER = (*WORST_FIRST, Outcome.RIGHT)


def trials(proof: Proof) -> Section | None:
    """A table a kind of trial; None without a trial."""
    kinds = ((kind, [t for t in proof.trials if t.truth.kind == kind]) for kind in IN_ORDER)
    tables = tuple(_table(kind, own) for kind, own in kinds if own)
    if not tables:
        return None
    return Section(
        id="trials",
        title="All trials",
        lead=(
            "What is not right comes first in each table. Strength: by how much what is to be "
            "found changes the voltage of the fitted recordings, over the floor; of age and "
            "transport, how much the twin as given misses. Before and after: the error on "
            "recordings that nothing was fitted to, by the twin as given and with what was named. "
            "Noise: as the tool estimates it there. All are root mean squares.",
            "The floor of a simulated trial is the noise put in, with that of the current as the "
            "twin answers to it. Of a recorded one it is the base twin's error in tests that it "
            "has not seen, or in its own where that is more. Whose recordings they are is said in "
            "the table of cells above.",
        ),
        tables=tables,
    )


def _table(kind: str, own: Sequence[Judged]) -> Table:
    by = "Simulated by PyBaMM" if kind in SIMULATED else "Recorded on real cells"
    right = sum(t.outcome is Outcome.RIGHT for t in own)
    rows = tuple(_row(t) for t in sorted(own, key=lambda t: ORDER.index(t.outcome)))
    text = f"{by}, {kind}: {right} right of {plural(len(own), 'trial')}"
    return Table(caption=text, columns=COLUMNS, rows=rows)


def _row(t: Judged) -> tuple[Cell, ...]:
    of = where(t)
    there = in_data(t) if simulated(t) else f"{of.text}; {in_data(t)}"
    outcome = Cell(text=t.outcome.value, doubt=t.outcome is not Outcome.RIGHT)
    texts = (
        times(t.truth.strength), verdict(t), probabilities(t) or MISSING,
        mV(t.held_out_before_V), mV(t.held_out_after_V), mV(t.noise_V), mV(t.truth.floor_V),
    )  # fmt: skip
    return (
        Cell(text=t.name),
        outcome,
        Cell(text=there, whole=of.whole),
        *(Cell(text=x) for x in texts),
    )
