"""Text of a sensor's CSV -> columns of time, current and voltage; nothing is judged here yet."""

import csv
import re
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from flightlogs.errors import LogWarning, NotALog
from flightlogs.log import FloatArray

DELIMITERS = (";", "\t", "|", ",", " ")
COMMENTS = ("#", "%", "//")
HEADER_WITHIN = 20
"""Rows at the top among which the header is looked for."""
SAMPLE_ROWS = 50
NUMERIC_SHARE = 0.5
"""Of the rows at the top that must be numbers for a file to be a table."""
DAY_S = 86400.0
MOST_BACK, MOST_TURNS = 0.01, 0.1
"""Steps back of a clock (resets, damage): of all its steps, and of those forth."""
NOMINAL_STEP_S = 0.1
"""Of the module; decides the unit of a time column that names none."""
LARGEST_IN_A = 150.0
"""A 99th percentile beyond it, in a column without unit, means mA: the module ends at 100 A."""

TIME_UNITS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "µs", "μs", "usec", "micros", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanosecond", "nanoseconds"), 1e-9),
    **dict.fromkeys(("min", "minutes"), 60.0),
    **dict.fromkeys(("h", "hours"), 3600.0),
}
CURRENT_UNITS = {
    **dict.fromkeys(("a", "amp", "amps", "ampere", "amperes"), 1.0),
    **dict.fromkeys(("ma", "milliamp", "milliamps", "milliampere"), 1e-3),
    **dict.fromkeys(("ca", "centiamp", "centiamps", "centiampere"), 1e-2),
}
VOLTAGE_UNITS = {
    **dict.fromkeys(("v", "volt", "volts"), 1.0),
    **dict.fromkeys(("mv", "millivolt", "millivolts"), 1e-3),
}
TIME_WORDS = {"time", "timestamp", "t", "elapsed", "clock", "tick", "date", "datetime", "zeit"}
CURRENT_WORDS = {"current", "curr", "i", "ibat", "strom", "shunt"}
VOLTAGE_WORDS = {"voltage", "u", "vbat", "spannung", "pack"}
WHOLE_WORDS = {"total", "sum", "battery", "batt", "bat", "ibat", "pack", "main"}
"""Of a current: it is not that of one motor among several."""
NOT_MEASURED_WORDS = (
    {"limit", "lim", "set", "setpoint", "target", "demand"}
    | {"max", "maximum", "min", "minimum", "peak"}
    | {"avg", "average", "mean"}
)
"""A current or voltage so named is not what flows or stands there at that moment."""
OTHER_UNITS = {"c", "degc", "k", "w", "ah", "mah", "wh", "%", "hz", "rpm", "ohm"}
UNITS = OTHER_UNITS | TIME_UNITS.keys() | CURRENT_UNITS.keys() | VOLTAGE_UNITS.keys()
MISSING = {"", "nan", "na", "n/a", "null", "none", "-", "--"}
DATE_FORMATS = ("%d.%m.%Y %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%Y/%m/%d %H:%M:%S", "%H:%M:%S")


@dataclass(frozen=True, slots=True)
class Column:
    """Where a quantity is and the factor to SI; None where the header names no unit."""

    index: int
    name: str
    factor: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawTable:
    """The columns in SI, row by row as in the file, before any repair.

    Attributes:
        time_s: (n,) finite, on the file's own zero.
        current_A: (n,) sign as in the file, NaN where missing.
        voltage_V: (n,) or None.
        rows: data rows met.
        malformed: of these, rows that could not be read.
        repeated_headers: header lines after the first.
        cut: the file ends inside its last line.
        warnings: what had to be inferred.
    """

    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray | None
    rows: int
    malformed: int
    repeated_headers: int
    cut: bool
    warnings: tuple[LogWarning, ...]


