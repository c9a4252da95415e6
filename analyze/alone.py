"""One run at a time writes into a folder: `alone`."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from analyze.checks import WrongUse


@contextmanager
def alone(out: Path) -> Iterator[None]:
    """Locks the folder; WrongUse where another run has.

    Each would choose names by what the other has not written yet, and the page of the fleet would
    be of whichever ends last. The lock leaves no file behind, and none when a run is killed. It is
    of this machine; where the system has no such locks there is none.
    """
    folder = _locked(out)
    try:
        yield
    finally:
        if folder is not None:
            os.close(folder)


def _locked(out: Path) -> int | None:
    """The open folder, if it can be locked."""
    if sys.platform == "win32":
        return None
    import fcntl

    try:
        folder = os.open(out, os.O_RDONLY)
    except OSError:  # it may be written to and not be looked into
        return None
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as e:
        os.close(folder)
        if isinstance(e, BlockingIOError):
            raise WrongUse(
                f"{click.format_filename(out)}: another analyze is writing there: wait until it "
                "ends, or give another folder with --out"
            ) from e
        return None  # a file system without locks
    return folder
