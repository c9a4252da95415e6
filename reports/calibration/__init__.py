"""The page of a calibration: what tests of a pack tell about its cell, and what they do not."""

from reports.calibration.further import grouped
from reports.calibration.names import called, phrase, word
from reports.calibration.page import calibration_page
from reports.calibration.report import CalibrationReport, SourceFile
from reports.calibration.summary import cell_estimates, headline, uncertain

__all__ = [
    "CalibrationReport",
    "SourceFile",
    "calibration_page",
    "called",
    "cell_estimates",
    "grouped",
    "headline",
    "phrase",
    "uncertain",
    "word",
]
