"""Packs of a fleet: how each was flown, what that cost, and what its flights tell of its health.

A pack is known by its serial number: of the log, of the pack file, or the folder that was said to
be one. Flights of a pack that nothing names are counted, not put together: a battery's place in the
vehicle is not the battery.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot
from statistics import fmean, median

from reports.fleet_flights import FleetFlight, charge_ah
from reports.mismatch.words import listed, missed, percent
from reports.parts.flight import QuantityPart
from reports.quantity import MISSING, fixed, minutes, significant
from reports.result import Result
from reports.section import Cell, Column, Notice, Section, Table
from twin.constants import ZERO_CELSIUS_K

RETIRED = 0.8
"""Of the rated capacity: the end of a vehicle battery's life by the USABC Electric Vehicle Battery
Test Procedures Manual (1996)."""
TOLD = ("identified", "partly")  # verdicts of a fit on a number
DISOWNED = {"current_scale_doubtful", "colder_than_board"}  # codes of warnings
SURELY = 1.64  # standard deviations below: 19 of 20 packs
CLEARLY = 0.05  # standard deviation over the number: what is known worse retires no pack
SCALE_STD = {"autopilot": 0.1, "sensor": 0.02}
"""Of the current, standard deviation of its scale, by what measured it. An autopilot's sensor that
nobody calibrated is often off by 5 to 20 %."""
AGREE = 2  # flights that must say so before a pack is retired, if there are as many
FEW = 5  # flights of which the median is told
AS_WARM_K = 3.0  # a pack that is this much colder has a tenth more resistance, or so
CAPACITY, RESISTANCE, START_K = "capacity_C", "pulse_ohm", "initial_K"  # names of what is fitted
COLUMNS = (
    Column(title="pack", numeric=False),
    Column(title="flights"),
    Column(title="last flown", numeric=False),
    Column(title="in flight [min:s]"),
    Column(title="charge [Ah]"),
    Column(title="full cycles"),
    Column(title="capacity [Ah]"),
    Column(title=f"by the last {FEW} flights [Ah]"),
    Column(title="of rated [%]"),
    Column(title="resistance [mΩ]"),
    Column(title="lithium a flight costs [mAh]"),
    Column(title="what the twin misses", numeric=False),
)
NOTES = (
    "Capacity and resistance are those of the last flight that tells them: within "
    f"{percent(CLEARLY)}, fitted without a pack file, with a current whose scale is not doubtful "
    "and no colder than the autopilot's board allows. The capacity leads to the page of that "
    f"flight; beside it stands the median of the last {FEW} flights that tell it (least to most). "
    "Its ± is what the fit leaves open; a current sensor that reads 10 % low makes it 10 % low as "
    "well. Rated is what a parameter of the log or the pack file says; full cycles are the charge "
    "drawn over it.",
    "The resistance is that of the whole pack after 10 s of load, with the temperature of the pack "
    "at take-off. A cold pack resists more, so the change is told since the first flight that was "
    f"as warm within {AS_WARM_K:g} °C, if there is one.",
    "What a flight costs is by the twin, in the air, the mean of those that are here, each as it "
    "would cost a pack taken as new: one whose films are older loses less. What the twin misses is "
    "of the last.",
    "The pack with the least of its rated capacity comes first, those of which no flight tells it "
    f"last. With less than {percent(RETIRED)} a pack is usually retired. It is said to be worn "
    f"only if the last {AGREE} flights that tell it agree, or there is only one, and if it has "
    "less even where the fit and the current sensor are off: the sensor by a standard deviation of "
    f"{percent(SCALE_STD['autopilot'])} (autopilot) or {percent(SCALE_STD['sensor'])} (a separate "
    f"one), both together {SURELY:g} times. A slow discharge tells more than any flight "
    "(twin calibrate).",
)
LOW_SENSOR = (
    "Or the current sensor of the vehicle reads low: then all packs that fly on it seem small. "
    "Compare the mAh that the charger puts back with the charge in the log, or fly a new pack on "
    "the same vehicle."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """A number of a pack, and the flight that tells it."""

    flight: FleetFlight
    quantity: QuantityPart

    @property
    def value(self) -> float:
        """As it was fitted."""
        return self.quantity.value

    @property
    def most(self) -> float:
        """That it may be, with the errors of fit and current sensor together on the other side."""
        scale = SCALE_STD[self.flight.result.quality.current_source]
        return self.value + SURELY * hypot(self.quantity.std, scale * self.value)

    @property
    def start_c(self) -> float | None:
        """How warm the pack was at the start; None where neither log nor fit tells."""
        fit = self.flight.result.pack.fit
        fitted = [q for q in fit.quantities if q.name == START_K] if fit else []
        if not fitted:  # measured
            return self.flight.result.provenance.parameters.initial_temperature_c
        return fitted[0].value - ZERO_CELSIUS_K if fitted[0].verdict in TOLD else None


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownPack:
    """One pack, with its flights in the order in which they were flown.

    Attributes:
        serial: its number.
        flights: of it.
    """

    serial: str
    flights: tuple[FleetFlight, ...]

    @property
    def results(self) -> tuple[Result, ...]:
        """Of its flights."""
        return tuple(f.result for f in self.flights)

    def told(self, name: str) -> tuple[Told, ...]:
        """A number that was fitted to its flights, where they tell it CLEARLY.

        Of a flight whose fit is doubtful in itself no number is told.
        """
        own = [
            Told(flight=f, quantity=q)
            for f in self.flights
            if f.result.pack.fit and not DISOWNED & {w.code for w in f.result.quality.warnings}
            for q in f.result.pack.fit.quantities
            if q.name == name and q.verdict in TOLD
        ]
        return tuple(t for t in own if t.quantity.std < CLEARLY * t.value)

    @property
    def rated_ah(self) -> float | None:
        """As the last flight states it which does: that of a cell that stands in is none."""
        stated = [r.pack.rated_ah for r in self.results if r.pack.rated_ah]
        return stated[-1] if stated else None

    @property
    def shares(self) -> tuple[float, ...]:
        """Of the rated capacity, by the last flights that tell it: as many as must AGREE."""
        rated_ah = self.rated_ah
        last = self.told(CAPACITY)[-AGREE:]
        return tuple(t.value / 3600 / rated_ah for t in last) if rated_ah else ()

    @property
    def of_rated(self) -> float | None:
        """Share of it that the last flight tells which tells any."""
        return self.shares[-1] if self.shares else None

    @property
    def surely_worn(self) -> bool:
        """Less than RETIRED is left by all flights that must AGREE, whatever their errors."""
        rated_ah, last = self.rated_ah, self.told(CAPACITY)[-AGREE:]
        if not last or not rated_ah:
            return False
        return all(t.most / 3600 < RETIRED * rated_ah for t in last)

    @property
    def full_cycles(self) -> float | None:
        """That draw as much as the rated capacity, else the one that the last flight tells."""
        told = self.told(CAPACITY)
        held_ah = self.rated_ah or (told[-1].value / 3600 if told else None)
        return self.charge_ah / held_ah if held_ah else None

    @property
    def charge_ah(self) -> float:
        """Drawn in the segments of its flights."""
        return sum(charge_ah(r.segments) for r in self.results)

    @property
    def lost_mah(self) -> float | None:
        """Lithium lost in the air, mean of the flights that were judged; None where none was.

        No sum: each is judged as if the pack were new, and films grow ever more slowly.
        """
        each = [r.assessment.in_flight for r in self.results if r.assessment]
        lost = [loss.lithium_mah for loss in each if loss]
        return fmean(lost) if lost else None


def packs_of(flights: Sequence[FleetFlight]) -> tuple[FlownPack, ...]:
    """The pack with least of its capacity first.

    Flights in the order of their start; those without a date first, as nothing says that they are
    the last.
    """
    by: dict[str, list[FleetFlight]] = {}
    for f in sorted(flights, key=_begun):
        if f.result.pack.serial:
            by.setdefault(f.result.pack.serial, []).append(f)
    packs = (FlownPack(serial=k, flights=tuple(v)) for k, v in by.items())
    return tuple(sorted(packs, key=lambda p: (p.of_rated is None, p.of_rated or 0.0, p.serial)))


def _begun(flight: FleetFlight) -> tuple[bool, str]:
    start = flight.result.flight.start_utc
    return start is not None, start.isoformat() if start else ""


def packs_section(flights: Sequence[FleetFlight]) -> Section:
    """Of the flights that count."""
    packs = packs_of(flights)
    unnamed = sum(not f.result.pack.serial for f in flights)
    table = Table(caption="Packs, the weakest first", columns=COLUMNS, rows=tuple(map(_row, packs)))
    return Section(
        id="packs",
        title="Packs",
        notices=tuple(filter(None, (_worn(packs), _nameless(unnamed)))),
        tables=(table,) if packs else (),
        notes=NOTES if packs else (),
    )


def _worn(packs: Sequence[FlownPack]) -> Notice | None:
    less = [p for p in packs if p.of_rated is not None and p.of_rated < RETIRED]
    said = []
    for what, sure in (("is left", True), ("may be left, within the errors,", False)):
        told = [f"{p.serial} ({_shares(p)})" for p in less if p.surely_worn is sure]
        if told:
            said.append(
                f"Less than {percent(RETIRED)} of the rated capacity {what} in: {listed(told)}."
            )
    last = [p.told(CAPACITY)[-1].flight.result for p in less]
    if any(r.quality.current_source == "autopilot" for r in last):
        said.append(LOW_SENSOR)
    return Notice(text=" ".join(said)) if said else None


def _shares(pack: FlownPack) -> str:
    """Of the last flight, and whether another agrees."""
    *before, last = (f"{fixed(100 * share, 0)} %" for share in pack.shares)
    if not before:
        return f"{last}, by one flight alone"
    return last if pack.shares[0] < RETIRED else f"{last}, but {before[0]} by the flight before"


def _nameless(flights: int) -> Notice | None:
    if not flights:
        return None
    return Notice(
        text=f"Flights whose pack is not known: {flights}. Put the logs of each pack in a folder "
        "of its own and use --pack-per-folder. A serial under [pack] in a pack file names the pack "
        "too, but no capacity or resistance is fitted to a flight with a pack file."
    )


def _row(pack: FlownPack) -> tuple[Cell, ...]:
    capacity, share = pack.told(CAPACITY), pack.of_rated
    texts = (
        str(len(pack.flights)),
        _date(pack.flights[-1]) or MISSING,
        minutes(sum(r.flight.in_air_s for r in pack.results)),
        fixed(pack.charge_ah, 2),
        fixed(pack.full_cycles, 1),
    )
    return (
        Cell(text=pack.serial),
        *(Cell(text=text) for text in texts),
        _linked(capacity[-1]) if capacity else Cell(text=MISSING),
        Cell(text=_few(capacity[-FEW:])),
        Cell(
            text=fixed(None if share is None else 100 * share, 0),
            doubt=share is not None and share < RETIRED,
        ),
        Cell(text=_since(pack.told(RESISTANCE))),
        Cell(text=significant(pack.lost_mah, 2)),
        Cell(text=missed(pack.results[-1].mismatch)),
    )


def _date(flight: FleetFlight) -> str:
    start = flight.result.flight.start_utc
    return f"{start:%Y-%m-%d}" if start else ""


def _linked(capacity: Told) -> Cell:
    """With the day of the flight, which it leads to."""
    error, day = fixed(capacity.quantity.std / 3600, 3), _date(capacity.flight)
    text = f"{fixed(capacity.value / 3600, 3)} ± {error}"
    return Cell(text=f"{text} ({day})" if day else text, href=capacity.flight.page)


def _few(capacities: Sequence[Told]) -> str:
    """Median and range, of more than one."""
    if len(capacities) < 2:
        return MISSING
    least, most = _ah(min, capacities), _ah(max, capacities)
    return f"{_ah(median, capacities)} ({least} to {most})"


def _ah(of: Callable[[list[float]], float], capacities: Sequence[Told]) -> str:
    return fixed(of([t.value for t in capacities]) / 3600, 2)


def _since(ohms: Sequence[Told]) -> str:
    """The last resistance, how warm it was, and how much more it is than the first as warm."""
    if not ohms:
        return MISSING
    last = ohms[-1]
    text = fixed(1e3 * last.value, 1)
    if (warm_c := last.start_c) is None:
        return text
    like = [t for t in ohms[:-1] if (c := t.start_c) is not None and abs(c - warm_c) <= AS_WARM_K]
    more = f", {100 * (last.value / like[0].value - 1):+.0f} %" if like else ""
    return f"{text} ({fixed(warm_c, 0)} °C{more})"
