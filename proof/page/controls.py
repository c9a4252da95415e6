"""What was said of trials in which there is nothing to be found."""

from collections.abc import Sequence

from proof.judge import NO_VERDICT
from proof.outcome import Judged, Outcome, Proof
from proof.tally import control, recorded, simulated
from reports.section import Cell, Column, Table

SAID = (
    (("none",), "said nothing"),
    (("unknown",), "said “something it has no name for”"),
    (("ambiguous",), "not settled"),
    (("named",), "named something"),
    (NO_VERDICT, "no verdict"),
)
COLUMNS = (
    Column(title="controls", numeric=False, whole=True),
    Column(title="run"),
    *(Column(title=title) for _, title in SAID),
    Column(title="false alarms"),
)
RULE = (
    "What was said of controls. Of a simulated one all but nothing is a false alarm. A recorded "
    "one may be said to be missed by the twin, since no twin is quite its cell; a name may not be "
    "given"
)


def controls(proof: Proof) -> tuple[Table, ...]:
    """Simulated and recorded apart; none without a control."""
    groups = (("simulated", simulated), ("recorded", recorded))
    made = ((what, [t for t in proof.trials if control(t) and of(t)]) for what, of in groups)
    rows = tuple(_row(what, own) for what, own in made if own)
    return (Table(caption=RULE, columns=COLUMNS, rows=rows),) if rows else ()


def _row(what: str, own: Sequence[Judged]) -> tuple[Cell, ...]:
    false = sum(t.outcome is not Outcome.RIGHT for t in own)
    said = (sum(t.verdict in those for t in own) for those, _ in SAID)
    return (
        Cell(text=what),
        *(Cell(text=str(n)) for n in (len(own), *said)),
        Cell(text=str(false), doubt=false > 0),
    )
