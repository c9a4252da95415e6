"""The page in a real browser, cut off from the network."""

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from proof.page import proof_page
from reports.fleet import Failure, Fleet, fleet_page
from reports.fleet_flights import FleetFlight
from reports.flight_page import flight_page
from reports.mismatch import mismatch_page
from reports.render import render
from reports.results import result_of
from tests.proof.proof_example import proof as made_proof
from tests.reports import example
from tests.reports.mismatch_example import finding, pair
from tests.reports.mismatch_example import report as mismatch_report
from tests.reports.test_calibration_page import EVIL, found, renamed
from tests.reports.test_calibration_page import page as calibration_html
from twin.mismatch import Verdict
from twin.solution import Status

BROWSER = next(
    (p for name in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(name))),
    None,
)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium in the path")
PROBE = """<script>
const height = drawing => drawing.getBoundingClientRect().height;
document.title = [
  document.documentElement.scrollWidth - innerWidth,
  [...document.querySelectorAll("svg")].filter(drawing => height(drawing) < 40).length,
  performance.getEntriesByType("resource").length,
  document.querySelectorAll("figure").length,
].join();
</script>"""


def dom(folder: Path, html: str, width: int) -> str:
    page = folder / "page.html"
    page.write_text(html, encoding="utf-8")
    arguments = [
        str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic",
        "--no-first-run", "--disable-background-networking", "--disable-component-update",
        "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND",
        f"--user-data-dir={folder / 'profile'}", f"--window-size={width},900",
        "--dump-dom", page.as_uri(),
    ]  # fmt: skip
    run = subprocess.run(arguments, capture_output=True, text=True, check=True, timeout=120)
    return run.stdout


def flight() -> tuple[str, int]:
    """A page and the number of its drawings."""
    of = example.report(name=example.EVIL, damage=example.study(thorough=True))
    return render(flight_page(of)), 5


def calibration() -> tuple[str, int]:
    of = renamed(found(), EVIL)
    return calibration_html(of), len(of.fitted) + 5


def mismatch() -> tuple[str, int]:
    of = pair()
    courses = tuple(replace(c, name=EVIL) for c in of.courses)
    drawings = len(courses) + len(of.effects) + 2
    return render(mismatch_page(mismatch_report(replace(of, courses=courses)))), drawings


def proof() -> tuple[str, int]:
    page = proof_page(replace(made_proof(), command=EVIL))
    return render(page), sum(len(s.figures) for s in page.sections)


@pytest.mark.parametrize("made", [flight, calibration, mismatch, proof])
@pytest.mark.parametrize("width", [600, 1200])
def test_a_browser_lays_the_page_out_without_fetching_or_overflowing(
    tmp_path: Path, width: int, made: Callable[[], tuple[str, int]]
) -> None:
    html, drawings = made()
    probed = dom(tmp_path, html.replace("</body>", PROBE + "</body>"), width)
    title = re.search("<title>(.*?)</title>", probed)
    assert title is not None
    overflow, flat_drawings, fetched, figures = map(int, title.group(1).split(","))
    assert overflow <= 0
    assert (flat_drawings, fetched, figures) == (0, 0, drawings)


def fleet(name: str) -> str:
    """The page of a flight and a failure of long names, with as much in the row as there may be."""
    early = example.solution(Status.LOWER_CUT_OFF, 100)
    of = example.report(
        pack=replace(example.fitted_pack(), serial=""), played=early,
        mismatch=finding(Verdict.AMBIGUOUS),
    )  # fmt: skip
    flown = FleetFlight(folder="f", log=f"{name}.ulg", result=result_of(of))
    lost = Failure(file=f"{name}/{name}.ulg", code="no_current", reason="0 A all along")
    return render(
        fleet_page(Fleet(flights=(flown,), failures=(lost,), passed_over=0, version="0.1.0"))
    )


def test_the_table_of_a_fleet_needs_no_scroll_bar_at_1200_pixels(tmp_path: Path) -> None:
    probe = """<script>document.title = Math.max(...[...document.querySelectorAll(".wide")]
      .map(table => table.scrollWidth - table.clientWidth));</script>"""
    html = fleet("survey_north_field_2024_03_05_battery_A_run_17")
    probed = dom(tmp_path, html.replace("</body>", probe + "</body>"), 1200)
    assert "<title>0</title>" in probed
