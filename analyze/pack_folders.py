"""The pack that a log is of, where folders are said to be packs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from analyze.names import printable
from reports.apart import ends_apart


@dataclass(frozen=True, slots=True, kw_only=True)
class PackFolders:
    """Which folder is whose pack.

    Attributes:
        names: of the pack, by log.
        loose: logs directly in a folder that was given, which is taken for their pack.
    """

    names: Mapping[Path, str]
    loose: tuple[Path, ...]


def pack_folders(logs: Sequence[Path], paths: Sequence[Path]) -> PackFolders:
    """The first folder below the one that was given is the pack; those below it are the card's own.

    A log directly in the folder given, or named itself, is of the folder that it lies in. Packs
    are called like their folders, with as much of the path as tells them from the others: two
    folders are never one pack.

    Args:
        logs: as `find` gives them.
        paths: that were given.
    """
    given = sorted((p for p in paths if p.is_dir()), key=lambda p: len(p.absolute().parts))
    folders, loose = {}, []
    for log in logs:
        within = [p for p in given if log.absolute().is_relative_to(p.absolute())]
        below = log.absolute().relative_to(within[0].absolute()).parts[:-1] if within else ()
        folders[log] = (within[0] / below[0] if below else log.parent).resolve()
        if within and not below:
            loose.append(log)
    names = ends_apart(str(folder) for folder in folders.values())
    called = {log: printable(names[str(folder)]) for log, folder in folders.items()}
    return PackFolders(names=called, loose=tuple(loose))
