"""The version of this program, and of the code that results come from."""

import hashlib
from functools import cache
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).parents[1]
OF_A_REPORT = ("analyze", "flightlogs", "reports", "segment", "twin")
"""Packages that results depend on."""


@cache
def version() -> str:
    """As installed."""
    return metadata.version("drone-battery-health")


@cache
def code_sha256(*packages: str) -> str:
    """`code_now`, as it was when it was first asked for."""
    return code_now(*packages)


def code_now(*packages: str) -> str:
    """Hash of all that is in `packages`: between two releases results change too."""
    files = (path for name in packages for path in (HERE / name).rglob("*") if path.is_file())
    told = hashlib.sha256()
    for path in sorted(path for path in files if path.suffix not in (".pyc", ".part")):
        told.update(path.relative_to(HERE).as_posix().encode() + b"\0" + path.read_bytes())
    return told.hexdigest()
