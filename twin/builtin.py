"""Cells by name: BPX files shipped in `twin/cells`, or a BPX file of one's own."""

from difflib import get_close_matches
from importlib import resources
from pathlib import Path

from twin.bpx_file import CellError, read_bpx
from twin.cell import Cell

SUFFIX = ".bpx.json"


def builtin_names() -> tuple[str, ...]:
    """Names of the cells that come with this package, sorted."""
    folder = resources.files("twin") / "cells"
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(n.removesuffix(SUFFIX) for n in names if n.endswith(SUFFIX)))


def builtin_text(name: str) -> str:
    """The BPX file of a built-in cell; CellError, with the nearest name, if there is none."""
    if name not in (known := builtin_names()):
        near = get_close_matches(name, known, n=1, cutoff=0.0)
        raise CellError(
            f"no built-in cell {name!r}; the nearest is {near[0]!r} (all: {', '.join(known)}). "
            "A file is named with its suffix, e.g. cell.bpx.json"
        )
    return (resources.files("twin") / "cells" / f"{name}{SUFFIX}").read_text(encoding="utf-8")


def load_cell(path_or_name: str | Path) -> Cell:
    """A built-in cell by its name, or the cell of a BPX file by its path.

    What ends in .json or contains a folder is a path; anything else is a name. CellError if the
    file cannot be read, or is no cell we can simulate.
    """
    text = str(path_or_name)
    if isinstance(path_or_name, str) and not text.endswith(".json") and "/" not in text:
        return read_bpx(builtin_text(text), name=text)
    try:
        content = Path(path_or_name).read_text(encoding="utf-8-sig")  # Windows marks the beginning
    except (OSError, UnicodeDecodeError) as e:
        why = (isinstance(e, OSError) and e.strerror) or e
        raise CellError(f"{path_or_name}: cannot be read: {why}") from e
    return read_bpx(content, name=Path(path_or_name).name)
