"""Tables on the terminal."""

from collections.abc import Iterable, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from reports.quantity import MISSING

PIPED_WIDTH = 160  # a file has no width: rows must not be broken there


def print_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """The first column to the left, numbers to the right; no column of dashes alone."""
    body = list(rows)
    shown = [k for k in range(len(header)) if any(row[k] != MISSING for row in body)]
    console = Console(highlight=False, soft_wrap=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=PIPED_WIDTH)
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for k in shown:
        table.add_column(header[k], justify="right" if k else "left", no_wrap=True)
    for row in body:
        table.add_row(*(row[k] for k in shown))
    console.print(table)
