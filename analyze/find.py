"""Which logs are meant by the paths a user gives."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from errno import EACCES
from pathlib import Path

from analyze.names import results_among

SENSOR_SUFFIXES = (".sensor.csv", ".SENSOR.CSV", ".csv", ".CSV")  # SD cards shout
LOG_SUFFIXES = (".ulg", ".px4log", ".tlog")  # of nothing else; .bin and .log are names of much
EMPTY_SUFFIXES = (*LOG_SUFFIXES, ".bin", ".log")  # of a log where a card was not written
PACKED_SUFFIXES = (".gz", ".zip", ".bz2", ".xz", ".zst", ".7z", ".rar")


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What lies under the paths.

    Attributes:
        logs: files to analyse, sorted, none twice; those that only have a log's name included.
        unreadable: files and folders that could not be looked into, with the reason.
        passed_over: files in the folders that are no logs, sorted.
        linked: links to folders, which were not searched.
    """

    logs: tuple[Path, ...]
    unreadable: tuple[tuple[Path, str], ...]
    passed_over: tuple[Path, ...]
    linked: tuple[Path, ...] = ()


def find(paths: Sequence[Path], *, besides: Path, is_log: Callable[[Path], bool]) -> Found:
    """Files as they are named, and the logs in folders, searched below.

    A file that is named is taken whatever it is, and one in a folder that is called a log, too: if
    it is none, or empty, its reader says why. A packed log that is not beside it unpacked, and a
    link with a log's name that leads nowhere, are unreadable. Folders with a leading dot, links to
    folders, the folder of the results and the files of earlier ones are not searched.

    Args:
        paths: files and folders.
        besides: the folder of the results.
        is_log: judges a file by its first bytes; may raise OSError.
    """
    named = {p.resolve(): p for p in paths if not p.is_dir()}
    below = _Below(besides=besides.resolve())
    unreadable, others = below.unreadable, []
    for path in below.files(p for p in paths if p.is_dir()):
        if path.resolve() in named:
            continue
        try:
            if is_log(path) or _called_a_log(path):
                named[path.resolve()] = path
            elif _is_packed(path):
                unreadable.append((path, "a packed log: unpack it first"))
            else:
                others.append(path)
        except OSError as e:
            unreadable.append((path, e.strerror or str(e)))
    logs = tuple(sorted(named.values()))
    sensors = {sensor for log in logs if (sensor := sensor_beside(log))}
    passed_over = tuple(sorted(set(others) - sensors))
    return Found(
        logs=logs,
        unreadable=tuple(unreadable),
        passed_over=passed_over,
        linked=tuple(below.linked),
    )


def _called_a_log(path: Path) -> bool:
    """By its extension alone; `._flight.ulg` is what macOS puts beside a file on a card."""
    suffixes = LOG_SUFFIXES if path.stat().st_size else EMPTY_SUFFIXES
    return path.name.casefold().endswith(suffixes) and not path.name.startswith("._")


def _is_packed(path: Path) -> bool:
    """Whether it is an archive of a log, by its name, and the log is not beside it."""
    if not path.name.casefold().endswith(PACKED_SUFFIXES):
        return False
    return path.stem.casefold().endswith(EMPTY_SUFFIXES) and not _is_file(path.with_suffix(""))


def sensor_beside(log: Path) -> Path | None:
    """The recording of a current sensor next to a log: `flight.sensor.csv`, else `flight.csv`."""
    for suffix in SENSOR_SUFFIXES:
        path = log.with_name(log.stem + suffix)
        if path != log and _is_file(path):
            return path
    return None


def _is_file(path: Path) -> bool:
    """False, too, of what cannot be: the suffix makes a long name too long."""
    try:
        return path.is_file()
    except OSError:
        return False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Below:
    """A search of folders.

    Attributes:
        besides: a folder that is not searched.
        unreadable: what could not be entered, and links that lead to no log, with the reason.
        linked: links to folders; they are not followed.
    """

    besides: Path
    unreadable: list[tuple[Path, str]] = field(default_factory=list)
    linked: list[Path] = field(default_factory=list)

    def files(self, folders: Iterable[Path]) -> Iterator[Path]:
        """All of them, while the lists are filled."""
        for folder in folders:
            for at, below, names in os.walk(folder, onerror=self._fail):
                here = Path(at)
                if not os.access(here, os.X_OK):  # its names may be read, but nothing else
                    self.unreadable.append((here, os.strerror(EACCES)))
                    below.clear()
                    continue
                below[:] = sorted(self._searched(here, below))
                others = sorted(set(names) - results_among(names))
                yield from (here / name for name in others if self._is_file(here / name))

    def _fail(self, e: OSError) -> None:
        self.unreadable.append((Path(e.filename), e.strerror or str(e)))

    def _searched(self, here: Path, names: Iterable[str]) -> Iterator[str]:
        """Of the folders in one those that are; a link among the others is noted."""
        for path in (here / name for name in names if not name.startswith(".")):
            if path.resolve() == self.besides:
                continue
            if path.is_symlink():
                self.linked.append(path)
            else:
                yield path.name

    def _is_file(self, path: Path) -> bool:
        """A link that leads nowhere is told if it has the name of a log."""
        try:
            if path.is_file():
                return True
            if path.is_symlink() and path.name.casefold().endswith(EMPTY_SUFFIXES):
                path.stat()
        except OSError as e:  # it, or a name on the way, is not there, is closed, or is too long
            self.unreadable.append((path, e.strerror or str(e)))
        return False
