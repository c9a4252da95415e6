"""The flights of a fleet: what each is called, and which are left out of the totals."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import quote

from reports.apart import ends_apart
from reports.parts import LoadPart
from reports.result import Result

SIMULATED, SEVERAL = "simulated_log", "several_flights"  # codes of warnings
COPY, SAME = "a copy of", "the same flight as"
TOGETHER = 0.5  # of the shorter flight: clocks that disagree by seconds make no two flights one
AT_ONCE_S = 5.0  # two logs of one take-off, each by its own clock
ALIKE = 0.05  # of duration and charge: telemetry is slower than the log on board


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

    @property
    def page(self) -> str:
        """Address of its page, as the fleet's page has it."""
        return f"{quote(self.folder, safe='')}/report.html"


def names_of(flights: Sequence[FleetFlight]) -> tuple[str, ...]:
    """What each is called: its log, with as much of its path as tells it from the others."""
    ends = ends_apart(f.log for f in flights)
    return tuple(ends[f.log] for f in flights)


def charge_ah(segments: Sequence[LoadPart]) -> float:
    """Drawn in all of them."""
    return sum(s.charge_ah for s in segments)


def not_here(flights: Sequence[FleetFlight]) -> int:
    """How many flights their logs have beside these: of each log one is analysed."""
    warnings = (w for f in flights for w in f.result.quality.warnings if w.code == SEVERAL)
    counts = (re.match(r"\d+", w.message) for w in warnings)
    return sum(int(count.group()) - 1 if count else 1 for count in counts)


def counted(flights: Sequence[FleetFlight]) -> tuple[FleetFlight, ...]:
    """Those that are not left out."""
    both = zip(flights, left_out(flights), strict=True)
    return tuple(f for f, without in both if not without)


def left_out(flights: Sequence[FleetFlight]) -> tuple[str, ...]:
    """Why the totals are without each; "" for those that count.

    It is simulated, or a copy of another log, or the flight is there in another log, as telemetry
    beside the log on board. Of these that counts whose current a sensor measured, else the log on
    board, else the first by folder.
    """
    ends = ends_apart(f.log for f in flights)
    why: dict[str, str] = {}
    count: list[_Flown] = []
    for flown in sorted(map(_Flown.of, flights), key=lambda flown: flown.rank):
        why[flown.flight.folder] = _why_left_out(flown, count, ends)
        if not why[flown.flight.folder]:
            count.append(flown)
    return tuple(why[f.folder] for f in flights)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Flown:
    """When a flight began and ended, in seconds of UTC, and what it drew.

    Both are 0 where the log has no date, or nothing of it is in the air.
    """

    flight: FleetFlight
    begin_s: float
    end_s: float
    charge_ah: float

    @classmethod
    def of(cls, flight: FleetFlight) -> "_Flown":
        result = flight.result
        start, air = result.flight.start_utc, [s for s in result.segments if s.motion != "ground"]
        dated = start is not None and bool(air)
        zero_s = start.timestamp() if start else 0.0
        return cls(
            flight=flight,
            begin_s=zero_s + air[0].start_s if dated else 0.0,
            end_s=zero_s + air[-1].stop_s if dated else 0.0,
            charge_ah=charge_ah(air),
        )

    @property
    def rank(self) -> tuple[bool, bool, str]:
        """The least is the one that counts."""
        of = self.flight.result
        return of.quality.current_source != "sensor", of.flight.format == "tlog", self.flight.folder

    def is_also(self, other: "_Flown") -> bool:
        """One pack is not in two flights at once; of one that is not named two formats agree."""
        both_s = min(self.end_s, other.end_s) - max(self.begin_s, other.begin_s)
        if both_s <= TOGETHER * min(self.duration_s, other.duration_s):
            return False
        a, b = self.flight.result, other.flight.result
        if a.pack.serial and a.pack.serial == b.pack.serial:
            return True
        swarm = a.flight.format == b.flight.format  # its drones take off at once, too
        return not swarm and abs(self.begin_s - other.begin_s) <= AT_ONCE_S and self.is_like(other)

    def is_like(self, other: "_Flown") -> bool:
        """It lasted as long and drew as much."""
        durations, charges = (
            (self.duration_s, other.duration_s),
            (self.charge_ah, other.charge_ah),
        )
        return all(max(two) - min(two) <= ALIKE * max(two) for two in (durations, charges))

    @property
    def duration_s(self) -> float:
        """From take-off to landing."""
        return self.end_s - self.begin_s


def _why_left_out(flown: _Flown, count: Sequence[_Flown], ends: Mapping[str, str]) -> str:
    result = flown.flight.result
    if any(w.code == SIMULATED for w in result.quality.warnings):
        return "simulated"
    for other in count:
        if other.flight.result.flight.sha256 == result.flight.sha256:
            return f"{COPY} {ends[other.flight.log]}"
        if flown.is_also(other):
            doubt = "" if flown.is_like(other) else ", or one of another pack"
            return f"{SAME} {ends[other.flight.log]}{doubt}"
    return ""
