"""The page of a folder."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256

import pytest

from flightlogs.errors import LogWarning
from flightlogs.flight import choose_flight
from flightlogs.log import Interval
from reports.apart import ends_apart
from reports.fleet import Failure, Fleet, fleet_page
from reports.fleet_flights import FleetFlight, left_out
from reports.flight import NoMismatch
from reports.render import render
from reports.results import result_of
from reports.section import Section
from tests.reports import example
from tests.reports.mismatch_example import finding
from twin.mismatch import Verdict
from twin.solution import Status


def flight(folder: str, day: int | None, **changes: object) -> FleetFlight:
    start = None if day is None else datetime(2025, 6, day, tzinfo=UTC)
    log = replace(example.log(f"{folder}.ulg"), start_utc=start)
    made = example.report(log=log, **changes)
    own = replace(made.provenance, sha256=sha256(folder.encode()).hexdigest())
    result = result_of(replace(made, provenance=own))
    return FleetFlight(folder=folder, log=f"logs/{folder}.ulg", result=result)


def flights_of(fleet: Fleet) -> Section:
    return next(s for s in fleet_page(fleet).sections if s.id == "flights")


FLEET = Fleet(
    flights=(flight("b", None), flight("c 1%", 3), flight("a", 1)),
    failures=(Failure(file="logs/<x>.ulg", code="no_current", reason="0 A all along"),),
    passed_over=7,
    version="0.1.0",
)


def test_flights_stand_in_the_order_of_their_start_and_those_without_one_last() -> None:
    table = flights_of(FLEET).tables[0]
    assert [row[0].text for row in table.rows] == ["a.ulg", "c 1%.ulg", "b.ulg"]


def test_flights_of_one_name_are_told_apart_by_as_much_of_their_paths_as_it_takes() -> None:
    paths = ["x/day 1/a.ulg", "x/day 2/a.ulg", "y/day 2/a.ulg", "x/day 1/b.ulg", "b/b/b.ulg", "c"]
    ends = ["day 1/a.ulg", "x/day 2/a.ulg", "y/day 2/a.ulg", "day 1/b.ulg", "b/b.ulg", "c"]
    assert ends_apart(paths) == dict(zip(paths, ends, strict=True))
    assert ends_apart(["a.ulg", "x/a.ulg"]) == {"a.ulg": "a.ulg", "x/a.ulg": "x/a.ulg"}
    two = tuple(replace(flight(f"a{k}", k), log=f"logs/{k}/a.ulg") for k in (1, 2))
    table = flights_of(replace(FLEET, flights=two)).tables[0]
    assert [row[0].text for row in table.rows] == ["1/a.ulg", "2/a.ulg"]


def test_links_lead_to_the_pages_whatever_the_folder_is_called() -> None:
    assert 'href="c%201%25/report.html"' in render(fleet_page(FLEET))


def test_failures_are_listed_with_their_reason_and_escaped() -> None:
    html = render(fleet_page(FLEET))
    assert "logs/&lt;x&gt;.ulg" in html
    assert "no_current" in html
    assert "0 A all along" in html


def test_the_sums_are_those_of_the_flights() -> None:
    rows = {r.label: r.value for r in flights_of(FLEET).rows}
    assert rows["Time in flight"] == "2:18"
    assert rows["Files that are no logs"] == "7"


def copied(original: FleetFlight, folder: str) -> FleetFlight:
    return replace(original, folder=folder, log=f"logs/{folder}.ulg")


def test_copies_and_simulated_flights_are_named_and_not_summed() -> None:
    warning = LogWarning("simulated_log", "a simulated flight")
    simulated = flight("sitl", 2, recording=example.recording(warnings=(warning,)))
    real = flight("a", 1)
    flights = (copied(real, "b"), real, simulated, flight("d", 4), copied(simulated, "e"))
    section = flights_of(replace(FLEET, flights=flights))
    rows = {r.label: r for r in section.rows}
    assert rows["Time in flight"].value == "1:32"
    assert rows["Charge drawn"].value == "0.51"
    assert rows["Left out of these"].value == "3"
    assert rows["Left out of these"].note.startswith("copies: 1, simulated: 2;")
    assert len(section.tables[0].rows) == 5
    told = [(link.text, link.href, why.text) for link, why in section.tables[1].rows]
    assert told == [
        ("b.ulg", "b/report.html", "a copy of a.ulg"),
        ("e.ulg", "e/report.html", "simulated"),
        ("sitl.ulg", "sitl/report.html", "simulated"),
    ]


def test_of_copies_that_counts_whose_current_a_sensor_measured() -> None:
    by_sensor = flight("b", 1)
    alone = copied(flight("b", 1, recording=example.recording(current_source="autopilot")), "a")
    assert left_out((alone, by_sensor)) == ("a copy of b.ulg", "")
    assert left_out((by_sensor, alone)) == ("", "a copy of b.ulg")


def test_one_flight_in_two_logs_counts_once_and_the_log_on_board_is_the_one() -> None:
    """The ground station's clock is 2 s off, its telemetry draws 2 % less; no pack is named."""
    onboard, other_day = unnamed("b", 1), unnamed("c", 2)
    seen = telemetry(onboard, "a", late_s=2.0, less=0.02)
    assert left_out((seen, onboard, other_day)) == ("the same flight as b.ulg", "", "")
    rows = {r.label: r for r in flights_of(replace(FLEET, flights=(seen, onboard))).rows}
    assert rows["Time in flight"].value == "0:46"
    assert rows["Left out of these"].note == "the same flight in another log: 1; they stand below"


