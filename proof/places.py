"""Where the files of a proof lie."""

LEDGER, TRIALS = "ledger.jsonl", "trials"
QUESTION, SEALED, WRITTEN, TRUTH = "question", "truth.sealed", "verdict", "truth.json"
"""Of one trial: what is asked (a folder), its truth, the verdict (a folder), the truth opened."""
