"""What both commands look at before they begin; what is wrong with it is exit code 2."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from analyze.pack_choice import PackChoice, read_pack
from flightlogs.detect import HEAD_BYTES, detect
from flightlogs.errors import LogError, NotALog
from flightlogs.sensor import read_sensor
from twin.bpx_file import CellError
from twin.pack_file import PackFileError


class WrongUse(click.ClickException):
    """The command was called in a way that cannot work; exit code 2."""

    exit_code = 2


def checked_pack(path: Path) -> PackChoice:
    """The pack file, with its cell and its effects."""
    try:
        return read_pack(path)
    except (PackFileError, CellError) as e:
        raise WrongUse(str(e)) from e


def check_pack_name(option: str, path: Path, start: Path) -> None:
    """WrongUse if `path` is no name for a pack file that is written, beside that of the `start`."""
    shown = f"{option} {click.format_filename(path)}"
    if path.suffix != ".toml":
        raise WrongUse(f"{shown}: expected a name in .toml")
    if path.resolve() == start.resolve():
        raise WrongUse(f"{shown} is the pack file to start from: give another name")


def check_sensor(path: Path) -> None:
    """That what was asked for as a sensor's recording is one; what was only found may be none."""
    try:
        with path.open("rb") as stream:
            read_sensor(stream, name=click.format_filename(path))
    except OSError as e:
        shown = click.format_filename(path)
        raise WrongUse(f"--sensor {shown}: cannot be read: {e.strerror or e}") from e
    except LogError as e:
        raise WrongUse(f"--sensor {e}") from e


def make_writable(out: Path) -> None:
    """The folder, there and open for writing."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except FileExistsError as e:
        raise WrongUse(f"{click.format_filename(out)} is a file: expected a folder") from e
    except OSError as e:
        raise WrongUse(f"{click.format_filename(out)}: cannot be made: {e.strerror}") from e
    if not os.access(out, os.W_OK | os.X_OK):
        raise WrongUse(f"{click.format_filename(out)}: may not be written to")


def _missing(out: Path) -> list[Path]:
    """It and the folders above that are not there; none of a path that cannot be."""
    try:
        return [p for p in (out, *out.parents) if not p.exists()]
    except OSError:  # too long a name, or a folder that may not be looked into
        return []


@contextmanager
def writable(out: Path) -> Iterator[None]:
    """The folder, as by `make_writable`; if all fails before anything is in it, it goes again.

    So do the folders above that were made for it.
    """
    made = _missing(out)
    try:
        make_writable(out)
        yield
    except BaseException:  # Ctrl-C too
        for folder in made:
            with suppress(OSError):  # there is something in it, or it was not made
                folder.rmdir()
        raise


def is_log(path: Path) -> bool:
    """By its first bytes."""
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    try:
        detect(head, name="")
    except NotALog:
        return False
    return True
