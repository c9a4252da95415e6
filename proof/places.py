"""Where the files of a proof lie."""

from pathlib import Path

LEDGER, TRIALS = "ledger.jsonl", "trials"
QUESTION, SEALED, WRITTEN, TRUTH = "question", "truth.sealed", "verdict", "truth.json"
"""Of one trial: what is asked (a folder), its truth, the verdict (a folder), the truth opened."""
COMPARED = "compared.json"
"""Of one trial: baselines, channels and capacity, computed when its truth was open."""
JUDGED = "judged.json"
"""Beside the verdict: how long it took, the code that gave it, and the options it was given."""
ASKED = "begun.json"
"""Of all: seed and command, versions and code, and whose each trial is."""
PROOF, PAGE = "proof.json", "proof.html"


def in_the_way(out: Path) -> Path | None:
    """A folder that has the name of a file of ours, or the other way round."""
    for name in (LEDGER, ASKED, PROOF, PAGE):
        if (out / name).is_dir():
            return out / name
    trials = out / TRIALS
    return trials if trials.exists() and not trials.is_dir() else None
