"""What each motion did to the battery."""

import math
from collections.abc import Sequence

from reports import plots
from reports.damage import MAH, distance_km
from reports.damage_plots import TITLES, course_svg, normalised_svg
from reports.flight import FlightReport
from reports.quantity import MISSING, celsius, fixed, significant
from reports.section import Cell, Column, Figure, Notice, Row, Section, Severity, Table
from segment.segment import Motion
from twin.damage import (
    MEASURES,
    TEMPERATURE,
    Assessed,
    Attribution,
    Cycled,
    Lives,
    Part,
    Ratio,
    Study,
)
from twin.effects import AGEING

FEATURES = {
    "peaks": "the peaks of the manoeuvre",
    "ripple": "the ripple of the control loop",
    "ramps": "fast ramps",
    "duty": "short high peaks instead of long low ones",
    TEMPERATURE: "warming up",
}
FINEST = 0.0005  # of a ratio: what rounds to more than nothing
NOTES = (
    "Each motion's periodic profile is flown from full to the cut-off and recharged (constant "
    "current of 1C, then constant voltage, no rest), again and again; so are the constant currents. "
    "Lithium lost what does not return: bound in SEI and SEI on cracks, plated and cut off, "
    "or trapped in lost active material.",
    "± is one standard deviation, from how the segments of a motion differ and what its profile "
    "misses of them. The constants of ageing are not in it: they largely cancel in ratios, and not "
    "at all in absolute figures and in lifetimes.",
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
        rows=_life(study.lives) if study.lives else (),
        figures=_figures(study),
        tables=(
            _costs(study),
            _relative(study),
            _inside(study),
            _both_views(study),
            *_features(study),
        ),  # fmt: skip
        notes=NOTES,
    )


def _lead(study: Study) -> tuple[str, ...]:
    found = study.assessment.motions
    if not found:
        return ("No motion of this flight could be repeated.",)
    costs = [MAH * own.cycled.whole.inventory_C for own in found.values()]
    air = [
        own.cycled.in_flight.inventory_C / own.cycled.whole.inventory_C for own in found.values()
    ]
    said = ", ".join(f"{_name(n)} {_times(_per_energy(own))}" for n, own in found.items())
    span = fixed(min(costs), 2)
    span += f" to {fixed(max(costs), 2)}" if fixed(max(costs), 2) != span else ""
    return (
        f"A full flight and its recharge cost this pack {span} mAh of lithium for good, "
        f"{fixed(100 * sum(air) / len(air), 0)} % of it in the air and the rest while charging. "
        f"For the energy it draws, beside a steady current of the same mean: {said}.",
        *_costliest(study.attribution),
    )


def _costliest(flown: Attribution) -> tuple[str, ...]:
    """Which stretch of this flight took most lithium a minute."""
    both = [(s, c) for s, c in zip(flown.spans, flown.costs, strict=False) if c.duration_s >= 1]
    both = [(s, c) for s, c in both if Motion(s.name) is not Motion.GROUND]
    if not both:
        return ()
    rates = [60e3 * MAH * c.loss.inventory_C / c.duration_s for _, c in both]
    worst = max(range(len(both)), key=rates.__getitem__)
    span = both[worst][0]
    return (
        f"In this flight the stretch from {fixed(span.start_s, 0)} to {fixed(span.stop_s, 0)} s "
        f"({_name(span.name)}) took most lithium in its time, {fixed(rates[worst], 1)} µAh a minute.",
    )


def _per_energy(own: Assessed) -> Ratio:
    ratio = own.excess[Part.WHOLE]["lithium"]
    return Ratio(value=ratio.value / own.energy, std=ratio.std / own.energy)


def _times(ratio: Ratio) -> str:
    return f"costs {_pm(ratio)} times as much"


