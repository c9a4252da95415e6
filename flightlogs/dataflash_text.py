"""Text DataFlash logs (`.log`): lines -> `RawLog`.

Each line is `NAME, value, value...`, described by FMT lines. Scaled formats (`c`, `C`, `e`, `E`,
`L`) are already printed in their unit; the others are as in the binary form. Parsed here because
pymavlink's text reader fails on logs whose FMT lines have an empty format (STRT of ArduCopter 3).
"""

import re
from collections import defaultdict

import numpy as np

from flightlogs.log import FloatArray
from flightlogs.table import RawLog, Strings, Table

FMT_LINE = re.compile(rb"^FMT, *\d+, *\d+, *\w+ *,", re.MULTILINE)
TEXT_FORMATS = frozenset("nNZM")
Rows = list[tuple[int, list[str]]]


def is_text(data: bytes) -> bool:
    """True if some line describes a message type in the DataFlash way."""
    return FMT_LINE.search(data) is not None


def _described(line: str) -> tuple[str, str, tuple[str, ...]]:
    """Name, format and labels from a FMT line."""
    fields = [f.strip() for f in line.split(",", 5)]
    name, format_, labels = (*fields[3:6], "", "", "")[:3]
    return name, format_, tuple(label.strip() for label in labels.split(",") if label.strip())


def _numbers(column: list[str]) -> FloatArray:
    """Values of a numeric column; NaN where a field is no number."""
    try:
        return np.array(column, dtype=np.float64)
    except ValueError:
        return np.array([_number(v) for v in column], dtype=np.float64)


def _number(printed: str) -> float:
    try:
        return float(printed)
    except ValueError:
        return float("nan")


def _table(name: str, format_: str, labels: tuple[str, ...], rows: Rows) -> Table:
    columns = dict(zip(labels, map(list, zip(*(r for _, r in rows), strict=True)), strict=True))
    types = dict(zip(labels, format_, strict=True))
    texts: dict[str, Strings] = {k: tuple(columns[k]) for k in labels if types[k] in TEXT_FORMATS}
    return Table(
        name=name,
        types=types,
        numbers={k: _numbers(columns[k]) for k in labels if types[k] not in TEXT_FORMATS},
        texts=texts,
        offset=np.array([at for at, _ in rows], dtype=np.int64),
    )


class _Lines:
    """Lines of a text log, sorted by message type."""

    def __init__(self) -> None:
        self.layouts: dict[str, tuple[str, tuple[str, ...]]] = {}
        self.rows: defaultdict[str, Rows] = defaultdict(list)
        self.banner: list[str] = []
        self.damaged_places = 0

    def take(self, at: int, line: str) -> bool:
        """True if the line was understood."""
        name = line.split(",", 1)[0].strip()
        if name == "FMT":
            described, format_, labels = _described(line)
            if len(format_) == len(labels):
                self.layouts[described] = (format_, labels)
            return True
        if name in self.layouts:
            return self._take_row(at, name, line)
        if not self.layouts:
            self.banner.append(line.strip())
        return not self.layouts or not line.strip()

    def _take_row(self, at: int, name: str, line: str) -> bool:
        format_, labels = self.layouts[name]
        fields = line.split(",", len(labels))[1:]  # a text in the last column may hold commas
        fields = [f.strip() for f in fields]
        if len(fields) == len(labels) and (
            format_.endswith("Z") or "," not in "".join(fields[-1:])
        ):
            self.rows[name].append((at, fields))
            return True
        return False


def read_text(data: bytes) -> RawLog:
    """Decode the lines of a file; what has no meaning is left out and counted by its bytes."""
    lines, decoded = _Lines(), 0
    for at, raw in enumerate(data.splitlines(keepends=True)):
        understood = lines.take(at, raw.decode("latin-1"))
        lines.damaged_places += not understood
        decoded += len(raw) if understood else 0
    tables = {name: _table(name, *lines.layouts[name], rows) for name, rows in lines.rows.items()}
    return RawLog(
        tables=tables,
        decoded_bytes=decoded,
        total_bytes=len(data),
        damaged_places=lines.damaged_places,
        banner=tuple(line for line in lines.banner if line),
    )
