"""Where the twin and this flight differ, in short."""

from reports.flight import FlightReport, NoMismatch
from reports.mismatch import headline
from reports.mismatch.candidates import COLUMNS, row
from reports.mismatch.located import motion_shares, moving, picture
from reports.mismatch.summary import beside
from reports.quantity import fixed
from reports.section import Notice, Section, Severity, Table
from twin.mismatch import Finding, Verdict

SHOWN = 5
FURTHER = (
    "This is the short form, from one flight of which blocks are fitted and held out in turn. "
    "Of all effects that need no further equations only the three that promise most by what they "
    "do to the voltage were fitted, each alone. `twin explain` fits all, takes several flights, "
    "tries combinations, and writes a pack file with what was found."
)
NEEDED = (
    "To learn why: calibrate the pack with `twin calibrate`, give the pack file with --pack, and "
    "`twin explain` looks for the cause in several flights."
)
MORE = 1.3  # times what its time would have: where a mismatch is, rather than all over


def mismatch(report: FlightReport) -> Section:
    """The sentence, where, and what was tried."""
    found = report.mismatch
    title = "Where the twin and this flight differ"
    if isinstance(found, NoMismatch):
        doubt = Notice(text=found.reason, severity=Severity.DOUBT, code="no_mismatch")
        return Section(id="mismatch", title=title, notices=(doubt,))
    notices = [
        Notice(text=text, severity=Severity.DOUBT, code="mismatch_doubtful")
        for text in found.remarks
    ]
    if found.advice:
        notices.append(Notice(text=f"What would tell more: {found.advice}."))
    return Section(
        id="mismatch",
        title=title,
        lead=tuple(filter(None, (headline(found), where(found), beside(found)))),
        notices=tuple(notices),
        figures=tuple(picture(c, found, k) for k, c in enumerate(found.courses)),
        tables=(_tried(found),) if found.causes_sought else (),
        notes=(FURTHER if found.causes_sought else NEEDED,),
    )


def where(found: Finding) -> str:
    """The motion with most of it beside its share of the time; "" if there is none."""
    shares = motion_shares(found.spans)
    motion, share = next(iter(shares.items()), ("", 0.0))
    if found.verdict is Verdict.NONE or not motion:
        return ""
    moments = [c.motion[c.judged] == motion for c in found.courses]
    time = sum(int(m.sum()) for m in moments) / max(sum(m.size for m in moments), 1)
    if share < MORE * time:
        return "It is there all through the flight, not in one motion."
    return (
        f"Of the mismatch {fixed(100 * share, 0)} % lies in the {moving(motion)} stretches, which "
        f"make {fixed(100 * time, 0)} % of the flight."
    )


def _tried(found: Finding) -> Table:
    return Table(
        caption="The likeliest of what was tried",
        columns=COLUMNS,
        rows=tuple(row(c, found) for c in found.candidates[:SHOWN]),
    )
