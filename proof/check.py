"""`twin prove --check`: do the files of a proof hold against its ledger?"""

import json
from collections.abc import Iterator
from pathlib import Path

from proof.judge import VERDICT
from proof.ledger import FIRST, Entry, read_ledger, sha256_of, sha256_of_folder
from proof.out import FILE
from proof.run import LEDGER, QUESTION, SEALED, TRIALS, TRUTH, WRITTEN
from proof.seal import truth_text, unseal

FILES = {VERDICT: f"{WRITTEN}/{VERDICT}"}


def broken(out: Path) -> tuple[int, list[str]]:
    """How many trials were opened, and what does not hold, in words.

    Raises:
        LedgerError: the ledger itself is broken, or a trial was opened before it was judged.
        OSError: there is none.
    """
    entries = read_ledger((out / LEDGER).read_text(encoding="utf-8"))
    found = [text for entry in entries for text in _of_entry(out / TRIALS / entry.trial, entry)]
    sealed = {e.trial: e for e in entries if e.event == "sealed"}
    opened = [e for e in entries if e.event == "opened"]
    for entry in opened:
        found += _of_key(out / TRIALS / entry.trial, sealed[entry.trial], entry)
    end = entries[-1].hash if entries else FIRST
    if (proof := out / FILE).exists() and json.loads(proof.read_bytes())["ledger_head"] != end:
        found.append(f"{LEDGER}: it ends elsewhere than {FILE} says: entries are missing, or more")
    return len(opened), found


def _of_entry(folder: Path, entry: Entry) -> Iterator[str]:
    for name, expected in entry.sha256.items():
        path = folder / FILES.get(name, name)
        if not path.exists():
            yield f"{entry.trial}: {name} is missing"
        elif (sha256_of_folder if name == QUESTION else _of_file)(path) != expected:
            yield f"{entry.trial}: {name} is not what was {entry.event}"


def _of_file(path: Path) -> str:
    return sha256_of(path.read_bytes())


def _of_key(folder: Path, sealed: Entry, opened: Entry) -> Iterator[str]:
    """The key opens what was sealed, and that is the truth that is shown."""
    path = folder / SEALED
    if not path.exists():
        return
    token = path.read_bytes()
    try:
        text = truth_text(unseal(token, opened.key))
    except ValueError as e:
        yield f"{opened.trial}: {e}"
        return
    if (
        sha256_of(token) == sealed.sha256[SEALED]
        and sha256_of(text.encode()) != opened.sha256[TRUTH]
    ):
        yield f"{opened.trial}: the truth that is shown is not the one that was sealed"
