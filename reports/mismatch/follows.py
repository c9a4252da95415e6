"""What the mismatch follows; of one without a name, the terms that describe it."""

from reports.mismatch.report import MismatchReport
from reports.quantity import fixed
from reports.section import Cell, Column, Section, Table

DRIVERS = (
    Column(title="quantity", numeric=False),
    Column(title="share it explains of what was not fitted [%]"),
)
TERMS = (
    Column(title="quantity", numeric=False),
    Column(title="voltage for one standard deviation of it [mV]"),
)


def follows(report: MismatchReport) -> Section | None:
    """Tables of both; None where there is nothing to follow."""
    finding = report.finding
    tables, lead = [], []
    if finding.terms:
        share = fixed(100 * finding.terms[-1].explained, 0)
        lead.append(
            "No effect of the library explains it. It can be described, which is not the same: a "
            f"sum of these quantities makes {share} % of what was not fitted."
        )
        tables.append(
            Table(
                caption="A description, not a cause",
                columns=TERMS,
                rows=tuple(
                    (Cell(text=t.quantity), Cell(text=fixed(1e3 * t.size_V, 1)))
                    for t in finding.terms
                ),
            )
        )
    if finding.drivers:
        tables.append(
            Table(
                caption="Each quantity by itself",
                columns=DRIVERS,
                rows=tuple(
                    (Cell(text=d.quantity), Cell(text=fixed(100 * d.explained, 0)))
                    for d in finding.drivers
                ),
            )
        )
    if not tables:
        return None
    return Section(
        id="follows",
        title="What it follows",
        lead=tuple(lead),
        tables=tuple(tables),
        notes=(
            "A curve of one quantity is fitted to one part of the recordings and judged on the "
            "other. Quantities that run alike explain the same share.",
        ),
    )
