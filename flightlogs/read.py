"""Any flight log -> `FlightLog`: the format is found in the bytes, its reader does the rest."""

from typing import BinaryIO

from flightlogs.detect import HEAD_BYTES, Format, detect
from flightlogs.log import FlightLog


def read_log(stream: BinaryIO, *, name: str) -> FlightLog:
    """Read a flight log of any known format.

    Readers are imported when they are needed: theirs are the slowest imports of the package.

    Args:
        stream: the file, seekable, read from its beginning.
        name: for messages; the extension does not matter.

    Raises:
        NotALog: no known format.
        LogDamaged: a known format, but nothing of use in it.
    """
    stream.seek(0)
    kind = detect(stream.read(HEAD_BYTES), name=name)
    stream.seek(0)
    if kind is Format.ULOG:
        from flightlogs.px4 import read_ulog

        return read_ulog(stream, name=name)
    if kind is Format.TLOG:
        from flightlogs.tlog import read_tlog

        return read_tlog(stream, name=name)
    if kind is Format.PX4LOG:
        from flightlogs.px4log import read_px4log

        return read_px4log(stream, name=name)
    from flightlogs.dataflash import read_dataflash

    return read_dataflash(stream, name=name)
