"""The page of a proof: what was concealed, what the tool said of it, and where it failed."""

from proof.page.figure import figure
from proof.page.page import proof_page
from proof.page.summary import headline

__all__ = ["figure", "headline", "proof_page"]
