"""Tables on the terminal."""

from collections.abc import Iterable, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from reports.quantity import MISSING

WIDEST = 400  # no row is cut off: a terminal that is narrower breaks it


def print_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """The first column to the left, numbers to the right; no column of dashes alone."""
    body = list(rows)
    shown = [k for k in range(len(header)) if any(row[k] != MISSING for row in body)]
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for k in shown:
        table.add_column(header[k], justify="right" if k else "left", no_wrap=True)
    for row in body:
        table.add_row(*(row[k] for k in shown))
    needed = Console(width=WIDEST).measure(table).maximum
    terminal = Console()
    width = max(needed, terminal.width if terminal.is_terminal else 0)
    Console(highlight=False, width=width).print(table)
