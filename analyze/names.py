"""File names that can be printed, names of results, and folder names that do not collide."""

from collections.abc import Callable, Collection, Iterable
from fnmatch import fnmatchcase
from itertools import count

RESULT = "result.json"
FLIGHT_FILES = frozenset({RESULT, "report.html", "segments.csv", "replay.parquet"})
PROFILES = "profile_*.csv"
FLEET_FILES = frozenset({"index.html", "fleet.parquet", "failures.json"})
RESERVED = FLEET_FILES | {".", ".."}
LONGEST_BYTES = 240  # of a stem: file systems allow 255, and hash and number come behind it


def printable(name: str) -> str:
    """`name` without the bytes that are no text (a file name need not be any)."""
    return name.encode("utf-8", "replace").decode("utf-8")


def free_name(stem: str, digest: str, taken: Callable[[str], bool]) -> str:
    """`stem`, cut if it is very long, else with the start of the log's hash, else a number too.

    The hash rather than a plain number: the same log then gets the same folder again, whatever
    else is in the run.
    """
    short = stem.encode()[:LONGEST_BYTES].decode(errors="ignore")
    for name in _proposals(short, digest):
        if name.casefold() not in RESERVED and not taken(name):
            return name
    raise AssertionError("there is always a next number")


def _proposals(stem: str, digest: str) -> Iterable[str]:
    yield stem
    yield f"{stem}-{digest[:8]}"
    for i in count(2):
        yield f"{stem}-{digest[:8]}-{i}"


def results_among(names: Collection[str]) -> frozenset[str]:
    """Of the names in one folder those that a whole flight, or a fleet, has there."""
    there = frozenset(names)
    fleet = FLEET_FILES if there >= FLEET_FILES else frozenset()
    if not there >= FLIGHT_FILES:
        return fleet
    return fleet | FLIGHT_FILES | {name for name in there if fnmatchcase(name, PROFILES)}
