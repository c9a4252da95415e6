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
Layout = tuple[str, str, tuple[str, ...]]  # name, format, labels


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


def _table(layout: Layout, rows: Rows) -> Table:
    name, format_, labels = layout
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

    def __init__(self, wanted: frozenset[str]) -> None:
        self.wanted = wanted
        self.layouts: dict[str, Layout] = {}
        self.rows: defaultdict[Layout, Rows] = defaultdict(list)
        self.banner: list[str] = []
        self.damaged_places = 0

    def take(self, at: int, line: str) -> bool:
        """True if the line was understood."""
        name = line.split(",", 1)[0].strip()
        if name == "FMT":
            described, format_, labels = _described(line)
            if len(format_) == len(labels):
                self.layouts[described] = (described, format_, labels)
            return True
        if name in self.layouts:
            return self._take_row(at, name, line)
        if not self.layouts:
            self.banner.append(line.strip())
        return not self.layouts or not line.strip()

    def _take_row(self, at: int, name: str, line: str) -> bool:
        layout = self.layouts[name]
        _, format_, labels = layout
        if name not in self.wanted:
            return line.count(",") >= len(labels)
        fields = line.split(",", len(labels))[1:]  # a text in the last column may hold commas
        fields = [f.strip() for f in fields]
        if len(fields) == len(labels) and (
            format_.endswith("Z") or "," not in "".join(fields[-1:])
        ):
            self.rows[layout].append((at, fields))
            return True
        return False


def read_text(data: bytes, *, wanted: frozenset[str]) -> RawLog:
    """Decode the lines of the wanted types; what has no meaning is counted by its bytes.

    A type described twice in different ways keeps the layout with more rows.
    """
    lines, decoded, truncated = _Lines(wanted), 0, False
    for at, raw in enumerate(data.splitlines(keepends=True)):
        understood = lines.take(at, raw.decode("latin-1"))
        truncated = not understood and not raw.endswith((b"\n", b"\r"))  # the last line alone
        lines.damaged_places += not understood and not truncated
        decoded += len(raw) if understood else 0
    by_size = sorted(lines.rows.items(), key=lambda item: len(item[1]))
    tables = {layout[0]: _table(layout, rows) for layout, rows in by_size}
    return RawLog(
        tables=tables,
        decoded_bytes=decoded,
        total_bytes=len(data),
        damaged_places=lines.damaged_places,
        truncated=truncated,
        banner=tuple(line for line in lines.banner if line),
    )