def decode(data: bytes) -> str:
    """Text of the file; UTF-8 or UTF-16 by its mark, else UTF-8 with what does not fit replaced."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    return data.decode("utf-8-sig", errors="replace").replace("\x00", "")


def number(text: str) -> float | None:
    """A float with decimal point or comma; NaN for the words of MISSING; None for other text."""
    text = text.strip()
    if text.lower() in MISSING:
        return float("nan")
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None


def moment(text: str) -> float | None:
    """A date or a time of day as seconds; None if it is neither."""
    text = text.strip().replace(",", ".")
    try:
        stamp = datetime.fromisoformat(text)
    except ValueError:
        whole, _, fraction = text.partition(".") if text.count(".") <= 1 else text.rpartition(".")
        if text.count(".") == 2:  # 01.03.2024 12:00:00: the points belong to the date
            whole, fraction = text, ""
        for form in DATE_FORMATS:
            try:
                stamp = datetime.strptime(whole, form).replace(tzinfo=UTC)
            except ValueError:
                continue
            return stamp.timestamp() + float(f"0.{fraction}" if fraction.isdigit() else 0)
        return None
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()


def split(lines: list[str], delimiter: str) -> list[list[str]]:
    """Fields of each line; runs of blanks count as one delimiter."""
    if delimiter == " ":
        return [line.split() for line in lines]
    return [[f.strip() for f in row] for row in csv.reader(lines, delimiter=delimiter)]


def choose_delimiter(lines: list[str]) -> str | None:
    """The delimiter that makes most fields numbers in rows of equal length; None if none does."""
    best, best_score = None, NUMERIC_SHARE
    for delimiter in DELIMITERS:
        rows = split(lines, delimiter)
        widths = [len(row) for row in rows]
        usual = max(set(widths), key=widths.count)
        if usual < 2:
            continue
        fields = [f for row in rows if len(row) == usual for f in row]
        readable = sum(number(f) is not None or moment(f) is not None for f in fields)
        score = readable / len(fields) * widths.count(usual) / len(rows)
        if score > best_score + 1e-9:
            best, best_score = delimiter, score
    return best


def words(name: str) -> list[str]:
    """Lower-case words of a column's name: `timeMs`, `Test Time / s` and `t[ms]` fall apart."""
    apart = re.sub(r"(?<=[a-z]{2})(m?[A-Z])", r" \1", name)  # but mA stays mA
    return [w for w in re.split(r"[\s_/\[\](){}.,:;#-]+", apart.lower()) if w]


def column(index: int, name: str, quantity: set[str], units: dict[str, float]) -> Column | None:
    """The column if its name says this quantity, or nothing but a unit of it."""
    found = words(name)
    unit = next((units[w] for w in reversed(found) if w in units), None)
    foreign = unit is None and any(w in UNITS for w in found)
    named = any(w in quantity for w in found) and not foreign
    return Column(index, name, unit) if named or (unit is not None and len(found) == 1) else None


def columns(header: list[str]) -> dict[str, list[Column]]:
    """Columns of each quantity in the order of the file; a column counts for one only."""
    out: dict[str, list[Column]] = {"time": [], "current": [], "voltage": []}
    kinds = (
        ("time", TIME_WORDS, TIME_UNITS, set[str]()),
        ("current", CURRENT_WORDS, CURRENT_UNITS, VOLTAGE_WORDS - WHOLE_WORDS),
        ("voltage", VOLTAGE_WORDS, VOLTAGE_UNITS, {"shunt"}),  # that across it is not the pack's
    )
    for index, name in enumerate(header):
        for kind, quantity, units, never in kinds:
            c = column(index, name, quantity, units)
            if c is not None and never.isdisjoint(words(name)):
                out[kind].append(c)
                break
    return out


def likeliness(quantity: Column) -> tuple[bool, bool, bool]:
    """Of a column to be that of the pack: by what it says of itself, then by its unit."""
    found = words(quantity.name)
    measured = NOT_MEASURED_WORDS.isdisjoint(found)
    return measured, not WHOLE_WORDS.isdisjoint(found), quantity.factor is not None


def find_header(rows: list[list[str]], comments: list[str], delimiter: str) -> list[str] | None:
    """The row, or failing that the comment, that names a time and a current."""
    candidates = rows[:HEADER_WITHIN]
    candidates += [split([c.lstrip("#%/ ")], delimiter)[0] for c in comments[:HEADER_WITHIN] if c]
    for row in candidates:
        if all(number(f) is not None or moment(f) is not None for f in row):
            continue
        named = columns(row)
        if named["time"] and named["current"]:
            return row
    return None


