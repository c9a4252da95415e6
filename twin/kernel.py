"""The step function as fast code: generated C where a compiler is present, CasADi's VM elsewhere.

Compiled kernels are cached by content: the key is a hash of the C text, the compiler's version and
the flags. Entries appear whole (compiled beside, then renamed), carry their own hash and are
rebuilt when it does not match, so several processes may start at once and a broken disk does no
harm. The cache keeps the MAX_ENTRIES last used.
"""

import hashlib
import os
import shutil
import subprocess
import tempfile
from enum import Enum
from functools import cache
from pathlib import Path

import casadi as ca

FLAGS = ("-O1", "-fPIC", "-shared")
"""-O2 and -O3 were measured to gain nothing on straight-line code and to compile up to twice as
long; no -march=native, since a cache may be shared between machines."""
MAX_ENTRIES = 64
COMPILE_LIMIT_S = 120.0


class Backend(Enum):
    """What runs the kernel; both give the same numbers (tests/twin/test_kernel.py)."""

    AUTO = "compiled where a C compiler is found"
    VIRTUAL_MACHINE = "CasADi's virtual machine"


def cache_folder() -> Path:
    """Where compiled kernels are kept: `DRONE_BATTERY_HEALTH_CACHE`, else the user's cache."""
    if chosen := os.environ.get("DRONE_BATTERY_HEALTH_CACHE"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "drone-battery-health"


@cache
def compiler() -> tuple[str, str] | None:
    """Path and version of the C compiler, None if there is none that answers."""
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        if name and (path := shutil.which(name)):
            try:
                answer = subprocess.run(
                    [path, "--version"], capture_output=True, text=True, check=True, timeout=20
                )
            except (OSError, subprocess.SubprocessError):
                continue
            return path, answer.stdout.partition("\n")[0]
    return None


def kernel(function: ca.Function, backend: Backend = Backend.AUTO) -> ca.Function:
    """`function` as compiled code, or as it is where that cannot be had."""
    found = compiler() if backend is Backend.AUTO else None
    if found is None:
        return function
    path, version = found
    source = _c_source(function)
    text = "\0".join([source, version, *FLAGS])
    key = hashlib.sha256(text.encode()).hexdigest()[:32]
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        library = _valid_entry(folder, key) or _compile(folder, key, source, path)
    except (OSError, subprocess.SubprocessError):
        return function  # read-only home, full disk, broken compiler: the same numbers, slower
    return ca.external(function.name(), str(library))


def _c_source(function: ca.Function) -> str:
    generator = ca.CodeGenerator(function.name(), {"with_header": False})
    generator.add(function)
    return str(generator.dump())


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


def _compile(folder: Path, key: str, source: str, compiler_path: str) -> Path:
    with tempfile.TemporaryDirectory(dir=folder, prefix="build-") as work:
        c_file, built = Path(work) / "kernel.c", Path(work) / "kernel.so"
        c_file.write_text(source)
        subprocess.run(
            [compiler_path, *FLAGS, str(c_file), "-o", str(built), "-lm"],
            check=True,
            capture_output=True,
            timeout=COMPILE_LIMIT_S,
        )
        entry = folder / f"{key}-{_digest(built)}.so"
        built.replace(entry)
    _forget_old(folder)
    return entry


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
