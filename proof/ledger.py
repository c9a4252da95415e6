"""The ledger: what was sealed, judged and opened, in that order; each entry holds the last's hash.

A line of JSON an entry. Whoever changes an entry, or puts one in between, changes every hash after
it. It tells an order, and that files agree with it. Who writes all of it anew can tell any order:
that this one was kept is shown by a hash that was published before, or by trials of your own.

The first entry is of what was asked for, and by which code; then every truth is sealed, every
question judged, every truth opened, and all are compared. The last entries are of trials that were
not made, with a hash of why, and of what was shown of all, with the hashes of those files.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from threading import Lock

from proof.outcome import NotMade, Stamp

FIRST = "0" * 64
EVENTS = ("sealed", "judged", "opened", "compared")
BEGUN, LEFT, SHOWN = "begun", "left out", "shown"


class LedgerError(ValueError):
    """A ledger that does not hold; the text says where."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One line.

    Attributes:
        number: from 0.
        utc: ISO 8601.
        event: one of EVENTS, or BEGUN, LEFT or SHOWN.
        trial: name of it; "" of these three.
        sha256: of the files that it is about, by name.
        key: of what was sealed, when it is opened; else "".
        before: hash of the entry before.
    """

    number: int
    utc: str
    event: str
    trial: str
    sha256: Mapping[str, str]
    key: str
    before: str

    @property
    def at(self) -> datetime:
        """When, by the clock of who ran it."""
        return datetime.fromisoformat(self.utc)

    @property
    def hash(self) -> str:
        """SHA-256 of all of it."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def text(self) -> str:
        """The line."""
        return json.dumps(asdict(self), sort_keys=True)

    def stamp(self, file: str) -> Stamp:
        """For the page, of one of its files."""
        return Stamp(utc=self.utc, sha256=self.sha256[file], entry=self.hash)


class Ledger:
    """Appends to a file; threads may share it. A clock that is set back stands still in it."""

    def __init__(self, path: Path) -> None:
        self._path, self._lock = path, Lock()
        self._count, self.head, self._last = 0, FIRST, datetime.min.replace(tzinfo=UTC)
        path.write_text("", encoding="utf-8")

    def append(self, event: str, trial: str, sha256: Mapping[str, str], key: str = "") -> Entry:
        """The entry, when it is in the file."""
        with self._lock:
            self._last = max(self._last, datetime.now(UTC))
            entry = Entry(
                number=self._count, utc=self._last.isoformat(timespec="milliseconds"),
                event=event, trial=trial, sha256=dict(sha256), key=key, before=self.head,
            )  # fmt: skip
            with self._path.open("a", encoding="utf-8") as stream:
                stream.write(entry.text + "\n")
            self._count, self.head = self._count + 1, entry.hash
            return entry


def read_ledger(text: str) -> tuple[Entry, ...]:
    """Its entries; LedgerError if a line is none, the chain is broken, or the order is no run's."""
    entries = tuple(_parsed(text))
    before = FIRST
    for number, entry in enumerate(entries):
        if (entry.number, entry.before) != (number, before):
            raise LedgerError(f"entry {number}: it does not follow from the one before it")
        before = entry.hash
    _check_order(entries)
    return entries


def _check_order(entries: Sequence[Entry]) -> None:
    if entries and entries[0].event != BEGUN:
        raise LedgerError(f"entry 0: {entries[0].event}: expected {BEGUN}, what was asked for")
    for one, other in pairwise(entries):
        if other.at < one.at:
            raise LedgerError(f"entry {other.number}: {other.utc}, but the one before it {one.utc}")
    of_trials = list(entries[1:])
    for event in (SHOWN, LEFT):
        if of_trials and of_trials[-1].event == event:
            of_trials.pop()
    for trial in dict.fromkeys(e.trial for e in of_trials):
        _check_events(trial, [e.event for e in of_trials if e.trial == trial])
    _check_phases(of_trials)


def _parsed(text: str) -> Iterator[Entry]:
    for number, line in enumerate(text.splitlines()):
        try:
            entry = Entry(**json.loads(line))
        except (TypeError, ValueError) as e:
            raise LedgerError(f"entry {number}: no entry of a ledger: {e}") from e
        texts = (entry.utc, entry.event, entry.trial, entry.key, entry.before)
        hashes = entry.sha256
        if not isinstance(hashes, dict) or not all(isinstance(t, str) for t in texts):
            raise LedgerError(f"entry {number}: no entry of a ledger: texts and hashes expected")
        if not _is_time(entry.utc):
            raise LedgerError(f"entry {number}: {entry.utc!r} is no time: expected UTC, ISO 8601")
        yield entry


def _is_time(text: str) -> bool:
    try:
        return datetime.fromisoformat(text).utcoffset() is not None
    except ValueError:
        return False


def _check_events(trial: str, events: Sequence[str]) -> None:
    if list(events) != list(EVENTS[: len(events)]):
        raise LedgerError(f"{trial}: {', '.join(events)}: expected {', '.join(EVENTS)}")


def _check_phases(entries: Sequence[Entry]) -> None:
    """All are sealed before one is judged, and judged before one is opened."""
    for one, other in pairwise(entries):
        if EVENTS.index(other.event) < EVENTS.index(one.event):
            raise LedgerError(
                f"entry {other.number}: {other.trial} is {other.event} when {one.trial} was "
                f"{one.event}: expected all {other.event} before one is {one.event}"
            )


def left_out(not_made: Sequence[NotMade]) -> dict[str, str]:
    """Trial -> hash of whose truth it was and why it was not made."""
    return {n.name: sha256_of(f"{n.source}\n{n.reason}".encode()) for n in not_made}


def sha256_of(content: bytes) -> str:
    """In hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def sha256_of_folder(folder: Path) -> str:
    """Of the names and contents of its files."""
    parts = [f"{p.name} {sha256_of(p.read_bytes())}\n" for p in sorted(folder.iterdir())]
    return sha256_of("".join(parts).encode())
