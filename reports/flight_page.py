"""`flight_page`: the sections of a flight in their order."""

from reports.flight import FlightReport
from reports.page import Page
from reports.sections import FLIGHT_SECTIONS


def flight_page(report: FlightReport) -> Page:
    """The page of one flight; sections with nothing to say are left out."""
    made = (section(report) for section in FLIGHT_SECTIONS)
    return Page(
        title=report.log.name,
        subtitle="What this flight asked of its battery",
        sections=tuple(section for section in made if section is not None),
        version=report.provenance.version,
    )
