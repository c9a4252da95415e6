"""The page of a folder: one row a flight, and what could not be analysed."""

from collections.abc import Sequence
from dataclasses import dataclass

from reports.fleet_flights import (
    COPY,
    SAME,
    FleetFlight,
    charge_ah,
    counted,
    left_out,
    names_of,
    not_here,
)
from reports.fleet_packs import packs_section
from reports.mismatch.words import missed
from reports.page import Page
from reports.parts import MotionPart
from reports.quantity import MISSING, fixed, minutes
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
ALL = (
    "It is of the logs of one call: name all their folders in one, and what is up to date is kept, "
    "not analysed again."
)
ONE = "of a log with several flights one is analysed; its page says which"


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
        linked: how many linked folders were not searched.
        earlier: how many results of earlier runs lie beside these.
    """

    flights: tuple[FleetFlight, ...]
    failures: tuple[Failure, ...]
    passed_over: int
    version: str
    linked: int = 0
    earlier: int = 0


def fleet_page(fleet: Fleet) -> Page:
    """Packs, then flights in the order of their start; those without a date last, by name."""
    flights = sorted(fleet.flights, key=_order)
    packs = packs_section(counted(flights)) if flights else None
    return Page(
        title="Fleet",
        subtitle=f"Logs analysed: {len(flights)}, not analysed: {len(fleet.failures)}. "
        + earlier_results(fleet.earlier),
        sections=(
            *((packs,) if packs and packs.tables else ()),
            Section(
                id="flights",
                title="Flights",
                notices=packs.notices if packs and not packs.tables else (),
                rows=_totals(flights, fleet),
                tables=(*((_flights(flights),) if flights else ()), *_left_out(flights)),
            ),
            *((_failures(fleet.failures),) if fleet.failures else ()),
        ),
        version=fleet.version,
    )


def earlier_results(count: int) -> str:
    """In words; "" if there are none."""
    return f"Results of earlier runs that are not on this page: {count}. {ALL}" if count else ""


def _order(flight: FleetFlight) -> tuple[bool, str, str]:
    start = flight.result.flight.start_utc
    return (start is None, start.isoformat() if start else "", flight.folder)


def _totals(flights: Sequence[FleetFlight], fleet: Fleet) -> tuple[Row, ...]:
    count, why = counted(flights), left_out(flights)
    in_air_s = sum(f.result.flight.in_air_s for f in count)
    charge = sum(charge_ah(f.result.segments) for f in count)
    counts = (
        ("Left out of these", len(flights) - len(count), _kinds(why)),
        ("Flights that are not here", not_here(count), ONE),
        ("Linked folders", fleet.linked, "not searched: name them to search them"),
    )
    return (
        Row(label="Time in flight", value=minutes(in_air_s), unit="min:s"),
        Row(label="Charge drawn", value=fixed(charge, 2), unit="Ah", note="in the segments"),
        *(Row(label=label, value=str(n), note=note) for label, n, note in counts if n),
        Row(label="Files that are no logs", value=str(fleet.passed_over), note="passed over"),
    )


def _kinds(why: Sequence[str]) -> str:
    kinds = (("copies", COPY), ("the same flight in another log", SAME), ("simulated", "simulated"))
    counts = [(name, sum(w.startswith(begin) for w in why)) for name, begin in kinds]
    return f"{', '.join(f'{name}: {n}' for name, n in counts if n)}; they stand below"


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
    return Cell(text=called, href=flight.page)


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
