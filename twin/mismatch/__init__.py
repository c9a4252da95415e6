"""Where twin and recording differ: locate it, name the physics left out, show the fit improve."""

from twin.mismatch.adopt import adopted_text
from twin.mismatch.explain import explain
from twin.mismatch.finding import Finding, Verdict
from twin.mismatch.flight import Flight, MismatchError
from twin.mismatch.out import finding_json

__all__ = [
    "Finding",
    "Flight",
    "MismatchError",
    "Verdict",
    "adopted_text",
    "explain",
    "finding_json",
]
