"""Which logs are meant by the paths a user gives."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from errno import EACCES
from pathlib import Path

from analyze.names import results_among

SENSOR_SUFFIXES = (".sensor.csv", ".SENSOR.CSV", ".csv", ".CSV")  # SD cards shout
LOG_SUFFIXES = (".ulg", ".px4log", ".tlog")  # of nothing else; .bin and .log are names of much
EMPTY_SUFFIXES = (*LOG_SUFFIXES, ".bin", ".log")  # of a log where a card was not written


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What lies under the paths.

    Attributes:
        logs: files to analyse, sorted, none twice; those that only have a log's name included.
        unreadable: files and folders that could not be looked into, with the reason.
        passed_over: files in the folders that are no logs, sorted.
    """

    logs: tuple[Path, ...]
    unreadable: tuple[tuple[Path, str], ...]
    passed_over: tuple[Path, ...]


def find(paths: Sequence[Path], *, besides: Path, is_log: Callable[[Path], bool]) -> Found:
    """Files as they are named, and the logs in folders, searched below.

    A file that is named is taken whatever it is, and one in a folder that is called a log, too: if
    it is none, or empty, its reader says why. Folders with a leading dot, links to folders, the
    folder of the results and the files of earlier ones are not searched.

    Args:
        paths: files and folders.
        besides: the folder of the results.
        is_log: judges a file by its first bytes; may raise OSError.
    """
    named = {p.resolve(): p for p in paths if not p.is_dir()}
    unreadable: list[tuple[Path, str]] = []
    others = []
    folders = [p for p in paths if p.is_dir()]
    for path in _files_below(folders, besides.resolve(), unreadable):
        if path.resolve() in named:
            continue
        try:
            if is_log(path) or _called_a_log(path):
                named[path.resolve()] = path
            else:
                others.append(path)
        except OSError as e:
            unreadable.append((path, e.strerror or str(e)))
    logs = tuple(sorted(named.values()))
    sensors = {sensor for log in logs if (sensor := sensor_beside(log))}
    passed_over = tuple(sorted(set(others) - sensors))
    return Found(logs=logs, unreadable=tuple(unreadable), passed_over=passed_over)


def _called_a_log(path: Path) -> bool:
    """By its extension alone; `._flight.ulg` is what macOS puts beside a file on a card."""
    suffixes = LOG_SUFFIXES if path.stat().st_size else EMPTY_SUFFIXES
    return path.name.casefold().endswith(suffixes) and not path.name.startswith("._")


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


def _files_below(
    folders: Sequence[Path], besides: Path, unreadable: list[tuple[Path, str]]
) -> Iterator[Path]:
    """All files; a folder or link that cannot be entered is put to `unreadable`."""

    def fail(e: OSError) -> None:
        unreadable.append((Path(e.filename), e.strerror or str(e)))

    for folder in folders:
        for at, below, names in os.walk(folder, onerror=fail):
            here = Path(at)
            if not os.access(here, os.X_OK):  # its names may be read, but nothing else
                unreadable.append((here, os.strerror(EACCES)))
                below.clear()
                continue
            below[:] = sorted(
                d for d in below if not d.startswith(".") and (here / d).resolve() != besides
            )
            others = sorted(set(names) - results_among(names))
            for path in (here / name for name in others):
                try:
                    if path.is_file():
                        yield path
                except OSError as e:  # a link to where nobody may look, or with too long a name
                    unreadable.append((path, e.strerror or str(e)))
