"""Framing and columns of binary DataFlash and sdlog2 files: bytes -> `RawLog`.

Both formats are records `A3 95 type payload`, described by FMT records in the file itself. The
meaning of the format characters is pymavlink's table; the framing is ours: pymavlink's DFReader
stops at the first unknown type, prints, needs a file on disk, decodes value by value, and does
not say how much of the file it used.
"""

import struct
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from pymavlink.DFReader import FORMAT_TO_STRUCT

from flightlogs.log import FloatArray
from flightlogs.table import RawLog, Strings, Table

HEAD = b"\xa3\x95"
FMT = 128
FMT_RECORD = struct.Struct("<BB4s16s64s")
FMT_LENGTH = 3 + FMT_RECORD.size
INT16_ARRAY = "a"  # not needed by any channel, and no number
PADDING = (b"\0", b"\xff")  # of the last page


@dataclass(frozen=True, slots=True)
class Layout:
    """What a FMT record says about a message type."""

    name: str
    length: int
    format: str
    labels: tuple[str, ...]

    def dtype(self) -> np.dtype[np.void] | None:
        """Layout of a payload, or None if the record contradicts itself."""
        if not set(self.format) <= set(FORMAT_TO_STRUCT) or len(self.labels) != len(self.format):
            return None
        codes = [FORMAT_TO_STRUCT[c][0] for c in self.format]
        codes = [f"S{code[:-1]}" if code.endswith("s") else f"<{code}" for code in codes]
        dtype = np.dtype({"names": list(self.labels), "formats": codes}, align=False)
        packed = sum(np.dtype(code).itemsize for code in codes)
        return dtype if packed == self.length - 3 and len(set(self.labels)) == len(codes) else None


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("latin-1")


def parse_fmt(payload: bytes) -> tuple[int, Layout]:
    """Message type and layout from the payload of a FMT record."""
    kind, length, name, format_, labels = FMT_RECORD.unpack(payload)
    columns = tuple(label.strip() for label in _text(labels).split(",")) if _text(labels) else ()
    return kind, Layout(_text(name), length, _text(format_), columns)


@dataclass(slots=True)
class _Scan:
    """Walk over the records of a file."""

    data: bytes
    layouts: dict[int, Layout] = field(default_factory=dict)
    lengths: list[int] = field(default_factory=lambda: [0] * 256)
    found: defaultdict[Layout, list[int]] = field(default_factory=lambda: defaultdict(list))
    decoded_bytes: int = 0
    damaged_places: int = 0
    truncated: bool = False

    def run(self) -> None:
        """Find every record that can be trusted."""
        self.lengths[FMT] = FMT_LENGTH
        data, head, lengths, end = self.data, HEAD, self.lengths, len(self.data)
        at, lost_at, chained = 0, end, True
        while at + 3 <= end:
            length = lengths[data[at + 2]] if data[at : at + 2] == head else 0
            stop = at + length
            followed = stop == end or data[stop : stop + 2] == head
            if length and stop <= end and (followed or (chained and self._whole(at, stop))):
                self._accept(at, length)
                at, chained, self.truncated = stop, True, False
                continue
            if chained:
                self.damaged_places, self.truncated = self.damaged_places + 1, stop > end
                lost_at = at
            at, chained = self._next_head(at + 1), False
        if chained and at < end:  # too few bytes to tell a type
            self.damaged_places, self.truncated = self.damaged_places + 1, data[at] == head[0]
            lost_at = at
        self.damaged_places -= self.truncated or _padded(data[lost_at:])

    def _whole(self, at: int, stop: int) -> bool:
        """False if bytes were lost inside the record, so that the next one begins within it."""
        return self.data.find(HEAD, at + 2, stop + 1) < 0

    def _next_head(self, at: int) -> int:
        found = self.data.find(HEAD, at)
        return found if found >= 0 else len(self.data)

    def _accept(self, at: int, length: int) -> None:
        kind = self.data[at + 2]
        self.decoded_bytes += length
        if kind != FMT:
            self.found[self.layouts[kind]].append(at)
            return
        described, layout = parse_fmt(self.data[at + 3 : at + FMT_LENGTH])
        if described != FMT and layout.length >= 3:
            self.layouts[described] = layout
            self.lengths[described] = layout.length


def _padded(rest: bytes) -> bool:
    """A logger filled its last page with one byte: nothing was lost."""
    return any(rest and not rest.strip(byte) for byte in PADDING)


def _column(values: np.ndarray[tuple[int], np.dtype[np.void]], char: str) -> FloatArray:
    factor = FORMAT_TO_STRUCT[char][1]
    with np.errstate(invalid="ignore"):  # damaged bytes can be a signalling NaN
        numbers = values.astype(np.float64)
    return numbers / round(1 / factor) if factor is not None else numbers


def _table(data: bytes, layout: Layout, at: list[int], labels: frozenset[str]) -> Table | None:
    dtype = layout.dtype()
    if dtype is None:
        return None
    offset = np.asarray(at, dtype=np.int64)
    raw = np.frombuffer(data, dtype=np.uint8)
    payload = raw[offset[:, None] + np.arange(3, layout.length)]
    rows = np.ascontiguousarray(payload).view(dtype).ravel()
    numbers: dict[str, FloatArray] = {}
    texts: dict[str, Strings] = {}
    for label, char in zip(layout.labels, layout.format, strict=True):
        if char == INT16_ARRAY or (labels and label not in labels):
            continue
        if rows.dtype[label].kind == "S":
            texts[label] = tuple(_text(v) for v in rows[label].tolist())
        else:
            numbers[label] = _column(rows[label], char)
    types = dict(zip(layout.labels, layout.format, strict=True))
    return Table(name=layout.name, types=types, numbers=numbers, texts=texts, offset=offset)


def read_binary(data: bytes, *, wanted: frozenset[str], clocks: frozenset[str]) -> RawLog:
    """Decode the records of a file.

    Args:
        data: the whole file.
        wanted: message types decoded in full.
        clocks: labels decoded for every other type, for the time base.

    Returns:
        The tables; a type described twice in different ways keeps the layout with more rows.
    """
    scan = _Scan(data)
    scan.run()
    tables: dict[str, Table] = {}
    for layout, at in scan.found.items():
        labels = frozenset[str]() if layout.name in wanted else clocks
        table = _table(data, layout, at, labels)
        if table is not None and len(table) > len(tables.get(layout.name, ())):
            tables[layout.name] = table
    return RawLog(
        tables=tables,
        decoded_bytes=scan.decoded_bytes,
        total_bytes=len(data),
        damaged_places=scan.damaged_places,
        truncated=scan.truncated,
    )


def is_binary(data: bytes) -> bool:
    """True if the file describes its own records in the DataFlash way."""
    return HEAD + bytes([FMT]) in data
