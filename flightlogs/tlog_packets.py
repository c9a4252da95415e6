"""Framing and columns of MAVLink telemetry: bytes -> `RawLog` with sender and time of each row.

A `.tlog` record is the 8-byte big-endian UNIX time in microseconds and a packet. Some ground
stations write the packets alone; both are read. Message layouts and checksums are pymavlink's; its
own reader fails on a raw stream without times, and decodes packet by packet.

Source: MAVLink serialization guide (packet formats v1 and v2), https://mavlink.io/en/guide/.
"""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from flightlogs.log import FloatArray
from flightlogs.table import RawLog, Strings, Table

V1, V2 = 0xFE, 0xFD
HEADER = {V1: 6, V2: 10}
CHECKSUM, SIGNATURE, SIGNED = 2, 13, 1
STAMP = 8
STAMP_COLUMN, SYSTEM, COMPONENT = "record_us", "system", "component"
CODES = {"float": "<f4", "double": "<f8", "char": "S"}
CODES |= {f"{u}int{b}_t": f"<{u or 'i'}{b // 8}" for u in ("", "u") for b in (8, 16, 32, 64)}
PROBE_BYTES = 65536  # noise before the first packet that is worth looking through


class Packet(NamedTuple):  # a frozen dataclass takes four times as long to make
    """Where a packet lies in the file.

    Attributes:
        at: offset of its first byte.
        header: bytes before the payload.
        payload: bytes of payload (v2 leaves out trailing zeros).
        stop: offset after it.
        message_id: which message.
        system: sender.
        component: sender's part.
    """

    at: int
    header: int
    payload: int
    stop: int
    message_id: int
    system: int
    component: int


def stop_of(data: bytes, at: int) -> int | None:
    """Offset after the packet that begins at one, beyond the file if it is cut; None: none does."""
    if at >= len(data) or data[at] not in HEADER:
        return None
    head = HEADER[data[at]]
    if at + head >= len(data):
        return len(data) + 1
    signature = SIGNATURE if data[at] == V2 and data[at + 2] & SIGNED else 0
    return at + head + data[at + 1] + CHECKSUM + signature


def packet_at(data: bytes, at: int) -> Packet | None:
    """The packet that begins at an offset, or None if none does that is whole."""
    stop = stop_of(data, at)
    if stop is None or stop > len(data):
        return None
    if data[at] == V1:
        number, system, component = data[at + 5], data[at + 3], data[at + 4]
    else:
        number = int.from_bytes(data[at + 7 : at + 10], "little")
        system, component = data[at + 5], data[at + 6]
    return Packet(at, HEADER[data[at]], data[at + 1], stop, number, system, component)


def is_sound(data: bytes, packet: Packet) -> bool | None:
    """Whether the checksum holds; None for a message pymavlink does not know."""
    known = mavlink.mavlink_map.get(packet.message_id)
    if known is None:
        return None
    end = packet.at + packet.header + packet.payload
    crc = mavlink.x25crc(data[packet.at + 1 : end] + bytes([known.crc_extra])).crc
    return bool(crc == int.from_bytes(data[end : end + CHECKSUM], "little"))


@dataclass(slots=True)
class _Scan:
    data: bytes
    gap: int  # bytes of time stamp before each packet
    found: defaultdict[int, list[Packet]] = field(default_factory=lambda: defaultdict(list))
    decoded_bytes: int = 0
    damaged_places: int = 0
    truncated: bool = False

    def run(self) -> None:
        """Find every packet whose checksum holds, or whose neighbour stands where it should."""
        at, chained = 0, True
        while at + self.gap < len(self.data):
            packet = packet_at(self.data, at + self.gap)
            if packet is None or not self._accepted(packet):
                if chained:
                    self.damaged_places += 1
                    self.truncated = (stop_of(self.data, at + self.gap) or 0) > len(self.data)
                at, chained = at + 1, False
                continue
            self.found[packet.message_id].append(packet)
            self.decoded_bytes += packet.stop - at
            at, chained, self.truncated = packet.stop, True, False
        if chained and at < len(self.data):  # part of a time stamp
            self.damaged_places, self.truncated = self.damaged_places + 1, True
        self.damaged_places -= self.truncated

    def _accepted(self, packet: Packet) -> bool:
        sound = is_sound(self.data, packet)
        if sound is not None:
            return sound
        following = packet.stop + self.gap
        return packet.stop == len(self.data) or packet_at(self.data, following) is not None


