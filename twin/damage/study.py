"""All that is said of one flight's damage: `study` puts assessment, attribution and life together.

Quick: each motion beside constant currents, and the flight as flown. Thorough: every motion without
each of its features, how long the pack lasts, and by how much all of it changes in other packs that
may be this one.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from twin.damage.assess import Assessed, Assessment, Manoeuvre, Ratio, assess
from twin.damage.attribution import Attribution, Span, attribute
from twin.damage.cycles import CannotCycle, Protocol
from twin.damage.error import Error, together
from twin.damage.lives import Lives, Mix, project
from twin.damage.loss import Ledger
from twin.damage.measures import Part
from twin.load import Load
from twin.pack import Pack

CYCLES, SHORT_CYCLES = 2, 1
"""Twice as many change no ratio by more than 0.1 % (`python -m benchmarks.damage settle`)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Others:
    """Packs that may be the one at hand as well, for what is not known of it.

    Attributes:
        packs: with all its effects.
        of_cell: they differ in the numbers of the cell, as its calibration leaves them open; else
            those stay as they are, known or not.
        of_life: their constants of ageing differ as a fit to a life leaves them open; else as such
            constants differ from cell to cell.
    """

    packs: tuple[Pack, ...]
    of_cell: bool
    of_life: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """What a flight did to its pack.

    Attributes:
        assessment: each motion repeated, beside constant currents.
        attribution: the flight as it was flown.
        lives: only if it was thorough.
        cyclable_C: lithium in the particles of the new pack, which shares of it are of.
        others: which the intervals hold; None if they hold nothing of what is not known.
    """

    assessment: Assessment
    attribution: Attribution
    lives: Lives | None
    cyclable_C: float
    others: Others | None = None


def study(  # noqa: PLR0913
    pack: Pack,
    load: Load,
    manoeuvres: Sequence[Manoeuvre],
    spans: Sequence[Span],
    *,
    thorough: bool = False,
    others: Others | None = None,
) -> Study:
    """Of one flight.

    Args:
        pack: as it began the flight; effects of ageing it lacks are added with their defaults.
        load: of the flight.
        manoeuvres: its motions, one or more.
        spans: of the load, by motion.
        thorough: see above.
        others: packs that may be `pack` as well; only if thorough.

    Raises:
        CannotCycle: the pack cannot be cycled with constant currents like these, or be brought to
            the charge that the flight begins with.
    """
    protocol = Protocol(ambient_K=load.ambient_K, cycles=CYCLES)
    found = assess(pack, manoeuvres, protocol, counterfactuals=thorough)
    names = {m.name: m.waveform for m in manoeuvres if m.name in found.motions}
    flown = attribute(
        found.pack, load, spans, formed=found.baselines.reference.end_state, waveforms=names
    )
    lives = None
    if thorough:
        drawn_C = {name: cost.drawn_C for name, cost in flown.by_name().items()}
        packs = others.packs if others else ()
        mix = Mix(load=load, motions=found.motions, drawn_C=drawn_C)
        lives = project(found.pack, mix, others=packs)
        found = widened(found, packs) if packs else found
    return Study(
        assessment=found,
        attribution=flown,
        lives=lives,
        cyclable_C=Ledger(found.pack).cyclable_C,
        others=others if thorough else None,
    )


def widened(found: Assessment, others: Sequence[Pack]) -> Assessment:
    """`found`, its ratios as uncertain as `others`, which may be its pack as well, make them.

    Few cycles are enough for how much a ratio changes from pack to pack.
    """
    short = replace(found.protocol, cycles=SHORT_CYCLES)
    manoeuvres = [replace(m.manoeuvre, pieces=()) for m in found.motions.values()]
    if not manoeuvres:
        return found
    own = assess(found.pack, manoeuvres, short)
    beside = []
    for pack in others:
        with suppress(CannotCycle):  # a drawn pack may be too weak to fly like this
            beside.append(assess(pack, manoeuvres, short))
    motions = {name: _widened(m, own, beside) for name, m in found.motions.items()}
    return replace(found, motions=motions)


def _widened(m: Assessed, own: Assessment, beside: Sequence[Assessment]) -> Assessed:
    name = m.manoeuvre.name
    there = [b.motions[name] for b in beside if name in b.motions]
    if not there or name not in own.motions:
        return m

    def wide(kind: str) -> dict[Part, dict[str, Ratio]]:
        def of(a: Assessed, part: Part, measure: str) -> float:
            ratios: Mapping[Part, Mapping[str, Ratio]] = getattr(a, kind)
            return ratios[part][measure].value

        out: dict[Part, dict[str, Ratio]] = {}
        for part in Part:
            out[part] = {}
            for measure, ratio in getattr(m, kind)[part].items():
                first = of(own.motions[name], part, measure)
                away = np.array([of(a, part, measure) for a in there]) / first - 1
                away = away[np.isfinite(away)]  # of next to nothing a ratio says nothing
                square = float(np.sum(away**2)) / away.size if away.size else float("nan")
                error = Error(std=abs(ratio.value) * square**0.5, freedom=max(away.size, 1))
                out[part][measure] = replace(ratio, error=together(ratio.error, error))
        return out

    return replace(m, normalised=wide("normalised"), excess=wide("excess"))
