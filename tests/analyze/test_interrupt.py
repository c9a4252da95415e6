"""Ctrl-C: put off, remembered, or a request."""

import signal
import sys

import pytest

from analyze.interrupt import asked_to_stop, held, remembered


def test_what_is_held_is_heard_at_the_end() -> None:
    done = []

    def imports() -> None:
        with held():
            signal.raise_signal(signal.SIGINT)
            done.append("all")

    with pytest.raises(KeyboardInterrupt):
        imports()
    assert done == ["all"]


def test_what_is_remembered_is_heard_at_once_and_known_later() -> None:
    with remembered() as interrupted:
        assert not interrupted()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert interrupted()


def test_what_a_finaliser_loses_is_known_and_not_reported() -> None:
    """The garbage collector runs those of other people's code at any moment."""

    class Interrupted:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    class Broken:
        def __del__(self) -> None:
            raise ValueError

    told: list[type[BaseException]] = []
    before, sys.unraisablehook = sys.unraisablehook, lambda lost: told.append(lost.exc_type)
    try:
        with remembered() as interrupted:
            Interrupted()
            assert interrupted()
            Broken()
    finally:
        sys.unraisablehook = before
    assert told == [ValueError]


def test_a_program_started_deaf_to_ctrl_c_stays_so() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        for how in (held(), remembered(), asked_to_stop("cycle")):
            with how as asked:
                signal.raise_signal(signal.SIGINT)
                assert not (asked and asked())
    finally:
        signal.signal(signal.SIGINT, before)
