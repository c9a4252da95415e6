"""How the tests of the command write logs, call it, and look at what it made."""

import os
from pathlib import Path

from click.testing import CliRunner, Result

from analyze.__main__ import main

ULOG = b"ULog\x01\x12\x35\x01" + bytes(8)
FILES = {"report.html", "result.json", "segments.csv", "profile_hover.csv", "replay.parquet"}
PACK = '[pack]\nname = "a"\ncell = "lipo_2200"\nseries = 4\n'


def call(folder: Path, *arguments: str) -> Result:
    here = Path.cwd()
    os.chdir(folder)
    try:
        return CliRunner().invoke(main, list(arguments))
    finally:
        os.chdir(here)


def put(folder: Path, name: str, end: bytes = b"") -> None:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(ULOG + end)


def made(folder: Path) -> set[str]:
    return {p.name for p in folder.iterdir()}