def _pm(ratio: Ratio) -> str:
    if not math.isfinite(ratio.value):
        return MISSING
    if not math.isfinite(ratio.std):
        return fixed(ratio.value, 3)
    sd = fixed(ratio.std, 3) if ratio.std >= FINEST else f"< {FINEST}"
    return f"{fixed(ratio.value, 3)} ± {sd}"


def _name(motion: str) -> str:
    return plots.motion_name(Motion(motion))


def _notices(study: Study) -> tuple[Notice, ...]:
    out = []
    assumed = [
        e.id for e in study.assessment.pack.effects if isinstance(e, AGEING) and e == type(e)()
    ]
    if assumed:
        text = (
            "The constants of ageing were not measured on this pack: they are those of O'Kane 2022 "
            f"for another cell, the LG M50 ({', '.join(i.replace('_', ' ') for i in assumed)}). "
            "They are an example: compare motions by them, do not count on the lifetimes."
        )
        out.append(Notice(text=text, severity=Severity.DOUBT, code="ageing_assumed"))
    for motion, reason in study.assessment.cannot.items():
        text = f"{_name(motion).capitalize()} could not be repeated: {reason}."
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
        f"{_name(n)} "
        + ", ".join(f"{TITLES[k]} {_pm(own.normalised[Part.WHOLE][k])}" for k in TITLES)
        for n, own in study.assessment.motions.items()
    )
    beside = Figure(
        caption="Damage of a flight and its recharge over that of the lowest constant current. "
        "Circles: constant currents. Stars: motions, at their mean current.",
        description=f"Over the lowest constant current: {said}.",
        svg=normalised_svg(study),
    )
    return beside, flown


def _rows_of(study: Study) -> list[tuple[str, Cycled, float | None]]:
    """Motions, then constant currents: name, what was cycled, distance [km]."""
    found = study.assessment
    motions = [(_name(n), own.cycled, distance_km(own)) for n, own in found.motions.items()]
    return motions + [("constant current", c, None) for c in found.baselines.cycled]


def _costs(study: Study) -> Table:
    columns = (
        "motion", "mean [A]", "flight [min]", "flight [km]", "lithium [µAh]", "per Wh [µAh]",
        "SEI [µAh]", "on cracks [µAh]", "plating [µAh]", "negative [10⁻⁶]", "positive [10⁻⁶]",
    )  # fmt: skip
    return _table(
        "Cost of one flight from full to the cut-off with its recharge",
        columns,
        [
            (
                name,
                fixed(c.waveform.mean_A, 2),
                fixed(c.flown_s / 60, 1),
                fixed(km, 2),
                fixed(1000 * MAH * c.whole.inventory_C, 1),
                fixed(1000 * MAH * c.whole.inventory_C / (c.energy_J / 3600), 2),
                fixed(1000 * MAH * c.whole.sei_C, 1),
                fixed(1000 * MAH * c.whole.sei_on_cracks_C, 1),
                fixed(1000 * MAH * c.whole.dead_C, 2),
                fixed(1e6 * c.whole.negative, 2),
                fixed(1e6 * c.whole.positive, 2),
            )
            for name, c, km in _rows_of(study)
        ],
    )


def _inside(study: Study) -> Table:
    columns = (
        "motion", "mean [A]", "hottest [°C]", "margin in the air [mV]", "margin charging [mV]",
        "negative, tension [MPa]", "positive, tension [MPa]", "positive, pressure [MPa]",
    )  # fmt: skip
    return _table(
        "Inside the cells: hottest, least margin to plating, greatest hydrostatic stress",
        columns,
        [
            (
                name,
                fixed(c.waveform.mean_A, 2),
                celsius(max(c.flight.max_K, c.charge.max_K)),
                fixed(1000 * c.flight.anode_V, 0),
                fixed(1000 * c.charge.anode_V, 0),
                _MPa(max(e.negative_stress_Pa[1] for e in (c.flight, c.charge))),
                _MPa(max(e.positive_stress_Pa[1] for e in (c.flight, c.charge))),
                _MPa(-min(e.positive_stress_Pa[0] for e in (c.flight, c.charge))),
            )
            for name, c, _ in _rows_of(study)
        ],
    )