def read_table(data: bytes, name: str) -> RawTable:
    """Recognise delimiter, header, units and decimal mark, and read the columns.

    Raises:
        NotALog: this is no table with a time and a current.
    """
    text = decode(data)
    try:
        rows, header = rows_of(text, name)
    except csv.Error as e:
        raise NotALog(
            f"{name}: line {unclosed(text)}: no table: {e}; expected a quote to be closed in the "
            "line it is opened in"
        ) from e
    body = [row for row in rows if row != header]
    if header is None:
        refuse_strange_header(body[0], name)
    cut = not text.endswith(("\n", "\r"))
    repeated = 0 if header is None else max(len(rows) - len(body) - 1, 0)
    return extract(body[:-1] if cut else body, header, name, repeated_headers=repeated, cut=cut)


def rows_of(text: str, name: str) -> tuple[list[list[str]], list[str] | None]:
    """Fields of each line that is no comment, and the header if there is one.

    Raises:
        NotALog: no delimiter makes a table of it.
        csv.Error: a field is too long for one.
    """
    lines = [line for line in text.splitlines() if line.strip()]
    comments = [line.strip() for line in lines if line.lstrip().startswith(COMMENTS)]
    lines = [line for line in lines if not line.lstrip().startswith(COMMENTS)]
    delimiter = choose_delimiter(lines[-SAMPLE_ROWS - 1 : -1] or lines) if lines else None
    if delimiter is None:
        raise NotALog(
            f"{name}: no table: expected lines of a time and a current, separated by one of "
            "; tab | , or blanks"
        )
    rows = split(lines, delimiter)
    return rows, find_header(rows, comments, delimiter)


def unclosed(text: str) -> int:
    """Number, from 1, of the first line with a quote too many; of the longest if none has one."""
    lines = text.splitlines()
    odd = (k for k, line in enumerate(lines) if line.count('"') % 2)
    return 1 + next(odd, max(range(len(lines)), key=lambda k: len(lines[k])))


def refuse_strange_header(first: list[str], name: str) -> None:
    """NotALog if the first row is words, none of which names what is looked for."""
    if all(number(f) is None and moment(f) is None for f in first):
        raise NotALog(
            f"{name}: the header {', '.join(first)} does not name both a time and a current; "
            "expected names with units such as time_ms and current_A"
        )


def values(body: list[list[str]], index: int) -> tuple[FloatArray, FloatArray]:
    """(n,) numbers of one column, NaN where missing, and (n,) 1.0 where the field is readable."""
    found = [number(row[index]) if len(row) > index else None for row in body]
    good = np.array([v is not None for v in found], dtype=float)
    return np.array([np.nan if v is None else v for v in found]), good


def extract(
    body: list[list[str]], header: list[str] | None, name: str, *, repeated_headers: int, cut: bool
) -> RawTable:
    """Columns of the body; a row without a readable stamp and current field is malformed."""
    if not body:
        raise NotALog(f"{name}: fewer than two rows with a time and a current")
    notes: list[LogWarning] = []
    named = columns(header) if header else guess_columns(body, notes, name)
    time_s = times(body, named["time"], notes, name)
    column = max(named["current"], key=likeliness)
    if len(named["current"]) > 1:
        others = ", ".join(c.name for c in named["current"] if c is not column)
        text = f"several columns name a current: {column.name} is used, not {others}"
        notes.append(LogWarning("several_currents", text, name))
    current, readable = values(body, column.index)
    keep = np.isfinite(time_s) & (readable > 0)
    if np.sum(keep) < 2:
        raise NotALog(f"{name}: fewer than two rows with a time and a current")
    voltage_V = None
    if named["voltage"]:
        voltage = max(named["voltage"], key=likeliness)
        voltage_V = (voltage.factor or 1.0) * values(body, voltage.index)[0][keep]
    return RawTable(
        time_s=time_s[keep],
        current_A=current[keep] * current_factor(column, current[keep], notes, name),
        voltage_V=voltage_V,
        rows=len(body) + cut,
        malformed=len(body) - int(np.sum(keep)) + cut,
        repeated_headers=repeated_headers,
        cut=cut,
        warnings=tuple(notes),
    )