def stamp_bytes(data: bytes) -> int | None:
    """8 for a tlog, 0 for a bare stream of packets, None for neither.

    Decided by the first packet whose checksum holds: the next one begins right after it, or after
    the bytes of a time stamp. Where neither does, by what lies before it.
    """
    for at in range(min(len(data), PROBE_BYTES)):
        packet = packet_at(data, at) if data[at] in HEADER else None
        if packet is not None and is_sound(data, packet):
            for gap in (0, STAMP):
                following = packet_at(data, packet.stop + gap)
                if following is not None and is_sound(data, following) is not False:
                    return gap
            return STAMP if at >= STAMP else 0
    return None


def _dtype(message: Any) -> np.dtype[np.void]:
    """Layout of a payload on the wire, extension fields included."""
    types = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    rows = zip(message.ordered_fieldnames, message.array_lengths, strict=True)
    formats = [
        (name, f"S{n or 1}")
        if types[name] == "char"
        else ((name, CODES[types[name]], (n,)) if n else (name, CODES[types[name]]))
        for name, n in rows
    ]
    return np.dtype(formats)


def _table(data: bytes, packets: list[Packet], gap: int) -> Table:
    message = mavlink.mavlink_map[packets[0].message_id]
    dtype = _dtype(message)
    size = dtype.itemsize
    payload = b"".join(
        data[p.at + p.header : p.at + p.header + p.payload][:size].ljust(size, b"\0")
        for p in packets
    )
    rows = np.frombuffer(payload, dtype=dtype)
    numbers: dict[str, FloatArray] = {}
    texts: dict[str, Strings] = {}
    for name in message.fieldnames:
        if rows.dtype[name].kind == "S":
            texts[name] = tuple(v.split(b"\0")[0].decode("latin-1") for v in rows[name].tolist())
        else:
            with np.errstate(invalid="ignore"):  # PX4's integer parameters can be signalling NaNs
                numbers[name] = rows[name].astype(np.float64)
    numbers[SYSTEM] = np.array([p.system for p in packets], dtype=np.float64)
    numbers[COMPONENT] = np.array([p.component for p in packets], dtype=np.float64)
    if gap:
        stamps = [int.from_bytes(data[p.at - gap : p.at], "big") for p in packets]
        numbers[STAMP_COLUMN] = np.array(stamps, dtype=np.float64)
    types = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    offset = np.array([p.at for p in packets], dtype=np.int64)
    return Table(name=message.msgname, types=types, numbers=numbers, texts=texts, offset=offset)


def read_packets(data: bytes, gap: int, wanted: Callable[[str], bool]) -> RawLog:
    """Decode the packets of a file.

    Args:
        data: the whole file.
        gap: bytes of time stamp before each packet, as `stamp_bytes` found.
        wanted: whether a message type, by name, is decoded.
    """
    scan = _Scan(data, gap)
    scan.run()
    tables = {}
    for number, packets in scan.found.items():
        if number in mavlink.mavlink_map and wanted(mavlink.mavlink_map[number].msgname):
            table = _table(data, packets, gap)
            tables[table.name] = table
    return RawLog(
        tables=tables,
        decoded_bytes=scan.decoded_bytes,
        total_bytes=len(data),
        damaged_places=scan.damaged_places,
        truncated=scan.truncated,
    )
