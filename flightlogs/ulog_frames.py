"""The messages of a ULog file that are whole, and how much of the file they are.

pyulog tells neither how much it skipped nor where, and a damaged length makes it read on out of
step. So the file is walked here first: a message counts when its length fits what its type, or the
format of its topic, demands. What passes is handed on in order, without topics nobody asked for.

Source: https://docs.px4.io/main/en/dev_log/ulog_file_format.html
"""

import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

HEADER_BYTES = 16
HEAD = struct.Struct("<HB")
DATA_HEAD = struct.Struct("<HBH")
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
FLAG_BYTES, OFFSETS_AT, OFFSETS = 40, 16, struct.Struct("<3Q")
APPENDED = 1
LONGEST_TEXT = 1000  # bytes; PX4 cuts logged texts at 127
DATA = ord("D")
CANDIDATE = re.compile(rb"(?=..[ACDFILMOPQRS])", re.DOTALL)
CHAIN = 3  # whole messages in a row: by chance less than once in 1e9 places
DEEPEST = 8  # nesting of formats; PX4 has two
BASIC = {
    "bool": 1, "char": 1, "int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4,
    "uint32_t": 4, "float": 4, "int64_t": 8, "uint64_t": 8, "double": 8,
}  # fmt: skip
FIELD = re.compile(r"([A-Za-z_]\w*)(?:\[(\d{1,5})\])? (\w+)")
KEY = re.compile(rb"([A-Za-z]\w*)(\[\d+\])? [!-~]+")


@dataclass(slots=True)
class Frames:
    """What a walk over the file found.

    Attributes:
        definitions: formats, information and parameters, each a whole message.
        subscriptions: of the wanted topics.
        data: data messages of the wanted topics, dropouts; in file order.
        order: message id of each data message in `data`.
        decoded_bytes: bytes in whole messages, header included.
        total_bytes: file size.
        damaged_places: stretches that were skipped.
        truncated: the file ends inside a message.
        appended: pieces that the logger appended after a crash.
    """

    definitions: list[bytes] = field(default_factory=list)
    subscriptions: list[bytes] = field(default_factory=list)
    data: list[bytes] = field(default_factory=list)
    order: list[int] = field(default_factory=list)
    decoded_bytes: int = 0
    total_bytes: int = 0
    damaged_places: int = 0
    truncated: bool = False
    appended: int = 0


def walk(content: bytes, wanted: frozenset[str]) -> Frames:
    """Find every whole message of a ULog and keep those that serve the wanted topics.

    Args:
        content: the whole file.
        wanted: names of topics; `topic.field` wants the topic only where it has that field.
    """
    walker = _Walker(content, wanted)
    edges = [HEADER_BYTES, *walker.piece_edges(), len(content)]
    for start, stop in pairwise(edges):
        walker.piece(start, stop)
    return walker.frames