@pytest.mark.parametrize("changes", [{"late_s": 8.0}, {"less": 0.08}])
def test_what_began_or_drew_otherwise_is_another_flight(changes: dict[str, float]) -> None:
    onboard = unnamed("b", 1)
    assert left_out((telemetry(onboard, "a", **changes), onboard)) == ("", "")


def test_drones_of_a_swarm_are_not_one_flight() -> None:
    assert left_out((unnamed("a", 1), unnamed("b", 1))) == ("", "")


def test_a_pack_is_not_in_two_flights_at_once() -> None:
    """The clock of the ground station is 15 s off; 46 s are flown."""
    pack = replace(example.fitted_pack(), serial="7")
    onboard = flight("b", 1, pack=pack)
    assert left_out((onboard, telemetry(onboard, "a", late_s=15.0))) == (
        "", "the same flight as b.ulg",
    )  # fmt: skip
    assert left_out((onboard, telemetry(onboard, "a", late_s=30.0))) == ("", "")
    assert left_out((onboard, telemetry(onboard, "a", less=0.4))) == (
        "", "the same flight as b.ulg, or one of another pack",
    )  # fmt: skip
    undated = flight("c", None, pack=pack), flight("d", None, pack=pack)
    assert left_out(undated) == ("", "")


def unnamed(folder: str, day: int) -> FleetFlight:
    return flight(folder, day, pack=replace(example.fitted_pack(), serial=""))


def telemetry(
    of: FleetFlight, folder: str, *, late_s: float = 0.0, less: float = 0.0
) -> FleetFlight:
    """Of the same flight, by the clock and with the losses of a ground station."""
    flown, segments = of.result.flight, of.result.segments
    assert flown.start_utc is not None
    start = flown.start_utc + timedelta(seconds=late_s)
    part = flown.model_copy(update={"format": "tlog", "start_utc": start, "sha256": folder * 64})
    drawn = tuple(s.model_copy(update={"charge_ah": (1.0 - less) * s.charge_ah}) for s in segments)
    result = of.result.model_copy(update={"flight": part, "segments": drawn})
    return FleetFlight(folder=folder, log=f"logs/{folder}.tlog", result=result)


def test_flights_that_are_not_analysed_are_counted() -> None:
    """As `flightlogs` warns of them, of a log that counts."""
    armed, in_air = (Interval(1, 10), Interval(12, 48)), (Interval(2, 9), Interval(13, 47))
    (warning,) = choose_flight(replace(example.log(), armed=armed, in_air=in_air)).warnings
    several = flight("a", 1, recording=example.recording(warnings=(warning,)))
    section = flights_of(replace(FLEET, flights=(several, copied(several, "b"), flight("c", 3))))
    rows = {r.label: r.value for r in section.rows}
    assert rows["Flights that are not here"] == "1"
    assert "Flights that are not here" not in {r.label for r in flights_of(FLEET).rows}


def test_linked_folders_and_earlier_results_that_are_not_there_are_told() -> None:
    page = fleet_page(replace(FLEET, linked=2, earlier=3))
    assert (
        "Results of earlier runs that are not on this page: 3. It is of the logs" in page.subtitle
    )
    assert {r.label: r.value for r in page.sections[-2].rows}["Linked folders"] == "2"
    assert fleet_page(FLEET).subtitle == "Logs analysed: 3, not analysed: 1. "


def test_a_fleet_where_nothing_could_be_analysed_has_a_page() -> None:
    page = fleet_page(replace(FLEET, flights=()))
    assert "Logs analysed: 0, not analysed: 1" in render(page)


@pytest.mark.parametrize(
    ("found", "cell"),
    [
        (NoMismatch("too short"), "–"),
        (finding(Verdict.NONE), "nothing"),
        (finding(Verdict.UNKNOWN), "not known"),
        (finding(), "self-heating (98 %)"),
        (finding(Verdict.AMBIGUOUS), "not settled: self-heating (98 %)"),
    ],
)
def test_what_the_twin_misses_is_told_of_each_flight(found: object, cell: str) -> None:
    fleet = replace(FLEET, flights=(flight("a", 1, mismatch=found),))
    table = flights_of(fleet).tables[0]
    place = [c.title for c in table.columns].index("what the twin misses")
    assert table.rows[0][place].text == cell


def test_a_replay_that_ended_early_is_marked() -> None:
    early = flight("a", 1, played=example.solution(Status.LOWER_CUT_OFF, 100))
    table = flights_of(replace(FLEET, flights=(early,))).tables[0]
    assert table.rows[0][8].text.endswith("(ended early)")
