"""`--reveal`: which recording a CSV belongs to, and the twins beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from analyze.names import printable
from analyze.workbench.drawn import Drawn
from twin.mismatch import Revealed, read_hidden_csv, reveal
from twin.pack_file import effects_of, parse_pack_file


def revealed_of(
    files: Sequence[Path], recordings: Mapping[str, Path], drawn: Mapping[str, Drawn], adopted: str
) -> tuple[Revealed, ...]:
    """The channels in all `files`, each beside the twin as configured and the adopted one.

    Args:
        files: CSVs, opened here and nowhere before.
        recordings: name -> file.
        drawn: name -> what was drawn.
        adopted: text of the adopted pack file, or "".

    Raises:
        TableError: a file cannot be read.
        MismatchError: it is not of its recording.
        OSError: a file cannot be opened.
    """
    effects = effects_of(parse_pack_file(adopted, name="adopted")) if adopted else None
    out: list[Revealed] = []
    for path in files:
        name = printable(path.name)
        with path.open(encoding="utf-8-sig", newline="") as stream:
            table = read_hidden_csv(stream, name=name)
        flight = belongs_to(path, recordings)
        own = drawn[flight]
        better = None if effects is None else replace(own.pack, effects=effects)
        out += reveal(
            table, flight=flight, load=own.load, configured=own.pack, adopted=better
        )  # fmt: skip
    return tuple(out)


def belongs_to(path: Path, recordings: Mapping[str, Path]) -> str:
    """The recording whose stem the CSV's name begins with, the longest; else the last one.

    Of several with one name that in the CSV's own folder. The last is one that was held out, if
    several were given.
    """
    known = [
        (len(log.stem), log.parent.absolute() == path.parent.absolute(), name)
        for name, log in recordings.items()
        if path.name == log.name or path.name.startswith((f"{log.stem}.", f"{log.stem}_"))
    ]
    return max(known)[-1] if known else list(recordings)[-1]
