"""`Table`: the rows of one message type, as a log file holds them, before any meaning is given."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from flightlogs.errors import LogWarning
from flightlogs.log import FloatArray

Index = npt.NDArray[np.int64]
Strings = tuple[str, ...]
TRUNCATED = "ends inside a message: what came after is not known"


def undecoded(places: int, decoded_bytes: int, total_bytes: int) -> str:
    """Of a file with damaged places: how many, and what they cost."""
    missing = total_bytes - decoded_bytes
    return (
        f"damaged places: {places}; {missing} of {total_bytes} bytes "
        f"({missing / total_bytes:.2%}) could not be decoded"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """Rows of one message type in file order.

    Attributes:
        name: message type, e.g. `BAT`.
        types: label -> the format's own type character or name.
        numbers: label -> (n,) or (n, k) values as the format defines them, unscaled otherwise.
        texts: label -> n strings.
        offset: (n,) place of each row in the file: its byte offset, or its line in a text log.
    """

    name: str
    types: Mapping[str, str]
    numbers: Mapping[str, FloatArray]
    texts: Mapping[str, Strings]
    offset: Index

    def __len__(self) -> int:
        return int(self.offset.size)

    def select(self, rows: npt.NDArray[np.bool_]) -> "Table":
        """The rows where (n,) `rows` is true."""
        return Table(
            name=self.name,
            types=self.types,
            numbers={k: v[rows] for k, v in self.numbers.items()},
            texts={
                k: tuple(s for s, kept in zip(v, rows, strict=True) if kept)
                for k, v in self.texts.items()
            },
            offset=self.offset[rows],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawLog:
    """What was decoded of a file, and how much of it that is.

    Attributes:
        tables: message type -> its rows.
        banner: lines before the first message of a text log.
        decoded_bytes: bytes inside decoded messages.
        total_bytes: file size.
        damaged_places: stretches skipped because they decode to nothing.
        truncated: the file ends inside a message.
    """

    tables: Mapping[str, Table]
    decoded_bytes: int
    total_bytes: int
    damaged_places: int
    truncated: bool = False
    banner: Strings = field(default=())

    @property
    def recovered_fraction(self) -> float:
        """Share of the bytes that were decoded, 0..1."""
        return self.decoded_bytes / self.total_bytes if self.total_bytes else 0.0

    def warnings(self) -> tuple[LogWarning, ...]:
        """What could not be decoded."""
        found = []
        if self.damaged_places:
            text = undecoded(self.damaged_places, self.decoded_bytes, self.total_bytes)
            found.append(LogWarning("damaged", text, "file"))
        if self.truncated:
            found.append(LogWarning("log_truncated", TRUNCATED, "file"))
        return tuple(found)
