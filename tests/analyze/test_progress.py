"""The bar shares the terminal with the lines."""

import io
import sys

import pytest

from analyze.progress import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown(monkeypatch: pytest.MonkeyPatch, terminal: io.StringIO, *, wanted: bool) -> str:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress(2, wanted=wanted) as step:
        for name in ("first", "second"):
            with step():
                terminal.write(f"<{name}>\n")
    return terminal.getvalue()


def test_a_line_starts_where_the_bar_was_cleared(monkeypatch) -> None:
    text = shown(monkeypatch, Terminal(), wanted=True)
    assert "0/2" in text
    for name in ("first", "second"):
        before = text[: text.index(f"<{name}>")]
        assert before.endswith("\x1b[2K"), repr(before[-40:])


@pytest.mark.parametrize(("kind", "wanted"), [(io.StringIO, True), (Terminal, False)])
def test_nothing_is_drawn_where_it_is_piped_or_not_wanted(monkeypatch, kind, wanted) -> None:
    assert shown(monkeypatch, kind(), wanted=wanted) == "<first>\n<second>\n"
