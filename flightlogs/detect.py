"""Which format a file has, judged by its bytes and never by its name."""

import re
from collections.abc import Iterator
from enum import Enum
from itertools import islice, pairwise

from flightlogs.errors import NotALog

HEAD_BYTES = 1 << 16  # enough to pass the format table of a DataFlash log or a damaged beginning
ULOG_MAGIC = b"ULog\x01\x12\x35"
DATAFLASH_FMT = b"\xa3\x95\x80"
FMT_LABELS = slice(25, 89)  # after head 3, type 1, length 1, name 4, format 16
SDLOG2_CLOCK = b"StartTime"  # the one label of sdlog2's TIME record; ArduPilot stamps each record
TEXT_FMT = re.compile(rb"^FMT, *\d+, *\d+, *\w+, *\w+, *\S", re.MULTILINE)
MAVLINK = re.compile(rb"[\xfd\xfe\x55]")
MAVLINK_OVERHEAD = {0x55: 8, 0xFE: 8, 0xFD: 12}  # header and checksum of MAVLink 0.9, 1 and 2
SIGNATURE_BYTES, SIGNED = 13, 1
STAMP_BYTES = 8
CHAIN = 4  # packets in a row that fit each other: by chance once in 1e9 places
MAX_PAUSE_US = 3600 * 10**6  # between two packets of one recording
LFS = b"version https://git-lfs"
COMPRESSED = {
    b"\x1f\x8b": "gzip",
    b"PK\x03\x04": "zip",
    b"7z\xbc\xaf": "7-Zip",
    b"BZh": "bzip2",
} | {
    b"\xfd7zXZ": "xz",
    b"\x28\xb5\x2f\xfd": "Zstandard",
}


class Format(Enum):
    """File formats this package reads; the value stands in `FlightLog.format` and in reports."""

    ULOG = "ulog"
    TLOG = "tlog"
    DATAFLASH = "dataflash"
    DATAFLASH_TEXT = "dataflash_text"
    PX4LOG = "px4log"


def detect(head: bytes, *, name: str) -> Format:
    """Format of a log from its first bytes.

    Args:
        head: the first `HEAD_BYTES` of the file, or all of it.
        name: for the message; not used to decide.

    Raises:
        NotALog: none of the known formats; the text says what the bytes look like instead.
    """
    if head.startswith(ULOG_MAGIC):
        return Format.ULOG
    labels = [head[m.start() :][FMT_LABELS] for m in re.finditer(DATAFLASH_FMT, head)]
    if any(text.startswith(SDLOG2_CLOCK) for text in labels):
        return Format.PX4LOG
    if any(_is_label_list(text) for text in labels):
        return Format.DATAFLASH
    if TEXT_FMT.search(head):
        return Format.DATAFLASH_TEXT
    places = [m.start() for m in MAVLINK.finditer(head)]
    if any(_chain(head, at - STAMP_BYTES) for at in places if at >= STAMP_BYTES):
        return Format.TLOG
    if any(_bare_chain(head, at) for at in places):
        return Format.TLOG
    raise NotALog(
        f"{name}: {_impression(head)}; expected a PX4 ULog, a MAVLink .tlog, an ArduPilot "
        "DataFlash .bin or .log, or a PX4 .px4log"
    )


def _is_label_list(text: bytes) -> bool:
    return re.fullmatch(rb"[A-Za-z][\w,. ]*\0*", text) is not None


def _chain(head: bytes, start: int) -> bool:
    """True if stamped MAVLink packets follow each other from `start` with stamps that fit."""
    records = list(islice(_records(head, start, STAMP_BYTES), CHAIN))
    stamps = [int.from_bytes(head[at : at + STAMP_BYTES], "big") for at in records]
    steps = [b - a for a, b in pairwise(stamps)]
    return len(stamps) == CHAIN and all(abs(step) < MAX_PAUSE_US for step in steps)


def _bare_chain(head: bytes, start: int) -> bool:
    """True if packets without stamps follow each other from `start`, each with a right checksum."""
    records = list(islice(_records(head, start, 0), CHAIN))
    if len(records) < CHAIN:
        return False
    from flightlogs.tlog_packets import is_sound, packet_at  # late: it takes all of MAVLink with it

    packets = (packet_at(head, at) for at in records)
    return all(packet is not None and is_sound(head, packet) for packet in packets)


def _records(head: bytes, at: int, stamp_bytes: int) -> Iterator[int]:
    """Offsets of MAVLink packets that follow each other, `stamp_bytes` before each included."""
    while at + stamp_bytes + 3 <= len(head):
        magic, payload, flags = head[at + stamp_bytes : at + stamp_bytes + 3]
        if magic not in MAVLINK_OVERHEAD:
            return
        yield at
        signed = magic == 0xFD and flags & SIGNED
        at += stamp_bytes + MAVLINK_OVERHEAD[magic] + payload + SIGNATURE_BYTES * signed


def _impression(head: bytes) -> str:
    if not head:
        return "the file is empty"
    if head.startswith(LFS):
        return "a git-LFS pointer, not the log itself (fetch it with `git lfs pull`)"
    packed = next((kind for magic, kind in COMPRESSED.items() if head.startswith(magic)), None)
    if packed:
        return f"a {packed} archive (unpack it first)"
    if ULOG_MAGIC.startswith(head):
        return f"only the first {len(head)} bytes of a ULog"
    if not head.strip(b"\0"):
        return "nothing but zero bytes: the card was not written"
    if re.search(rb"[^\x09-\x0d\x20-\xff]", head):
        return f"no known log (it starts with {head[:8].hex(' ')})"
    return (
        "a text file that is no flight log (a current sensor's CSV lies beside the log as "
        "NAME.sensor.csv, or is given with --sensor)"
    )
