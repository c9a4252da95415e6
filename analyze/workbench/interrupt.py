"""Ctrl-C as a request to stop at the next good place."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def asked_to_stop(after: str) -> Iterator[Callable[[], bool]]:
    """Yields what tells whether Ctrl-C was pressed; pressed again it ends the program at once.

    No exception is raised: one that meets CasADi at work is lost there (its functions return None
    instead), and what is being computed would be too.

    Args:
        after: what is finished first, for the message.
    """
    asked = False

    def note(_signal: int, _frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        text = f"\nStopping after this {after}; Ctrl-C again stops at once.\n"
        os.write(2, text.encode())  # a print within a print would fail

    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)
