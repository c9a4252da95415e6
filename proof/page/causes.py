"""Why a verdict is not right: what was lost or too much, and the cause if one is at hand."""

import re
from dataclasses import replace

from proof.judge import NO_VERDICT
from proof.outcome import Judged
from proof.page.words import times, why
from proof.targets import OVER_NOISE, over_floor

COMMON = re.compile(r"The twin is stated to err by|\S+\.csv: ")
"""Remarks that are no cause: of every recorded trial, and of what a file holds."""


def cause(j: Judged) -> str:
    """In one or two sentences; "" of a right verdict."""
    if j.verdict in NO_VERDICT:
        return f"The judge came to no verdict: {j.remarks[0] if j.remarks else 'it said nothing'}"
    return ". ".join(filter(None, (why(j), _reason(j))))


def _reason(j: Judged) -> str:
    """What is known of why; "" where nothing is."""
    if j.truth.strength < 1.0:
        return "The effect is smaller than what the base twin errs"
    if own := [r for r in j.remarks if not COMMON.match(r)]:
        return f"The tool said: {own[0]}"
    before, after = over_floor(replace(j, held_out_after_V=j.held_out_before_V)), over_floor(j)
    if j.verdict != "named" and before is not None and before <= OVER_NOISE:
        return (
            f"On what was held out the twin as given misses only {times(before)} the floor, so "
            "nothing there can confirm a name"
        )
    if after is not None and after > OVER_NOISE:
        return (
            f"The best that the tool found leaves {times(after)} the floor of what was held out, "
            "so it does not follow it"
        )
    return ""
