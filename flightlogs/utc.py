"""UNIX seconds -> an aware time, where they can be one."""

from datetime import UTC, datetime

EARLIEST = datetime(2005, 1, 1, tzinfo=UTC).timestamp()  # before any of these log formats
LATEST = datetime(2100, 1, 1, tzinfo=UTC).timestamp()


def utc_at(unix_s: float) -> datetime | None:
    """The moment, or None for a clock that was never set (or a stamp that was damaged)."""
    return datetime.fromtimestamp(unix_s, tz=UTC) if EARLIEST <= unix_s <= LATEST else None
