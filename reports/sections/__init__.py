"""The parts of a flight's page, in their order on it."""

from reports.sections.alignment import alignment
from reports.sections.course import course
from reports.sections.damage import damage
from reports.sections.fit import fit
from reports.sections.mismatch import mismatch
from reports.sections.motions import motions
from reports.sections.profiles import profiles
from reports.sections.provenance import provenance
from reports.sections.quality import quality
from reports.sections.replay import replay
from reports.sections.summary import summary

FLIGHT_SECTIONS = (
    summary,
    quality,
    alignment,
    course,
    motions,
    profiles,
    fit,
    replay,
    mismatch,
    damage,
    provenance,
)

__all__ = ["FLIGHT_SECTIONS"]