def guess_columns(
    body: list[list[str]], notes: list[LogWarning], name: str
) -> dict[str, list[Column]]:
    """Without a header: time is the first column that only grows, current the first other one."""
    wide = max(len(row) for row in body)
    texts = [k for k in range(wide) if any(len(r) > k and number(r[k]) is None for r in body[:5])]
    growing = [k for k in set(range(wide)) - set(texts) if runs_on(values(body, k)[0])]
    dates = [k for k in texts if len(body[0]) > k and moment(body[0][k]) is not None]
    stamp = min(dates + growing, default=-1)
    others = [k for k in range(wide) if k != stamp and k not in texts]
    if stamp < 0 or not others:
        raise NotALog(f"{name}: no header, and no column that grows as a time does beside another")
    text = f"no header: column {stamp + 1} is taken for the time, {others[0] + 1} for the current"
    notes.append(LogWarning("no_header", text, name))
    return {
        "time": [Column(stamp, f"column {stamp + 1}", None)],
        "current": [Column(others[0], f"column {others[0] + 1}", None)],
        "voltage": [],
    }


def runs_on(raw: FloatArray) -> bool:
    """True for numbers that a clock may give: hardly ever less than the one before.

    A duration of something goes up and down, or stands still.
    """
    steps = np.diff(raw)
    steps = steps[np.isfinite(steps)]
    up, back = np.sum(steps > 0), np.sum(steps < 0)
    return bool(up > 0 and back < MOST_BACK * len(steps) and back < MOST_TURNS * up)


def times(
    body: list[list[str]], named: list[Column], notes: list[LogWarning], name: str
) -> FloatArray:
    """(n,) seconds, NaN where unreadable: of the numeric columns that run on the finest.

    Where none does, date and time of day; without these the finest numeric one however it runs.
    """
    numeric = [c for c in named if np.mean(values(body, c.index)[1]) > NUMERIC_SHARE]
    clocks = [c for c in numeric if runs_on(values(body, c.index)[0])]
    texts = [c for c in named if c not in numeric]
    time_s = moments(body, texts) if texts and not clocks else np.empty(0)
    if np.any(np.isfinite(time_s)):
        return time_s
    if numeric:
        best = min(clocks or numeric, key=lambda c: c.factor or 1.0)
        raw = values(body, best.index)[0]
        return raw * (best.factor or guess_time_factor(best, raw, notes, name))
    first = joined(body[0], texts)
    raise NotALog(f"{name}: the times read like {first!r}, neither a number nor a date")


def joined(row: list[str], texts: list[Column]) -> str:
    """The fields of these columns in one."""
    return " ".join(row[c.index] for c in texts if len(row) > c.index and row[c.index])


def moments(body: list[list[str]], texts: list[Column]) -> FloatArray:
    """(n,) seconds of dates and times of day, NaN where unreadable."""
    fields = [joined(row, texts) for row in body]
    found = [moment(f) for f in fields]
    time_s = np.array([np.nan if v is None else v for v in found])
    if all(len(f) <= len("00:00:00.000000") for f in fields[:5]):  # a time of day: past midnight
        known = np.isfinite(time_s)
        steps = np.diff(time_s[known], prepend=time_s[known][0])
        time_s[known] += DAY_S * np.cumsum(steps < -DAY_S / 2)
    return time_s


def guess_time_factor(column: Column, raw: FloatArray, notes: list[LogWarning], name: str) -> float:
    """The unit that brings the usual step closest to that of the module."""
    steps = np.diff(raw[np.isfinite(raw)])
    usual = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1.0
    unit = min(
        ("s", "ms", "us", "ns"), key=lambda u: abs(np.log(usual * TIME_UNITS[u] / NOMINAL_STEP_S))
    )
    text = f"{column.name} names no unit known here: steps of {usual:g} are taken for {unit}"
    notes.append(LogWarning("time_unit_inferred", text, name))
    return TIME_UNITS[unit]


def current_factor(column: Column, raw: FloatArray, notes: list[LogWarning], name: str) -> float:
    """Of the unit in the header; without one, A unless the values are too large for that."""
    if column.factor is not None:
        return column.factor
    sane = np.abs(raw[np.isfinite(raw)])
    unit = "mA" if sane.size and np.percentile(sane, 99) > LARGEST_IN_A else "A"
    text = f"{column.name} names no unit known here: taken for {unit}"
    notes.append(LogWarning("current_unit_inferred", text, name))
    return CURRENT_UNITS[unit.lower()]
