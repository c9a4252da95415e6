"""The page of a folder: one row a flight, and what could not be analysed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import quote

from reports.apart import ends_apart
from reports.fleet_packs import packs_section
from reports.mismatch.words import missed
from reports.page import Page
from reports.parts import LoadPart, MotionPart
from reports.quantity import MISSING, fixed, minutes
from reports.result import Result
from reports.section import Cell, Column, Row, Section, Table

FLIGHT_COLUMNS = (
    Column(title="flight", numeric=False),
    Column(title="start (UTC)", numeric=False),
    Column(title="battery", numeric=False),
    Column(title="in flight [min:s]"),
    Column(title="charge [Ah]"),
    Column(title="hover [s]"),
    Column(title="vertical [s]"),
    Column(title="horizontal [s]"),
    Column(title="replay error, RMS [mV]"),
    Column(title="what the twin misses", numeric=False),
    Column(title="warnings"),
)
LEFT_OUT_COLUMNS = (
    Column(title="flight", numeric=False),
    Column(title="why", numeric=False),
)
FAILURE_COLUMNS = (
    Column(title="file", numeric=False),
    Column(title="reason", numeric=False, whole=True),
    Column(title="what it means", numeric=False),
)

LEFT_OUT = "Left out of time in flight and charge drawn"
SIMULATED = "simulated_log"  # the code of the warning


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetFlight:
    """An analysed flight.

    Attributes:
        folder: of its page, relative to the fleet's page.
        log: its path as the user would find it.
        result: the numbers.
    """

    folder: str
    log: str
    result: Result


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A log that was not analysed.

    Attributes:
        file: its path as the user would find it.
        code: stable name of the reason.
        reason: in words.
    """

    file: str
    code: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Fleet:
    """Everything found under the paths given.

    Attributes:
        flights: the analysed ones.
        failures: the others.
        passed_over: how many files were no logs.
        version: of the program.
    """

    flights: tuple[FleetFlight, ...]
    failures: tuple[Failure, ...]
    passed_over: int
    version: str


def fleet_page(fleet: Fleet) -> Page:
    """Packs, then flights in the order of their start; those without a date last, by name."""
    flights = sorted(fleet.flights, key=_order)
    packs = packs_section(_counted(flights)) if flights else None
    return Page(
        title="Fleet",
        subtitle=f"Logs analysed: {len(flights)}, not analysed: {len(fleet.failures)}",
        sections=(
            *((packs,) if packs and packs.tables else ()),
            Section(
                id="flights",
                title="Flights",
                notices=packs.notices if packs and not packs.tables else (),
                rows=_totals(flights, fleet.passed_over),
                tables=(*((_flights(flights),) if flights else ()), *_left_out(flights)),
            ),
            *((_failures(fleet.failures),) if fleet.failures else ()),
        ),
        version=fleet.version,
    )


def _order(flight: FleetFlight) -> tuple[bool, str, str]:
    start = flight.result.flight.start_utc
    return (start is None, start.isoformat() if start else "", flight.folder)


def names_of(flights: Sequence[FleetFlight]) -> tuple[str, ...]:
    """What each is called: its log, with as much of its path as tells it from the others."""
    ends = ends_apart(f.log for f in flights)
    return tuple(ends[f.log] for f in flights)


def left_out(flights: Sequence[FleetFlight]) -> tuple[str, ...]:
    """Why the totals are without each: simulated, a copy of another; "" for those that count.

    Of the copies of one log that counts whose current a sensor measured, else the first by folder.
    """
    ends = ends_apart(f.log for f in flights)
    counts: dict[str, FleetFlight] = {}
    for f in sorted(flights, key=lambda f: (f.result.quality.current_source != "sensor", f.folder)):
        counts.setdefault(f.result.flight.sha256, f)
    return tuple(_why_left_out(f, counts[f.result.flight.sha256], ends) for f in flights)


def _counted(flights: Sequence[FleetFlight]) -> list[Result]:
    """Results of those that are not left out."""
    both = zip(flights, left_out(flights), strict=True)
    return [f.result for f, without in both if not without]


def _why_left_out(flight: FleetFlight, counts: FleetFlight, ends: Mapping[str, str]) -> str:
    if any(w.code == SIMULATED for w in flight.result.quality.warnings):
        return "simulated"
    return "" if counts is flight else f"a copy of {ends[counts.log]}"


def charge_ah(segments: Sequence[LoadPart]) -> float:
    """Drawn in all of them."""
    return sum(s.charge_ah for s in segments)


def _totals(flights: Sequence[FleetFlight], passed_over: int) -> tuple[Row, ...]:
    why, counted = left_out(flights), _counted(flights)
    in_air_s = sum(r.flight.in_air_s for r in counted)
    charge = sum(charge_ah(r.segments) for r in counted)
    omitted, simulated = len(flights) - len(counted), why.count("simulated")
    note = f"copies: {omitted - simulated}, simulated: {simulated}; they stand below"
    return (
        Row(label="Time in flight", value=minutes(in_air_s), unit="min:s"),
        Row(label="Charge drawn", value=fixed(charge, 2), unit="Ah", note="in the segments"),
        *((Row(label="Left out of these", value=str(omitted), note=note),) if omitted else ()),
        Row(label="Files that are no logs", value=str(passed_over), note="passed over"),
    )


def _flights(flights: Sequence[FleetFlight]) -> Table:
    rows = tuple(map(_flight_row, flights, names_of(flights)))
    return Table(caption="Flights", columns=FLIGHT_COLUMNS, rows=rows)


def _flight_row(flight: FleetFlight, called: str) -> tuple[Cell, ...]:
    result = flight.result
    start, replay, motions = result.flight.start_utc, result.replay, result.motions
    stopped = "" if replay.status == "done" else " (ended early)"
    texts = (
        f"{start:%Y-%m-%d %H:%M}" if start else MISSING,
        result.pack.serial or result.pack.battery,
        minutes(result.flight.in_air_s),
        fixed(charge_ah(result.segments), 3),
        *(_time(part) for part in (motions.hover, motions.vertical, motions.horizontal)),
        fixed(replay.voltage_rmse_mv, 1) + stopped,
        missed(result.mismatch),
        str(len(result.quality.warnings)),
    )
    return (_link(flight, called), *(Cell(text=text) for text in texts))


def _link(flight: FleetFlight, called: str) -> Cell:
    return Cell(text=called, href=f"{quote(flight.folder, safe='')}/report.html")


def _left_out(flights: Sequence[FleetFlight]) -> tuple[Table, ...]:
    rows = tuple(
        (_link(flight, called), Cell(text=why))
        for flight, called, why in zip(flights, names_of(flights), left_out(flights), strict=True)
        if why
    )
    return (Table(caption=LEFT_OUT, columns=LEFT_OUT_COLUMNS, rows=rows),) if rows else ()


def _time(part: MotionPart | None) -> str:
    return MISSING if part is None else fixed(part.time_s, 0)


def _failures(failures: Sequence[Failure]) -> Section:
    rows = tuple((Cell(text=f.file), Cell(text=f.code), Cell(text=f.reason)) for f in failures)
    table = Table(caption="Logs that were not analysed", columns=FAILURE_COLUMNS, rows=rows)
    return Section(id="failures", title="Not analysed", tables=(table,))
