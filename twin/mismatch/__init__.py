"""Where twin and recording differ: locate it, name the physics left out, show the fit improve."""

from twin.mismatch.adopt import adopted_text
from twin.mismatch.explain import explain
from twin.mismatch.finding import Candidate, Course, Finding, NamedEffect, Span, Value, Verdict
from twin.mismatch.flight import START_SOC, UNTOLD, Flight, MismatchError
from twin.mismatch.hidden_csv import HiddenTable, read_hidden_csv
from twin.mismatch.hypothesis import HYPOTHESES, Hypothesis
from twin.mismatch.out import finding_json
from twin.mismatch.reveal import Hidden, Revealed, reveal, reveal_json

__all__ = [
    "HYPOTHESES",
    "START_SOC",
    "UNTOLD",
    "Candidate",
    "Course",
    "Finding",
    "Flight",
    "Hidden",
    "HiddenTable",
    "Hypothesis",
    "MismatchError",
    "NamedEffect",
    "Revealed",
    "Span",
    "Value",
    "Verdict",
    "adopted_text",
    "explain",
    "finding_json",
    "read_hidden_csv",
    "reveal",
    "reveal_json",
]
