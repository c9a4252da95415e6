"""Packs of a fleet: how each was flown, what that cost, and what its flights tell of its health.

A pack is known by its serial number: of the log, of the pack file, or the folder that was said to
be one. Flights of a pack that nothing names are counted, not put together: a battery's place in the
vehicle is not the battery.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

from reports.mismatch.words import listed, missed, percent
from reports.parts.flight import QuantityPart
from reports.quantity import MISSING, fixed, minutes, significant
from reports.result import Result
from reports.section import Cell, Column, Notice, Section, Table

RETIRED = 0.8
"""Of the rated capacity: the end of a vehicle battery's life by the USABC Electric Vehicle Battery
Test Procedures Manual (1996)."""
TOLD = ("identified", "partly")  # verdicts of a fit on a number
SCALE = "current_scale_doubtful"  # code of a warning
SURELY = 1.64  # standard deviations below: 19 of 20 packs
CLEARLY = 0.05  # standard deviation over the number: what is known worse retires no pack
COLUMNS = (
    Column(title="pack", numeric=False),
    Column(title="flights"),
    Column(title="last flown", numeric=False),
    Column(title="in flight [min:s]"),
    Column(title="charge [Ah]"),
    Column(title="full cycles"),
    Column(title="capacity [Ah]"),
    Column(title="of rated [%]"),
    Column(title="resistance [mΩ]"),
    Column(title="lithium a flight costs [mAh]"),
    Column(title="what the twin misses", numeric=False),
)
NOTES = (
    "Capacity and resistance are those of the last flight that tells them, within "
    f"{percent(CLEARLY)}, and that was fitted without a pack file to a current whose scale is not "
    "doubtful: the capacity with its standard deviation beside the rated one, the resistance of "
    "the whole pack after 10 s of load, as warm "
    "as it was then, with how much more that is than by the first. Rated is what a parameter of "
    "the log or the pack file says; full cycles are the charge drawn over it. What a flight costs "
    "is by the twin, in the air, the mean of those that are here, each as it would cost a pack "
    "taken as new: one whose films are older loses less. What the twin misses is of the last.",
    "The pack with the least of its rated capacity comes first, those of which no flight tells it "
    f"last. With less than {percent(RETIRED)} a pack is usually retired; a slow discharge tells "
    "more than any flight (twin calibrate).",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownPack:
    """One pack, with its flights in the order in which they were flown.

    Attributes:
        serial: its number.
        results: of its flights.
    """

    serial: str
    results: tuple[Result, ...]

    def told(self, name: str) -> tuple[QuantityPart, ...]:
        """A number that was fitted to its flights, where they tell it CLEARLY.

        A current whose scale is doubtful tells neither capacity nor resistance.
        """
        sure = [r for r in self.results if SCALE not in {w.code for w in r.quality.warnings}]
        fits = [r.pack.fit for r in sure if r.pack.fit]
        own = [q for fit in fits for q in fit.quantities if q.name == name and q.verdict in TOLD]
        return tuple(q for q in own if q.std < CLEARLY * q.value)

    @property
    def rated_ah(self) -> float | None:
        """As the last flight states it which does: that of a cell that stands in is none."""
        stated = [r.pack.rated_ah for r in self.results if r.pack.rated_ah]
        return stated[-1] if stated else None

    @property
    def of_rated(self) -> float | None:
        """Share of it that the last flight tells which tells any."""
        told = self.told("capacity_C")
        return told[-1].value / 3600 / self.rated_ah if told and self.rated_ah else None

    @property
    def surely_worn(self) -> bool:
        """Less than RETIRED is left though its error be on the other side."""
        told = self.told("capacity_C")
        if not told or not self.rated_ah:
            return False
        return (told[-1].value + SURELY * told[-1].std) / 3600 < RETIRED * self.rated_ah

    @property
    def full_cycles(self) -> float | None:
        """That draw as much as the rated capacity, else the one that the last flight tells."""
        told = self.told("capacity_C")
        held_ah = self.rated_ah or (told[-1].value / 3600 if told else None)
        return self.charge_ah / held_ah if held_ah else None

    @property
    def charge_ah(self) -> float:
        """Drawn in the segments of its flights."""
        return sum(s.charge_ah for r in self.results for s in r.segments)

    @property
    def lost_mah(self) -> float | None:
        """Lithium lost in the air, mean of the flights that were judged; None where none was.

        No sum: each is judged as if the pack were new, and films grow ever more slowly.
        """
        each = [r.assessment.in_flight for r in self.results if r.assessment]
        lost = [loss.lithium_mah for loss in each if loss]
        return fmean(lost) if lost else None


def packs_of(results: Sequence[Result]) -> tuple[FlownPack, ...]:
    """The pack with least of its capacity first.

    Flights in the order of their start; those without a date first, as nothing says that they are
    the last.
    """
    by: dict[str, list[Result]] = {}
    for r in sorted(results, key=_begun):
        if r.pack.serial:
            by.setdefault(r.pack.serial, []).append(r)
    packs = (FlownPack(serial=k, results=tuple(v)) for k, v in by.items())
    return tuple(sorted(packs, key=lambda p: (p.of_rated is None, p.of_rated or 0.0, p.serial)))


def _begun(result: Result) -> tuple[bool, str]:
    start = result.flight.start_utc
    return start is not None, start.isoformat() if start else ""


def packs_section(results: Sequence[Result]) -> Section:
    """Of the flights that count."""
    packs = packs_of(results)
    unnamed = sum(not r.pack.serial for r in results)
    table = Table(caption="Packs, the weakest first", columns=COLUMNS, rows=tuple(map(_row, packs)))
    return Section(
        id="packs",
        title="Packs",
        notices=tuple(filter(None, (_worn(packs), _nameless(unnamed)))),
        tables=(table,) if packs else (),
        notes=NOTES if packs else (),
    )


def _worn(packs: Sequence[FlownPack]) -> Notice | None:
    less = [(p, p.of_rated) for p in packs if p.of_rated is not None and p.of_rated < RETIRED]
    said = []
    for what, sure in (("is left", True), ("may be left, within its error,", False)):
        told = [f"{p.serial} ({percent(share)})" for p, share in less if p.surely_worn is sure]
        if told:
            said.append(
                f"Less than {percent(RETIRED)} of the rated capacity {what} in: {listed(told)}."
            )
    return Notice(text=" ".join(said)) if said else None


def _nameless(flights: int) -> Notice | None:
    if not flights:
        return None
    return Notice(
        text=f"Flights whose pack is not known: {flights}. Put the logs of each pack in a folder "
        "of its own and use --pack-per-folder. A serial under [pack] in a pack file names the pack "
        "too, but no capacity or resistance is fitted to a flight with a pack file."
    )


def _row(pack: FlownPack) -> tuple[Cell, ...]:
    capacity, ohms, share = pack.told("capacity_C"), pack.told("pulse_ohm"), pack.of_rated
    start = pack.results[-1].flight.start_utc
    texts = (
        str(len(pack.results)),
        f"{start:%Y-%m-%d}" if start else MISSING,
        minutes(sum(r.flight.in_air_s for r in pack.results)),
        fixed(pack.charge_ah, 2),
        fixed(pack.full_cycles, 1),
        _with_error(capacity[-1]) if capacity else MISSING,
    )
    return (
        Cell(text=pack.serial),
        *(Cell(text=text) for text in texts),
        Cell(
            text=fixed(None if share is None else 100 * share, 0),
            doubt=share is not None and share < RETIRED,
        ),
        Cell(text=_since(ohms)),
        Cell(text=significant(pack.lost_mah, 2)),
        Cell(text=missed(pack.results[-1].mismatch)),
    )


def _since(ohms: Sequence[QuantityPart]) -> str:
    """The last resistance, and by how much it is more than the first."""
    if not ohms:
        return MISSING
    more = f" ({100 * (ohms[-1].value / ohms[0].value - 1):+.0f} %)" if len(ohms) > 1 else ""
    return fixed(1e3 * ohms[-1].value, 1) + more


def _with_error(capacity: QuantityPart) -> str:
    return f"{fixed(capacity.value / 3600, 3)} ± {fixed(capacity.std / 3600, 3)}"
