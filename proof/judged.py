"""`judged_trial`: truth and verdict of a trial, as they were written -> `Judged`."""

from collections.abc import Mapping
from math import nan
from typing import Any

from proof.compare import named_in, outcome, sized
from proof.judge import VERDICT
from proof.ledger import Entry
from proof.outcome import Judged
from proof.places import SEALED, TRUTH
from proof.truth import Truth


def judged_trial(
    truth: Truth, verdict: Mapping[str, Any], entries: Mapping[str, Entry], **others: Any
) -> Judged:
    """One trial.

    Args:
        truth: that was opened.
        verdict: what `mismatch.json` holds.
        entries: of the ledger, by event.
        others: the other fields of `Judged`, which neither of the two tells.
    """
    named = named_in(verdict)
    errors_V = {name: nan if mv is None else 1e-3 * mv for name, mv in verdict["rmse_mv"].items()}
    return Judged(
        truth=truth,
        verdict=verdict["verdict"],
        named=named,
        outcome=outcome(truth, verdict["verdict"], named),
        noise_V=errors_V["noise_floor"],
        held_out_before_V=errors_V["holdout_before"],
        held_out_after_V=errors_V["holdout_after"],
        sized=sized(truth, verdict),
        remarks=tuple(verdict.get("remarks", ())),
        sealed=entries["sealed"].stamp(SEALED),
        judged=entries["judged"].stamp(VERDICT),
        opened=entries["opened"].stamp(TRUTH),
        **others,
    )
