"""The page of a proof: what was concealed, what the tool said of it, and where it failed."""

from reports.proof.figure import figure
from reports.proof.page import proof_page
from reports.proof.summary import headline

__all__ = ["figure", "headline", "proof_page"]
