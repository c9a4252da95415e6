"""Which test to make next, and what is to be known of the tests that were made."""

from collections.abc import Iterable, Sequence

from reports.calibration.names import phrase
from reports.calibration.report import CalibrationReport
from reports.quantity import MISSING, fixed
from reports.section import Cell, Column, Notice, Section, Severity, Table

COLUMNS = (
    Column(title="test", numeric=False),
    Column(title="information added [nats]"),
    Column(title="standard errors that shrink most, to this share", numeric=False),
)


def further(report: CalibrationReport) -> Section | None:
    """Candidates, the most informative first; nothing where none was looked at."""
    advice = report.found.advice
    if not advice:
        return None
    rows = tuple(
        (Cell(text=a.name), Cell(text=fixed(a.gain, 1)), Cell(text=_helped(a.helps)))
        for a in advice
    )
    return Section(
        id="further",
        title="A further test",
        lead=(
            f"{advice[0].name} would add most to what is known. Each was simulated with the "
            "calibrated cell, with the noise of these tests.",
        ),
        tables=(Table(caption="What a further test would bring", columns=COLUMNS, rows=rows),),
        notes=(
            "One nat makes the region in which all parameters lie 2.7 times smaller, taken "
            "together.",
        ),
    )


def remarks(report: CalibrationReport) -> Section | None:
    """What was detected in the tests, and what they leave unknown."""
    names = [f.name for f in report.found.fitted]
    notices = [Notice(text=t) for t in grouped(report.found.remarks, names)]
    notices += [Notice(text=t, severity=Severity.DOUBT) for t in report.doubts]
    if not notices:
        return None
    return Section(id="remarks", title="Remarks", notices=tuple(notices))


def grouped(remarks: Iterable[str], tests: Sequence[str]) -> tuple[str, ...]:
    """Each remark once; those that begin with the name of a test name all they are true of."""
    of: dict[str, list[str]] = {}
    for remark in remarks:
        name = next((t for t in tests if remark.startswith(f"{t}: ")), "")
        of.setdefault(remark.removeprefix(f"{name}: "), []).append(name)
    return tuple(f"{', '.join(names)}: {r}" if all(names) else r for r, names in of.items())


def _helped(helps: tuple[tuple[str, float], ...]) -> str:
    return "; ".join(f"{phrase(n)} {fixed(100 * left, 0)}\u00a0%" for n, left in helps) or MISSING
