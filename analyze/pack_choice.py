"""The pack file a user named, read and checked before the first log is opened."""

import hashlib
import os
import warnings
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from flightlogs.errors import LogWarning
from twin.builtin import load_cell
from twin.calibrate.asked import beyond
from twin.calibrate.doubt import Doubt, read_doubt
from twin.calibrate.table import CalibrationError
from twin.cell import Cell
from twin.load import Load
from twin.pack import Pack
from twin.pack_file import PackFile, PackFileError, cell_reference, is_path, parse_pack_file

DEFAULT_CELL = "lipo_2200"
BEYOND = "beyond_calibration"  # code of a warning


@dataclass(frozen=True, slots=True, kw_only=True)
class PackChoice:
    """A pack file and where it lies; small, so that it can be sent to a worker.

    Attributes:
        file: its content.
        cell: path of the cell's BPX file, or the name of a built-in cell.
        sha256: of the pack file, of the cell file it names, and of the fits beside them.
        cell_doubt: what the calibration of the cell left open; None if it was not calibrated.
        life_doubt: what the fit to a life left open; None if there was none.
    """

    file: PackFile
    cell: str | Path
    sha256: str
    cell_doubt: Doubt | None = None
    life_doubt: Doubt | None = None


def read_pack(path: Path) -> PackChoice:
    """PackFileError if the file cannot be used; CellError if its cell cannot."""
    text = _text(path)
    file = parse_pack_file(text, name=str(path))
    cell = cell_reference(file, path.resolve().parent)
    cell_of(cell)
    content = text.encode()
    if is_path(file.pack.cell):
        content += b"\0" + Path(cell).read_bytes()
    beside = (_fit_of_cell(Path(cell)) if is_path(file.pack.cell) else None, _fit_of_life(path))
    texts = [_text(p) if p and p.is_file() else "" for p in beside]
    try:
        doubts = [
            read_doubt(text, name=str(p)) if text else None
            for p, text in zip(beside, texts, strict=True)
        ]
    except CalibrationError as e:
        raise PackFileError(str(e)) from e
    content += "\0".join(texts).encode()
    return PackChoice(
        file=file,
        cell=cell,
        sha256=hashlib.sha256(content).hexdigest(),
        cell_doubt=doubts[0],
        life_doubt=doubts[1],
    )


def cell_beside(cell: str | Path, pack_file: Path) -> str:
    """What `pack_file`, a path to be written, calls the cell of a `PackChoice`."""
    if isinstance(cell, str):
        return cell
    there = Path(os.path.relpath(cell, pack_file.resolve().parent)).as_posix()
    return there if is_path(there) else f"./{there}"


def beyond_tests(choice: PackChoice | None, load: Load, pack: Pack) -> tuple[LogWarning, ...]:
    """Where the `load` of a pack asks for more than the tests that its cell is calibrated to."""
    asked = choice.cell_doubt.asked if choice and choice.cell_doubt else None
    if asked is None:
        return ()
    text = beyond(asked, load, parallel=pack.parallel, initial_K=pack.initial_K)
    return (LogWarning(code=BEYOND, message=text),) if text else ()


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")  # Windows puts a mark at the beginning
    except (OSError, UnicodeDecodeError) as e:
        why = (isinstance(e, OSError) and e.strerror) or e
        raise PackFileError(f"{path}: cannot be read: {why}") from e


def _fit_of_cell(cell: Path) -> Path:
    """What `twin calibrate` writes beside the cell."""
    return cell.with_name(f"{cell.name.removesuffix('.json').removesuffix('.bpx')}.fit.json")


def _fit_of_life(pack: Path) -> Path:
    """What it writes beside the pack file of a pack whose ageing it fitted."""
    return pack.with_suffix(".ageing.json")


def cell_of(reference: str | Path) -> tuple[Cell, tuple[str, ...]]:
    """The cell, and what was assumed or left aside when it was read.

    Kept as long as its file is the same, since the twin keeps its compiled equations by the
    identity of the cell.
    """
    path = Path(reference)
    there = is_path(str(reference)) and path.is_file()
    return _cell_of(reference, hashlib.sha256(path.read_bytes()).hexdigest() if there else "")


@lru_cache(maxsize=4)
def _cell_of(reference: str | Path, _sha256: str) -> tuple[Cell, tuple[str, ...]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        cell = load_cell(reference)
    return cell, tuple(str(w.message) for w in caught)
