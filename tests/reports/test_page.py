"""The whole page: as it was when a person last looked at it, and safe from what logs contain.

`UPDATE_GOLDEN=1 python -m pytest tests/reports/test_page.py` renews the golden file; look at the
difference before committing it.
"""

import os
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from flightlogs.errors import LogWarning
from reports.flight_page import flight_page
from reports.render import render
from tests.reports import example
from twin.load import Load
from twin.replay import Replay

GOLDEN = Path(__file__).parent / "golden" / "flight.html"
DATE = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d")
DRAWING = re.compile(r"<svg .*?</svg>", re.DOTALL)  # differs between versions of matplotlib
VOID = {"meta", "link", "br", "hr", "img", "input", "path", "use"}


def page(**changes: object) -> str:
    return render(flight_page(example.report(**changes)))  # type: ignore[arg-type]


def test_the_page_is_as_it_was() -> None:
    scrubbed = DATE.sub("DATE", DRAWING.sub("<svg/>", page()))
    if os.environ.get("UPDATE_GOLDEN"):
        GOLDEN.write_text(scrubbed, encoding="utf-8")
    assert scrubbed == GOLDEN.read_text(encoding="utf-8")


class Balance(HTMLParser):
    """Collects tags that do not close, and what the page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.fetched: list[str] = []
        self.tags: set[str] = set()
        self.ids: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(str(value))
            if name in {"src", "href", "xlink:href"} and not str(value).startswith("#"):
                self.fetched.append(str(value))

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag


def parsed(html: str) -> Balance:
    balance = Balance()
    balance.feed(html)
    return balance


def test_the_page_closes_every_tag_fetches_nothing_and_runs_nothing() -> None:
    found = parsed(page())
    assert not found.open
    assert not found.fetched
    assert "script" not in found.tags
    assert len(found.ids) == len(set(found.ids))


def test_what_a_log_contains_is_text_and_nothing_else() -> None:
    warning = LogWarning("odd", 'a<img src=x onerror="alert(1)">', "<b>topic</b>")
    recording = example.recording(
        warnings=(warning,), battery="<i>pack</i>", setpoint_source="<u>s</u>"
    )
    log = replace(example.log(example.EVIL), firmware="<svg onload=alert(1)>", hardware="</table>")
    html = page(recording=recording, log=log)
    assert "script" not in parsed(html).tags
    assert parsed(html).tags == parsed(page()).tags
    assert "&lt;script&gt;" in html


def test_a_log_name_that_looks_like_a_template_is_not_run() -> None:
    assert "{{ 7 * 7 }}" in page(name="{{ 7 * 7 }}")


def test_the_page_of_a_long_flight_stays_small() -> None:
    """An hour at 10 Hz, noisy, which is the worst for drawings."""
    t = np.arange(0.0, 3600.0, 0.1)
    rng = np.random.default_rng(1)
    current = 20 + rng.normal(0, 5, t.size)
    recording = example.recording(
        time_s=t,
        current_A=current,
        voltage_V=16 - 0.03 * current,
        velocity_m_s=rng.normal(0, 1, (t.size, 3)),
        velocity_setpoint_m_s=rng.normal(0, 1, (t.size, 3)),
        in_air=np.ones(t.size, dtype=bool),
    )
    solution = replace(
        example.solution(),
        time_s=t,
        current_A=current,
        voltage_V=16.1 - 0.03 * current,
        temperature_K=298 + 0.001 * t,
        soc=1 - t / 4000,
        heat_W=current,
    )
    replay = Replay(
        load=Load(time_s=t, current_A=current),
        recorded_V=recording.voltage_V,
        judged=recording.in_air,
        solution=solution,
    )
    assert len(page(recording=recording, replay=replay).encode()) < 2_000_000


@pytest.mark.parametrize(
    "needed", ['scope="col"', "scope=row", "<caption", 'role="img"', 'lang="en"']
)
def test_the_page_can_be_read_aloud(needed: str) -> None:
    assert needed in page()
