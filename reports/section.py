"""`Section`: one part of a page, with its content finished; the template only lays it out."""

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """How much a notice matters to whoever reads the page."""

    NOTE = "note"
    DOUBT = "doubt"


@dataclass(frozen=True, slots=True, kw_only=True)
class Notice:
    """A sentence that must not be overlooked.

    Attributes:
        text: the sentence.
        severity: how it is set.
        where: what it concerns, e.g. a topic or a time span; "" for everything.
        code: stable name of a warning, "" if it is none.
    """

    text: str
    severity: Severity = Severity.NOTE
    where: str = ""
    code: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One value with its name, rounded and ready to print.

    Attributes:
        label: what it is.
        value: the number or the words.
        sd: one standard deviation in the same unit, "" if none is known.
        unit: "" for words and pure numbers.
        note: why there is no uncertainty, or what else to know.
    """

    label: str
    value: str
    sd: str = ""
    unit: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column of a table.

    Attributes:
        title: with its unit.
        numeric: set flush right.
        whole: never broken into lines.
        wide: holds sentences.
    """

    title: str
    numeric: bool = True
    whole: bool = False
    wide: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A cell of a table.

    Attributes:
        text: of it.
        href: makes it a link, relative to the page.
        whole: what `text` is short for, shown when pointed at.
        doubt: set so that it is not overlooked.
    """

    text: str
    href: str = ""
    whole: str = ""
    doubt: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table; the first cell of a row names it.

    Attributes:
        caption: what it shows.
        columns: their titles with units.
        rows: as many cells as columns in each.
        folded: shown closed, for long tables.
    """

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    folded: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A drawing.

    Attributes:
        caption: stands below it.
        description: what a person who does not see it needs to know.
        svg: a complete `<svg>` element made by `plots`, without a prolog.
    """

    caption: str
    description: str
    svg: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One part of a page, laid out in the order of the fields.

    Attributes:
        id: anchor, unique on the page.
        title: heading.
        lead: paragraphs.
        notices: what must not be overlooked.
        rows: single values.
        figures: drawings.
        tables: tables.
        notes: small print.
    """

    id: str
    title: str
    lead: tuple[str, ...] = ()
    notices: tuple[Notice, ...] = ()
    rows: tuple[Row, ...] = ()
    figures: tuple[Figure, ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
