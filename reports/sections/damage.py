"""What each motion did to the battery."""

from collections.abc import Sequence

from reports.damage import FLIGHT, MAH, not_assessed
from reports.damage_lives import life_notes, life_rows, life_tables
from reports.damage_plots import TITLES, course_svg, normalised_svg
from reports.damage_tables import in_words, name_of, tables_of
from reports.flight import FlightReport
from reports.quantity import fixed, significant
from reports.section import Figure, Notice, Section, Severity
from segment.segment import Motion
from twin.damage import Assessed, Attribution, Part, Ratio, Study
from twin.effects import AGEING
from twin.solution import Status

FAST_LOSS = 1e-3  # of the material in a flight: a cell that lost so much would last 200 flights
NOTES = (
    "Each motion's periodic profile is flown from full to the cut-off and recharged (constant "
    "current of 1C, then constant voltage, no rest), again and again; so are the constant "
    "currents. Lithium lost is what does not return: bound in SEI and SEI on cracks, plated and "
    "cut off, or trapped in lost active material.",
    "SEI is a film on the negative electrode that binds lithium and grows with time, faster where "
    "it is warm or has cracked (on cracks). Plating: lithium that lies on that electrode as metal "
    "instead of going in, mostly when charged in the cold. Active material is what stores lithium; "
    "what breaks off stores none. Tension and pressure are what it swells and shrinks against; the "
    "margin is how far the electrode stays from plating.",
)
SPREAD = (
    "± is half of the 95 % interval (Student's t): how the segments of a motion differ, each flown "
    "by itself, what the profile misses of them, 0.1 % of the steps"
)


def damage(report: FlightReport) -> Section | None:
    """None if nothing was tried."""
    study = report.damage
    if study is None:
        if not report.no_damage:
            return None
        doubt = Notice(text=report.no_damage, severity=Severity.DOUBT, code="no_damage")
        return Section(id="damage", title="What each motion did to the battery", notices=(doubt,))
    return Section(
        id="damage",
        title="What each motion did to the battery",
        lead=_lead(study),
        notices=_notices(study),
        rows=life_rows(study.lives) if study.lives else (),
        figures=_figures(study),
        tables=(*tables_of(study), *life_tables(study)),
        notes=(*NOTES, _spread(study), *life_notes(study)),
    )


def _spread(study: Study) -> str:
    """What the intervals of ratios hold."""
    if study.others is None:
        return (
            f"{SPREAD}. What is not known of the cell and of the constants of ageing is not in it "
            "(--thorough adds it): it largely cancels in ratios, not at all in absolute figures."
        )
    held = "the numbers of the cell and " if study.others.of_cell else ""
    return (
        f"{SPREAD}, and {held}the constants of ageing, which are in the intervals of ratios "
        "and lifetimes, not in the absolute figures of a flight."
    )


def _lead(study: Study) -> tuple[str, ...]:
    found = study.assessment.motions
    if not found:
        return ("No motion of this flight could be repeated.",)
    costs = [own.cycled.whole.inventory_C for own in found.values()]
    held_C = study.assessment.pack.rated_C
    air = [
        own.cycled.in_flight.inventory_C / own.cycled.whole.inventory_C for own in found.values()
    ]
    said = ", ".join(f"{name_of(n)} {_times(_per_energy(own))}" for n, own in found.items())
    by = "example constants, not this pack's" if _assumed(study) else "its pack file"
    return (
        f"A full flight and its recharge cost this pack, taken as new, about "
        f"{_span([100 * c / held_C for c in costs])} % of its capacity (by {by}): "
        f"{_span([MAH * c for c in costs])} of {fixed(MAH * held_C, 0)} mAh are lithium that is "
        f"lost for good, {fixed(100 * sum(air) / len(air), 0)} % of it in the air and the rest "
        "while charging.",
        f"For the energy it draws, beside a steady current of the same mean: {said}.",
        *_costliest(study.attribution),
    )


def _span(values: Sequence[float]) -> str:
    """From the least to the most, as one where they are printed alike."""
    return " to ".join(dict.fromkeys(significant(v, 2) for v in (min(values), max(values))))


def _costliest(flown: Attribution) -> tuple[str, ...]:
    """Which stretch of this flight took most lithium a minute; nothing of a part of one."""
    both = [(s, c) for s, c in zip(flown.spans, flown.costs, strict=False) if c.duration_s >= 1]
    both = [(s, c) for s, c in both if Motion(s.name) is not Motion.GROUND]
    if not both or flown.status is not Status.DONE:
        return ()
    rates = [60e3 * MAH * c.loss.inventory_C / c.duration_s for _, c in both]
    worst = max(range(len(both)), key=rates.__getitem__)
    span = both[worst][0]
    return (
        f"In this flight the stretch from {fixed(span.start_s, 0)} to {fixed(span.stop_s, 0)} s "
        f"({name_of(span.name)}) took most lithium in its time: {fixed(rates[worst], 1)} µAh a "
        "minute.",
    )


def _per_energy(own: Assessed) -> Ratio:
    return own.excess[Part.WHOLE]["lithium"] * (1 / own.energy)


def _times(ratio: Ratio) -> str:
    return f"costs {in_words(ratio)} times as much"


def _assumed(study: Study) -> list[str]:
    """Effects of ageing with the constants that they come with."""
    effects = study.assessment.pack.effects
    return [e.id for e in effects if isinstance(e, AGEING) and e == type(e)()]


def _notices(study: Study) -> tuple[Notice, ...]:
    out = []
    if assumed := _assumed(study):
        text = (
            "The constants of ageing were not measured on this pack: they are those of O'Kane 2022 "
            f"for another cell, the LG M50 ({', '.join(i.replace('_', ' ') for i in assumed)}). "
            "They are an example: compare motions by them, do not count on the lifetimes."
        )
        out.append(Notice(text=text, severity=Severity.DOUBT, code="ageing_assumed"))
    worst = max((own.cycled.whole.positive for own in study.assessment.motions.values()), default=0)
    if worst > FAST_LOSS and not study.assessment.pack.stressed:
        text = (
            f"The positive electrode loses {significant(100 * worst, 2)} % of its material with "
            "every flight: those constants hold where stress enhances diffusion. Add "
            '"stress_enhanced_diffusion" to the physics of the pack file.'
        )
        out.append(Notice(text=text, severity=Severity.DOUBT, code="implausible_loss"))
    for name, reason in not_assessed(study, {}).items():
        what = (
            "What this flight cost as it was flown is not known to its end"
            if name == FLIGHT
            else f"{name_of(name).capitalize()} could not be repeated"
        )
        text = f"{what}: {reason}."
        out.append(Notice(text=text, severity=Severity.DOUBT, code="not_assessed"))
    return tuple(out)


def _figures(study: Study) -> tuple[Figure, ...]:
    flown = Figure(
        caption="The flight as it was flown: what each segment cost, per minute. Motions have the "
        "colours of the drawing above.",
        description="Lithium and active material lost per minute, for each segment of the flight.",
        svg=course_svg(study.attribution),
    )
    if not study.assessment.motions:
        return (flown,)
    said = "; ".join(
        f"{name_of(n)} "
        + ", ".join(f"{TITLES[k]} {in_words(own.normalised[Part.WHOLE][k])}" for k in TITLES)
        for n, own in study.assessment.motions.items()
    )
    beside = Figure(
        caption="Damage of a flight and its recharge over that of the lowest constant current. "
        "Circles: constant currents. Stars: motions, at their mean current, with 95 % intervals.",
        description=f"Over the lowest constant current: {said}.",
        svg=normalised_svg(study.assessment),
    )
    return beside, flown