class _Walker:
    def __init__(self, content: bytes, wanted: frozenset[str]) -> None:
        self.content = content
        self.wanted = wanted
        self.frames = Frames(
            total_bytes=len(content), decoded_bytes=min(HEADER_BYTES, len(content))
        )
        self.formats: dict[str, str] = {}
        self.sizes: dict[
            int, tuple[int, int]
        ] = {}  # id -> body without and with padding at the end
        self.kept_ids: set[int] = set()
        self.takers: dict[int, Callable[[bytes, bytes], None]] = {
            ord("F"): self._take_format,
            ord("I"): self._take_definition,
            ord("P"): self._take_definition,
            ord("A"): self._take_subscription,
            ord("O"): self._take_dropout,
        }

    def piece_edges(self) -> Iterator[int]:
        """Offsets at which appended pieces start, as the flag message says."""
        body = self.content[HEADER_BYTES + HEAD.size :][:FLAG_BYTES]
        head = self.content[HEADER_BYTES : HEADER_BYTES + HEAD.size]
        if len(body) < FLAG_BYTES or head[2:] != b"B" or not body[8] & APPENDED:
            return
        edge = HEADER_BYTES + HEAD.size + FLAG_BYTES
        for offset in OFFSETS.unpack(body[OFFSETS_AT:]):
            if edge < offset < len(self.content):
                edge = offset
                self.frames.appended += 1
                yield offset
            elif offset:
                self.frames.damaged_places += 1

    def piece(self, start: int, stop: int) -> None:
        """Walk one contiguous piece of the file."""
        at = start
        last_piece = stop == len(self.content)
        while at < stop:
            at = self._run(at, stop)
            if at >= stop:
                return
            found = self._resynchronised(at + 1, stop)
            if found is None and self._is_cut_off(at, stop):
                self.frames.truncated |= last_piece  # an appended piece may follow a cut message
                return
            self.frames.damaged_places += 1
            at = stop if found is None else found

    def _run(self, at: int, stop: int) -> int:
        """Take whole messages from `at` on; the place of the first that is not."""
        content, sizes, kept, frames = self.content, self.sizes, self.kept_ids, self.frames
        last = stop - DATA_HEAD.size
        while at <= last:
            size, kind, message_id = DATA_HEAD.unpack_from(content, at)
            end = at + HEAD.size + size
            if kind == DATA:
                if end > stop or size not in sizes.get(message_id, ()):
                    return at
                if message_id in kept:
                    self._take_data(at, end, message_id)
            elif not self._whole(at, stop) or self._swallows(at, end, stop):
                return at
            elif taker := self.takers.get(kind):
                taker(content[at:end], content[at + HEAD.size : end])
            frames.decoded_bytes += end - at
            at = end
        return at

    def _whole(self, at: int, stop: int) -> bool:
        if at + HEAD.size > stop:
            return False
        size, kind = HEAD.unpack_from(self.content, at)
        end = at + HEAD.size + size
        if not size or end > stop:
            return False
        body = self.content[at + HEAD.size : end]
        if kind == DATA:
            return size in self.sizes.get(int.from_bytes(body[:2], "little"), ())
        check = CHECKS.get(kind)
        return check is not None and check(body)

    def _swallows(self, at: int, end: int, stop: int) -> bool:
        """True if a message of free length leads nowhere while whole ones begin inside it."""
        if end == stop or self._whole(end, stop) or self._is_cut_off(end, stop):
            return False
        return self._resynchronised(at + 1, stop, before=end) is not None

    def _resynchronised(self, at: int, stop: int, before: int | None = None) -> int | None:
        for found in CANDIDATE.finditer(self.content, at, before or stop):
            if self._chain(found.start(), stop):
                return found.start()
        return None

    def _is_cut_off(self, at: int, stop: int) -> bool:
        """True if a message that begins here would end beyond `stop`."""
        if stop - at < HEAD.size:
            return True
        size, kind = HEAD.unpack_from(self.content, at)
        return (kind == DATA or kind in CHECKS) and at + HEAD.size + size > stop

    def _chain(self, at: int, stop: int) -> bool:
        for _ in range(CHAIN):
            if not self._whole(at, stop):
                return False
            at += HEAD.size + HEAD.unpack_from(self.content, at)[0]
            if at == stop:
                return True
        return True

    def _take_data(self, at: int, end: int, message_id: int) -> None:
        bare = self.sizes[message_id][0]
        message = self.content[at:end]
        if end - at - HEAD.size > bare:
            message = HEAD.pack(bare, DATA) + message[HEAD.size : HEAD.size + bare]
        self.frames.data.append(message)
        self.frames.order.append(message_id)

    def _take_format(self, message: bytes, body: bytes) -> None:
        name, _, text = body.decode("ascii", "replace").partition(":")
        self.formats.setdefault(name, text)
        self.frames.definitions.append(message)

    def _take_definition(self, message: bytes, body: bytes) -> None:
        del body
        if not self.frames.data:  # a parameter changed in flight is no start value
            self.frames.definitions.append(message)

    def _take_dropout(self, message: bytes, body: bytes) -> None:
        del body
        self.frames.data.append(message)

    def _take_subscription(self, message: bytes, body: bytes) -> None:
        message_id, name = int.from_bytes(body[1:3], "little"), body[3:].decode("ascii", "replace")
        sizes = body_sizes(name, self.formats)
        if sizes is None or message_id in self.sizes:
            return
        self.sizes[message_id] = (2 + sizes[0], 2 + sizes[1])
        labels = [label for *_, label in FIELD.findall(self.formats[name])]
        if name in self.wanted or any(f"{name}.{label}" in self.wanted for label in labels):
            self.kept_ids.add(message_id)
            self.frames.subscriptions.append(message)


def body_sizes(name: str, formats: dict[str, str]) -> tuple[int, int] | None:
    """Bytes of a topic without and with the padding at its end; None if it is not defined."""
    fields = FIELD.findall(formats.get(name, ""))
    sizes = [_field_bytes(kind, length, formats, DEEPEST) for kind, length, _ in fields]
    if not sizes or None in sizes:
        return None
    known = [size for size in sizes if size is not None]
    padding = 0
    for (_, _, label), size in zip(reversed(fields), reversed(known), strict=True):
        if not label.startswith("_padding"):
            break
        padding += size
    return sum(known) - padding, sum(known)


def _field_bytes(kind: str, length: str, formats: dict[str, str], depth: int) -> int | None:
    count = int(length or 1)
    if kind in BASIC:
        return BASIC[kind] * count
    if not depth:
        return None
    inner = [
        _field_bytes(k, n, formats, depth - 1) for k, n, _ in FIELD.findall(formats.get(kind, ""))
    ]
    return None if not inner or None in inner else count * sum(size or 0 for size in inner)


def _is_keyed(body: bytes, skip: int = 0) -> bool:
    length = body[skip] if len(body) > skip else 0
    key = KEY.fullmatch(body, skip + 1, skip + 1 + length) if length else None
    if key is None or skip + 1 + length > len(body):
        return False
    size = BASIC.get(key[1].decode())
    return bool(key[2]) or size is None or len(body) == skip + 1 + length + size


def _is_format(body: bytes) -> bool:
    return re.fullmatch(rb"\w+:(?:[\w\[\]]+ \w+;)+", body) is not None


def _is_subscription(body: bytes) -> bool:
    return re.fullmatch(rb"...\w+", body, re.DOTALL) is not None


def _has(body: bytes, least: int, most: int) -> bool:
    return least <= len(body) <= most


CHECKS: dict[int, Callable[[bytes], bool]] = {
    ord("A"): _is_subscription,
    ord("B"): partial(_has, least=FLAG_BYTES, most=LONGEST_TEXT),
    ord("C"): partial(_has, least=11, most=LONGEST_TEXT),
    ord("F"): _is_format,
    ord("I"): _is_keyed,
    ord("L"): partial(_has, least=9, most=LONGEST_TEXT),
    ord("M"): partial(_is_keyed, skip=1),
    ord("O"): partial(_has, least=2, most=2),
    ord("P"): _is_keyed,
    ord("Q"): partial(_is_keyed, skip=1),
    ord("R"): partial(_has, least=2, most=2),
    ord("S"): SYNC.__eq__,
}