def _MPa(stress_Pa: float) -> str:  # noqa: N802
    return fixed(stress_Pa / 1e6, 1)


def _table(caption: str, titles: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """The first column is words."""
    return Table(
        caption=caption,
        columns=tuple(Column(title=t, numeric=k > 0) for k, t in enumerate(titles)),
        rows=tuple(tuple(Cell(text=text) for text in row) for row in rows),
    )


def _relative(study: Study) -> Table:
    parts = (Part.WHOLE, "flight and recharge"), (Part.FLIGHT, "in the air")
    return _table(
        "Damage of a flight over that of constant current at the same mean",
        ("motion", *(TITLES[k] for k in MEASURES)),
        [
            (f"{_name(n)}, {words}", *(_pm(own.excess[part][k]) for k in MEASURES))
            for n, own in study.assessment.motions.items()
            for part, words in parts
        ],
    )


def _both_views(study: Study) -> Table:
    """Per charge: as flown, and repeated from full from the same state; and how warm it was."""
    titles = (
        "motion", "as flown [µAh/Ah]", "repeated [µAh/Ah]", "pack as flown [°C]",
        "pack repeated [°C]", "charge as flown [%]", "charge repeated [%]",
    )  # fmt: skip
    rows = []
    for name, flown in study.attribution.by_name().items():
        again = study.attribution.repeated.get(name)
        if again is None or not flown.drawn_C:
            continue
        std = study.attribution.relative_std(name, "lithium")
        per_Ah = [1e6 * c.loss.inventory_C / c.drawn_C for c in (flown, again)]
        rows.append(
            (
                _name(name),
                _pm_units(per_Ah[0], std),
                significant(per_Ah[1]),
                celsius(flown.mean_K),
                celsius(again.mean_K),
                fixed(100 * flown.mean_soc, 0),
                fixed(100 * again.mean_soc, 0),
            )
        )
    return _table(
        "Lithium lost in the air, both views. They differ where this flight's motion was flown in a "
        "pack that was colder or warmer, or fuller, than the mean of a whole discharge",
        titles,
        rows,
    )


def _pm_units(value: float, relative: float) -> str:
    sd = f" ± {significant(value * relative, 2)}" if math.isfinite(relative) else ""
    return f"{significant(value)}{sd}"


def _features(study: Study) -> tuple[Table, ...]:
    rows = [
        (f"{_name(n)}: {FEATURES[f]}", *(_percent(own.without(f, k)) for k in MEASURES))
        for n, own in study.assessment.motions.items()
        for f in own.counterfactuals
    ]
    if not rows:
        return ()
    caption = (
        "Why: share of the damage that goes if a feature is taken away [%] (negative: there would "
        "be more without it)"
    )
    return (_table(caption, ("share owed to", *(TITLES[k] for k in MEASURES)), rows),)


def _percent(share: float) -> str:
    return fixed(100 * share, 1)


def _life(lives: Lives) -> tuple[Row, ...]:
    share = fixed(100 * lives.share, 0)
    note = "if always flown and charged like this, at this temperature; an example, see above"
    limited = f"the same with no current above {fixed(lives.most_A, 1)} A"

    def flights(reached: float, ended: str) -> str:
        return fixed(reached, 0) if math.isfinite(reached) else f"ends before: {ended}"

    soon, daily, gentle = lives.soon, lives.daily, lives.gentle
    return (
        Row(
            label=f"Flights to {share} % of the capacity",
            value=f"{flights(daily.reached, daily.ended)} to {flights(soon.reached, soon.ended)}",
            note=f"{note}; from one flight a day to one soon after the other",
        ),
        Row(
            label="What gentler flying would save",
            value=flights(gentle.reached, gentle.ended),
            unit="flights",
            note=f"{limited}, beside {flights(soon.reached, soon.ended)}",
        ),
    )
