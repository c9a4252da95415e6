"""`twin prove --check`: do the files of a proof hold against its ledger, and what it shows?"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proof.again import differences, proof_again
from proof.ledger import (
    BEGUN,
    EVENTS,
    FIRST,
    LEFT,
    SHOWN,
    Entry,
    LedgerError,
    left_out,
    read_ledger,
    sha256_of,
    sha256_of_folder,
)
from proof.out import VERSION
from proof.outcome import NotMade
from proof.places import (
    ASKED,
    JUDGED,
    LEDGER,
    PAGE,
    PROOF,
    QUESTION,
    SEALED,
    TRIALS,
    TRUTH,
    WRITTEN,
)
from proof.seal import truth_text, unseal


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """What came of it.

    Attributes:
        opened: trials whose truth was opened.
        broken: what does not hold, in words.
        code: hash of what it says it was made by; "" if it says none.
    """

    opened: int
    broken: tuple[str, ...]
    code: str


class OtherVersionError(ValueError):
    """A proof that this program cannot check; the text says what can."""


def check(out: Path) -> Checked:
    """All that is shown, beside the ledger, and beside the files that it was made from.

    But for the page: its hash is in the last entry, and what it shows is in `proof.json`.

    Raises:
        OtherVersionError: it is of a version before or after this one; nothing else was looked at.
        LedgerError: the ledger itself is broken, or its order is not that of a run.
        OSError: there is none.
    """
    shown = _shown(out / PROOF)
    if (its := shown.get("schema_version", VERSION)) != VERSION:
        raise OtherVersionError(
            f"{PROOF} is of version {its}, this program checks {VERSION}: check it with the "
            "program that made it"
        )
    entries = _ledger(out / LEDGER)
    made = [e for e in entries if e.event != SHOWN]
    trials = [e for e in made if e.event not in (BEGUN, LEFT)]
    opened = sum(e.event == "opened" for e in trials)
    broken = [text for e in entries if e.event != LEFT for text in _of_entry(out, e)]
    if entries and ASKED not in entries[0].sha256:
        broken.append(f"{LEDGER}: its first entry, of {ASKED}, has no hash of it")
    broken += _of_keys(out / TRIALS, trials)
    broken += _unknown(out / TRIALS, trials)
    broken += _not_opened(trials)
    broken += _of_code(out, trials)
    broken += _of_proof(out, made)
    if not entries or entries[-1].event != SHOWN:
        broken.append(f"{LEDGER}: its last entry, of {PROOF} and {PAGE}, is missing")
    if not (out / PAGE).is_file():
        broken.append(f"{PAGE} is missing")
    code = str(shown.get("code", ""))
    return Checked(opened=opened, broken=tuple(dict.fromkeys(broken)), code=code)


def _shown(path: Path) -> Mapping[str, Any]:
    """Of `proof.json`; nothing where it is none, which `_of_proof` tells."""
    try:
        return dict(json.loads(path.read_bytes()))
    except (TypeError, ValueError, OSError):
        return {}


def _ledger(path: Path) -> tuple[Entry, ...]:
    try:
        return read_ledger(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as e:
        raise LedgerError(f"{LEDGER}: no text: {e}") from e


def _path(entry: Entry, name: str) -> Path:
    """Of a file of an entry, beside the ledger."""
    if entry.event in (BEGUN, SHOWN):
        return Path(name)
    folder = Path(TRIALS, entry.trial)
    return folder / WRITTEN / name if entry.event == "judged" else folder / name


def _of_entry(out: Path, entry: Entry) -> Iterator[str]:
    """Files that are not as the entry has them."""
    whose = f"{entry.trial}: " if entry.trial else ""
    for name, expected in entry.sha256.items():
        path = out / _path(entry, name)
        try:
            found = sha256_of_folder(path) if name == QUESTION else sha256_of(path.read_bytes())
        except FileNotFoundError:
            yield f"{whose}{name} is missing"
        except OSError as e:
            yield f"{whose}{name} cannot be read: {e.strerror}: {e.filename}"
        else:
            if found != expected:
                yield f"{whose}{name} is not what was {entry.event}"


def _of_keys(folder: Path, entries: Sequence[Entry]) -> Iterator[str]:
    sealed = {e.trial: e for e in entries if e.event == "sealed"}
    for entry in entries:
        if entry.event == "opened":
            yield from _of_key(folder / entry.trial, sealed[entry.trial], entry)


def _of_key(folder: Path, sealed: Entry, opened: Entry) -> Iterator[str]:
    """The key opens what was sealed, and that is the truth that is shown."""
    path = folder / SEALED
    if not path.is_file():
        return
    token = path.read_bytes()
    try:
        text = truth_text(unseal(token, opened.key))
    except ValueError as e:
        yield f"{opened.trial}: {e}"
        return
    as_sealed = sha256_of(token) == sealed.sha256.get(SEALED)
    if as_sealed and sha256_of(text.encode()) != opened.sha256.get(TRUTH):
        yield f"{opened.trial}: the truth that is shown is not the one that was sealed"


def _unknown(folder: Path, entries: Sequence[Entry]) -> Iterator[str]:
    """Trials that no entry is about, and files within the others."""
    known = {Path(_path(e, name)).relative_to(TRIALS) for e in entries for name in e.sha256}
    names = {path.parts[0] for path in known}
    for own in sorted(p for p in folder.glob("*") if p.is_dir()):
        if own.name not in names:
            yield f"{own.name}: the ledger knows no such trial"
            continue
        for path in sorted((*own.glob("*"), *own.glob(f"{WRITTEN}/*"))):
            place = path.relative_to(folder)
            if place not in known and path.name != WRITTEN:
                yield f"{own.name}: the ledger knows no {place.relative_to(own.name)}"


def _not_opened(entries: Sequence[Entry]) -> Iterator[str]:
    """A truth that stays sealed is one of which nobody knows what was said."""
    last = {e.trial: e.event for e in entries}
    if not any(e.event == "opened" for e in entries):
        yield "no trial was opened"
    for trial, event in last.items():
        if event != EVENTS[-1]:
            lacks = "compared" if event == "opened" else "opened"
            yield f"{trial}: {event}, but its truth was never {lacks}"


def _of_code(out: Path, entries: Sequence[Entry]) -> Iterator[str]:
    """Every verdict is by the code that the run began with."""
    try:
        began = json.loads((out / ASKED).read_bytes())["code"]
        for entry in (e for e in entries if e.event == "judged"):
            if json.loads((out / _path(entry, JUDGED)).read_bytes())["code"] != began:
                yield f"{entry.trial}: judged by other code than the run began with"
    except (LookupError, TypeError, ValueError, OSError) as e:
        yield f"{ASKED}: by which code was judged cannot be told: {type(e).__name__}: {e}"


def _of_proof(out: Path, entries: Sequence[Entry]) -> Iterator[str]:
    """`proof.json` beside the ledger and what it was made from."""
    path = out / PROOF
    if not path.is_file():
        yield f"{PROOF} is missing"
        return
    try:
        shown = json.loads(path.read_bytes())
        if shown["ledger_head"] != (entries[-1].hash if entries else FIRST):
            yield (f"{LEDGER}: it ends elsewhere than {PROOF} says: entries are missing, or more")
        yield from _of_trials(shown, entries)
        yield from _of_left(shown, entries)
        yield from differences(shown, proof_again(out, shown, entries), PROOF)
    except (LookupError, TypeError, ValueError, AttributeError, OSError) as e:
        yield f"{PROOF} is not made of the files of its trials: {type(e).__name__}: {e}"


def _of_left(shown: Mapping[str, Any], entries: Sequence[Entry]) -> Iterator[str]:
    """Trials that were not made are those, and for that, of the ledger."""
    entered = next((e.sha256 for e in entries if e.event == LEFT), {})
    if left_out([NotMade(**n) for n in shown["not_made"]]) != entered:
        yield f"{PROOF}: not_made is not what was {LEFT}"


def _of_trials(shown: Mapping[str, Any], entries: Sequence[Entry]) -> Iterator[str]:
    """It has each trial that was opened, once."""
    names = [t["name"] for t in shown["trials"]]
    opened = [e.trial for e in entries if e.event == "opened"]
    for name in dict.fromkeys((*opened, *names)):
        if names.count(name) != opened.count(name):
            yield f"{PROOF}: {name} is in it {names.count(name)} times, opened {opened.count(name)}"
