"""The page of a proof: what was concealed, what the tool said of it, and where it failed."""

from proof.page.page import proof_page

__all__ = ["proof_page"]
