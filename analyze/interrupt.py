"""Ctrl-C where code that is not Python's is at work: an exception raised there may be lost.

CasADi gives None, or goes on, or raises something else; a compiled module that is being imported
may end the program.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

import click

Asked = Callable[[], bool]
"""Whether Ctrl-C was pressed."""


def leave_with(command: Callable[[], int]) -> NoReturn:
    """Run a command and leave the program with its exit code, 130 after Ctrl-C."""
    try:
        code = command()
    except KeyboardInterrupt:
        click.echo("Interrupted.", err=True)
        code = 130
    sys.exit(code)


def ignored() -> None:
    """In a worker: a terminal's Ctrl-C reaches it too, but it is the command that ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def held() -> Iterator[None]:
    """Ctrl-C is heard at the end of this; pressed again it ends the program."""
    with _noted(_deadly) as asked:
        yield
    if asked():
        raise KeyboardInterrupt


@contextmanager
def remembered() -> Iterator[Asked]:
    """Ctrl-C is heard at once, as ever, and can be asked for where the exception was lost.

    In a finaliser it always is: Python prints it there and goes on, here without printing it.
    """
    before = sys.unraisablehook

    def unraisable(lost: "sys.UnraisableHookArgs") -> None:
        if lost.exc_type is not KeyboardInterrupt:
            before(lost)

    sys.unraisablehook = unraisable
    try:
        with _noted(_interrupt) as asked:
            yield asked
    finally:
        sys.unraisablehook = before


@contextmanager
def asked_to_stop(after: str) -> Iterator[Asked]:
    """Ctrl-C is a request to stop at the next good place; pressed again it ends the program.

    Args:
        after: what is finished first, for the message.
    """

    def say() -> None:
        _deadly()
        text = f"\nStopping after this {after}; Ctrl-C again stops at once.\n"
        os.write(2, text.encode())  # a print within a print would fail

    with _noted(say) as asked:
        yield asked


@contextmanager
def _noted(then: Callable[[], None]) -> Iterator[Asked]:
    """Calls `then` at a Ctrl-C; not if the program was started deaf to it, as with `&`."""
    asked = False

    def note(_signal: int, _frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        then()

    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, note)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)


def _interrupt() -> None:
    raise KeyboardInterrupt


def _deadly() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
