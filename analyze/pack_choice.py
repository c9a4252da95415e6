"""The pack file a user named, read and checked before the first log is opened."""

import hashlib
import warnings
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from twin.builtin import load_cell
from twin.cell import Cell
from twin.pack_file import PackFile, PackFileError, cell_reference, is_path, parse_pack_file

DEFAULT_CELL = "lipo_2200"


@dataclass(frozen=True, slots=True, kw_only=True)
class PackChoice:
    """A pack file and where it lies; small, so that it can be sent to a worker.

    Attributes:
        file: its content.
        cell: path of the cell's BPX file, or the name of a built-in cell.
        sha256: of the pack file and of the cell file it names.
    """

    file: PackFile
    cell: str | Path
    sha256: str


def read_pack(path: Path) -> PackChoice:
    """PackFileError if the file cannot be used; CellError if its cell cannot."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as e:
        raise PackFileError(f"{path}: cannot be read: {e}") from e
    file = parse_pack_file(text, name=str(path))
    cell = cell_reference(file, path.resolve().parent)
    cell_of(cell)
    content = text.encode()
    if is_path(file.pack.cell):
        content += b"\0" + Path(cell).read_bytes()
    return PackChoice(file=file, cell=cell, sha256=hashlib.sha256(content).hexdigest())


@lru_cache(maxsize=4)
def cell_of(reference: str | Path) -> tuple[Cell, tuple[str, ...]]:
    """The cell, and what was assumed or left aside when it was read.

    Kept, since the twin keeps its compiled equations by the identity of the cell.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        cell = load_cell(reference)
    return cell, tuple(str(w.message) for w in caught)
