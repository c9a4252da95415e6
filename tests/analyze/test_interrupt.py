"""Ctrl-C: put off, remembered, or a request."""

import signal

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


def test_a_program_started_deaf_to_ctrl_c_stays_so() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        for how in (held(), remembered(), asked_to_stop("cycle")):
            with how as asked:
                signal.raise_signal(signal.SIGINT)
                assert not (asked and asked())
    finally:
        signal.signal(signal.SIGINT, before)
