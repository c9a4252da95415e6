"""C code as a library that is compiled once: a cache by content.

The key is a hash of the C text, the compiler's version, the flags and what the processor can do.
Entries appear whole (compiled beside, then renamed), carry their own hash and are rebuilt when it
does not match, so several processes may start at once and a broken disk does no harm. The cache
keeps the MAX_ENTRIES last used.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import NamedTuple

NATIVE = "-march=native"
FLAGS = (
    NATIVE, "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-freciprocal-math",
    "-fassociative-math", "-fno-semantic-interposition", "-fPIC", "-shared",
)  # fmt: skip
"""Sums may be reordered, but a NaN stays a NaN (no -ffast-math): a step that fails must say so."""
LARGE = 500_000
"""Characters of C up to which -O2 pays: a step (300 000) takes 2.0 s instead of 1.4 s and runs 15 %
faster; the derivative of an ageing step (665 000) would take 6.0 s instead of 4.2 s."""
MAX_ENTRIES = 256
"""Of a quarter of a megabyte each. With 64, 30 of 195 compiled in a proof on real cells were there
before and forgotten."""
COMPILE_LIMIT_S = 120.0


class Compiler(NamedTuple):
    """A C compiler that answers: its path and the first line of its version."""

    path: str
    version: str


def cache_folder() -> Path:
    """Where libraries are kept: `DRONE_BATTERY_HEALTH_CACHE`, else the user's cache."""
    if chosen := os.environ.get("DRONE_BATTERY_HEALTH_CACHE"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "drone-battery-health"


@cache
def compiler() -> Compiler | None:
    """The C compiler of this machine, None if there is none."""
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        if name and (path := shutil.which(name)):
            try:
                answer = subprocess.run(
                    [path, "--version"], capture_output=True, text=True, check=True, timeout=20
                )
            except (OSError, subprocess.SubprocessError):
                continue
            return Compiler(path, answer.stdout.partition("\n")[0])
    return None


@cache
def _processor() -> str:
    """What -march=native looks at: a cache may be shared between machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    return "\n".join(sorted({s for s in lines if s.startswith(("flags", "Features", "model"))}))


def library(source: str, found: Compiler) -> Path:
    """The library of `source`; OSError or SubprocessError if it cannot be had."""
    flags = ("-O1" if len(source) > LARGE else "-O2", *FLAGS)
    text = "\0".join([source, found.version, *flags, _processor()])
    key = hashlib.sha256(text.encode()).hexdigest()[:32]
    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    return _valid_entry(folder, key) or _compile(folder, key, source, (found.path, *flags))


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _valid_entry(folder: Path, key: str) -> Path | None:
    """The cached library for `key` if its content has the hash in its name; others are removed."""
    for entry in folder.glob(f"{key}-*.so"):
        try:
            if entry.stem.rpartition("-")[2] == _digest(entry):
                entry.touch()
                return entry
            entry.unlink()
        except FileNotFoundError:  # another process was quicker
            continue
    return None


def _compile(folder: Path, key: str, source: str, command: tuple[str, ...]) -> Path:
    with tempfile.TemporaryDirectory(dir=folder, prefix="build-") as work:
        c_file, built = Path(work) / "kernel.c", Path(work) / "kernel.so"
        c_file.write_text(source)
        try:
            _run(command, c_file, built)
        except subprocess.CalledProcessError:  # not every compiler knows its own processor
            _run([word for word in command if word != NATIVE], c_file, built)
        entry = folder / f"{key}-{_digest(built)}.so"
        built.replace(entry)
    _forget_old(folder)
    return entry


def _run(command: Iterable[str], c_file: Path, built: Path) -> None:
    whole = [*command, str(c_file), "-o", str(built), "-lm"]
    subprocess.run(whole, check=True, capture_output=True, timeout=COMPILE_LIMIT_S)


def _forget_old(folder: Path) -> None:
    """Remove all but the MAX_ENTRIES last used; a library in use stays mapped."""
    ages = []
    for entry in folder.glob("*.so"):
        try:
            ages.append((entry.stat().st_mtime, entry))
        except FileNotFoundError:
            continue
    for _, entry in sorted(ages, reverse=True)[MAX_ENTRIES:]:
        entry.unlink(missing_ok=True)
