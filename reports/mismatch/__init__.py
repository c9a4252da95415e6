"""The page of a mismatch: where twin and recordings differ, and what was left out."""

from reports.mismatch.page import mismatch_page
from reports.mismatch.report import MismatchReport, Recorded
from reports.mismatch.summary import headline

__all__ = ["MismatchReport", "Recorded", "headline", "mismatch_page"]
