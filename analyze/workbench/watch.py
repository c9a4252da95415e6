"""How far long work has come: a bar on a terminal, nothing where the output is piped."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Tell = Callable[[int, str], None]
"""(how many are done, what to say of the last)"""


@contextmanager
def watching(total: int | None, what: str, *, done: int = 0) -> Iterator[Tell]:
    """Yields what moves a bar over `total`, `done` of which were there before.

    Where `total` is None it only shows that it moves.
    """
    if not sys.stderr.isatty():
        yield lambda _done, _said: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn(what), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[said]}"),
        TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total, completed=done, said="")
        yield lambda now, said: bar.update(task, completed=now, said=said)
