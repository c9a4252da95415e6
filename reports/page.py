"""`Page`: a whole page, a title and its sections."""

from dataclasses import dataclass

from reports.flight import FlightReport
from reports.section import Section
from reports.sections import FLIGHT_SECTIONS


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """What `render` lays out.

    Attributes:
        title: of the window and the first heading.
        subtitle: one line below it.
        sections: in order.
        version: of the program, in the footer.
    """

    title: str
    subtitle: str
    sections: tuple[Section, ...]
    version: str


def flight_page(report: FlightReport) -> Page:
    """The page of one flight; sections with nothing to say are left out."""
    made = (section(report) for section in FLIGHT_SECTIONS)
    return Page(
        title=report.log.name,
        subtitle="What this flight asked of its battery",
        sections=tuple(section for section in made if section is not None),
        version=report.provenance.version,
    )
