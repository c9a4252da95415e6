"""The version of this program."""

from functools import cache
from importlib import metadata


@cache
def version() -> str:
    """As installed."""
    return metadata.version("drone-battery-health")
