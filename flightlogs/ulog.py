"""PX4 ULog files through pyulog: topics as arrays. The only place that knows pyulog."""

import contextlib
import io
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
import numpy.typing as npt
from pyulog import ULog
from pyulog.exceptions import ULogException

from flightlogs.detect import ULOG_MAGIC
from flightlogs.errors import LogDamaged, LogWarning, NotALog
from flightlogs.table import TRUNCATED, undecoded
from flightlogs.ulog_frames import HEADER_BYTES, Frames, walk

FLAGS_AT = slice(HEADER_BYTES, HEADER_BYTES + 43)
INCOMPATIBLE_AT = slice(11, 19)  # in the flag message
KNOWN_FLAGS = b"\x01" + bytes(7)  # data appended


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Topic:
    """All samples of one topic and instance, in file order, as logged.

    Attributes:
        name: uORB name.
        instance: multi id.
        stamp_us: (n,) microseconds, unrepaired.
        place: (n,) rank of each sample among all that were read, increasing.
        columns: field -> (n,) in the topic's own unit; `velocity[0]` for elements of arrays.
    """

    name: str
    instance: int
    stamp_us: npt.NDArray[np.uint64]
    place: npt.NDArray[np.int64]
    columns: Mapping[str, npt.NDArray[np.generic]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UlogFile:
    """What was read of a file.

    Attributes:
        info: information messages, e.g. `ver_hw`.
        parameters: at the start of the log.
        topics: the wanted ones that have samples, by name and instance.
        dropouts_s: time the logger says it lost.
        recovered_fraction: bytes in whole messages / file size.
        warnings: damage, truncation, appended data, dropouts.
    """

    info: Mapping[str, str | int]
    parameters: Mapping[str, float]
    topics: tuple[Topic, ...]
    dropouts_s: float
    recovered_fraction: float
    warnings: tuple[LogWarning, ...]


def read_topics(stream: BinaryIO, wanted: frozenset[str], *, name: str) -> UlogFile:
    """Read the wanted topics of a ULog, as far as the file is whole.

    Raises:
        NotALog: it does not begin as a ULog does.
        LogDamaged: too short, or written in a form that this program does not know.
    """
    content = stream.read()
    if not content.startswith(ULOG_MAGIC):
        raise NotALog(f"{name}: no ULog: expected it to start with {ULOG_MAGIC[:4]!r}")
    if len(content) < HEADER_BYTES:
        raise LogDamaged(f"{name}: ends inside the header: {len(content)} of {HEADER_BYTES} bytes")
    _refuse_unknown_flags(content[FLAGS_AT], name)
    frames = walk(content, wanted)
    header = content[:HEADER_BYTES]
    del content
    ulog = _parsed(header, frames, name)
    lost_ms = [d.duration for d in ulog.dropouts]
    return UlogFile(
        info={k: v for k, v in ulog.msg_info_dict.items() if isinstance(v, str | int)},
        parameters=_numbers(ulog.initial_parameters),
        topics=_topics(ulog, np.array(frames.order, dtype=np.int64)),
        dropouts_s=sum(lost_ms) * 1e-3,
        recovered_fraction=frames.decoded_bytes / frames.total_bytes,
        warnings=_warnings(frames, lost_ms),
    )


def _refuse_unknown_flags(message: bytes, name: str) -> None:
    flags = message[INCOMPATIBLE_AT]
    if message[2:3] == b"B" and any(f & ~k for f, k in zip(flags, KNOWN_FLAGS, strict=False)):
        raise LogDamaged(
            f"{name}: its flags {flags.hex()} announce a form of ULog that this program does not "
            "know: read it with a newer version, or the flag message is damaged"
        )


def _parsed(header: bytes, frames: Frames, name: str) -> ULog:
    parts = [header, *frames.definitions, *frames.subscriptions, *frames.data]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            return ULog(io.BytesIO(b"".join(parts)))
        except (ULogException, ValueError, KeyError, IndexError, struct.error) as e:
            raise LogDamaged(f"{name}: pyulog cannot read what is whole of it: {e}") from e


def _numbers(parameters: Mapping[str, object]) -> dict[str, float]:
    """Those that are finite numbers; a damaged type makes bytes of a parameter."""
    numbers = {k: float(v) for k, v in parameters.items() if isinstance(v, int | float)}
    return {k: v for k, v in numbers.items() if math.isfinite(v)}


def _topics(ulog: ULog, order: npt.NDArray[np.int64]) -> tuple[Topic, ...]:
    topics = []
    for data in ulog.data_list:
        place = np.flatnonzero(order == data.msg_id)
        stamps = data.data.get("timestamp")
        if stamps is not None and stamps.dtype == np.uint64 and stamps.size == place.size:
            topic = Topic(
                name=data.name,
                instance=data.multi_id,
                stamp_us=stamps,
                place=place,
                columns=data.data,
            )
            topics.append(topic)
    return tuple(topics)


def _warnings(frames: Frames, lost_ms: list[int]) -> tuple[LogWarning, ...]:
    damage = undecoded(frames.damaged_places, frames.decoded_bytes, frames.total_bytes)
    found = (
        (frames.damaged_places, "log_corrupt", damage),
        (frames.truncated, "log_truncated", TRUNCATED),
        (frames.appended, "log_appended_data", f"{frames.appended} pieces were appended after the "
         "regular end, as PX4 does after a crash of the autopilot"),
        (len(lost_ms), "log_dropouts", f"the logger lost {sum(lost_ms) * 1e-3:.2f} s in "
         f"{len(lost_ms)} dropouts, the longest {max(lost_ms, default=0) * 1e-3:.2f} s"),
    )  # fmt: skip
    return tuple(LogWarning(code, text, "file") for there, code, text in found if there)
