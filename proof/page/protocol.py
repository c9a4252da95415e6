"""In which order truths were sealed, judged and opened: hashes, times, how to check them."""

from datetime import datetime

from proof.judge import STOPPED
from proof.outcome import Judged, Proof, Stamp
from proof.page.words import plural
from proof.tally import recorded, simulated
from reports.quantity import fixed
from reports.section import Cell, Column, Notice, Row, Section, Severity, Table

SHORT = 10  # digits of a hash that are printed
COLUMNS = (
    Column(title="trial", numeric=False, whole=True),
    *(
        Column(title=title, numeric=False, whole=True)
        for step in ("truth sealed", "verdict written", "truth opened")
        for title in (f"{step} (UTC)", "SHA-256")
    ),
    Column(title="verdict took [s]"),
)
LEAD = (
    "Each truth is made and sealed in a file before any trial is judged, and the hash of that file "
    "is entered in a ledger. The judge is the ordinary command, twin explain, in a process of its "
    "own. It gets a folder with what a user would have, a twin and recordings, under names that "
    "say nothing; it has neither the truth nor its key. When its verdict is written, the "
    "verdict's hash is entered too. Then the truth is opened, with its key, and compared: "
    "baselines, concealed channels and capacities are entered as well, before the hash that is "
    "shown here.",
    "Simulated truths are PyBaMM's Doyle-Fuller-Newman model on fine meshes. Against meshes twice "
    "as fine in every direction and a hundredth of the tolerance, the voltage of four cells in "
    "series is 0.1 to 0.7 mV rms off, by cell and effect (tests/mismatch_cases/mesh_error.py). At "
    "1C it is 0.01 mV from the twin with the LiPo and 0.08 with the LG M50, on three times the "
    "points 0.05 (benchmarks/truth_mesh.py). Flights are gusty or calm, logged at 10, 5 or 2 Hz, "
    "with 4 to 12 mV of noise in the voltage and 0.08 A, in a third of them 0.2 to 0.8 A, in the "
    "current. About one log in five begins in flight, with the charge that is left then. Of about "
    "one in six no file says how full the pack is: it is full or nearly, and the voltage at rest "
    "before take-off tells it. The floor is the noise with what the recorded current makes of the "
    "twin, beside the one that flowed.",
    "Every entry of the ledger holds the hash of the one before it, so none can be changed or "
    "left out later without the last hash becoming another. The first has seed, command, code and "
    "whose each trial is; every verdict has the hash of the code that gave it, which has to be "
    "that of the beginning.",
    "To check a run, twin prove --check follows the ledger from entry to entry, computes the hash "
    "of every file anew and opens every sealed truth again with its key: it has to be the one "
    "that is shown. From truths, verdicts and comparisons it makes proof.json again, which has to "
    "be the same; of this page it looks at the hash alone.",
    "All that shows no more than that the files agree with each other and with the order. Whoever "
    "writes all of them, verdicts first and truths to fit, can make them agree. That the verdicts "
    "came first is shown only by a hash that was published before, or by running it yourself, with "
    "a seed of your own, or with --again: it judges trials drawn by chance again, and makes "
    "simulated ones again from the seed. That no other run was thrown away, nothing here shows.",
)


def protocol(proof: Proof) -> Section:
    """Words, the times of each trial, and the commands of a sceptic."""
    broken = [t.name for t in proof.trials if not in_order(t)]
    notices = [
        Notice(
            text="Not sealed, judged and opened in that order.", severity=Severity.DOUBT, where=n
        )
        for n in broken
    ]
    notices += [
        Notice(
            text=f"Its judge was stopped from outside after {fixed(t.seconds, 0)} s: no verdict, "
            "counted as missed.",
            severity=Severity.DOUBT,
            where=t.name,
        )
        for t in proof.trials
        if t.verdict == STOPPED
    ]
    if proof.trials and not broken:
        notices.append(Notice(text=_sealed_first(proof.trials)))
    return Section(
        id="protocol",
        title="How it was done",
        lead=LEAD,
        notices=tuple(notices),
        rows=(
            Row(
                label="Hash of the ledger",
                value=proof.head,
                note="of its last entry on a trial; one more has the hashes of this page and of "
                "proof.json",
            ),
            Row(
                label="Code that ran",
                value=proof.code,
                note="hash of what sealed, judged and compared; --check says whether it is "
                "installed",
            ),
            Row(
                label="To check it",
                value="twin prove --check DIR --again 3",
                note="DIR is the folder of this page",
            ),
            Row(label="To run it again", value=proof.command, note=_by_another_seed(proof)),
        ),
        tables=_times(proof),
        notes=(
            "Hashes are cut short here; pointed at they are shown whole, and proof.json has them.",
        ),
    )


def at(stamp: Stamp) -> datetime:
    """When it was entered."""
    return datetime.fromisoformat(stamp.utc)


def in_order(j: Judged) -> bool:
    """Sealed, then judged, then opened, or by the clock at once."""
    return at(j.sealed) <= at(j.judged) <= at(j.opened)


def _by_another_seed(proof: Proof) -> str:
    """What it changes."""
    drawn, fixed_list = (any(map(of, proof.trials)) for of in (simulated, recorded))
    return "; ".join((
        *(["with another seed other effects, sizes and flights are drawn"] if drawn else []),
        *(["the list of recorded trials is fixed, the seed orders them"] if fixed_list else []),
    ))  # fmt: skip


def _sealed_first(trials: tuple[Judged, ...]) -> str:
    """What the times say of all of them together."""
    last, first = max(at(t.sealed) for t in trials), min(at(t.judged) for t in trials)
    count = plural(len(trials), "trial")
    each = f"By the ledger each of {count} was sealed, judged and opened in that order"
    if last <= first:
        return f"{each}; the last truth was sealed before the first verdict was written."
    return f"{each}; some truths were sealed after verdicts on other trials were written."


def _times(proof: Proof) -> tuple[Table, ...]:
    if not proof.trials:
        return ()
    rows = tuple(
        (
            Cell(text=t.name),
            *(cell for stamp in (t.sealed, t.judged, t.opened) for cell in _stamp(stamp)),
            Cell(text=fixed(t.seconds, 0)),
        )
        for t in proof.trials
    )
    return (
        Table(caption="Times and hashes of every trial", columns=COLUMNS, rows=rows, folded=True),
    )


def _stamp(stamp: Stamp) -> tuple[Cell, Cell]:
    when = at(stamp).strftime("%Y-%m-%d %H:%M:%S")
    return (
        Cell(text=when, whole=stamp.utc),
        Cell(text=stamp.sha256[:SHORT], whole=f"{stamp.sha256}; entry {stamp.entry}"),
    )
