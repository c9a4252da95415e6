"""The damage of a flight as tables."""

import math
from collections.abc import Sequence

from reports import plots
from reports.damage import MAH, distance_km
from reports.damage_plots import TITLES
from reports.quantity import MISSING, celsius, fixed, significant
from reports.section import Cell, Column, Table
from segment.segment import Motion
from twin.damage import MEASURES, TEMPERATURE, Cycled, Part, Ratio, Study

FEATURES = {
    "peaks": "the peaks of the manoeuvre",
    "ripple": "the ripple of the control loop",
    "ramps": "fast ramps",
    "duty": "short high peaks instead of long low ones",
    TEMPERATURE: "warming up",
}


def tables_of(study: Study) -> tuple[Table, ...]:
    """Costs, ratios, the inside of the cells, both views and, if thorough, why."""
    return (
        _costs(study),
        _relative(study),
        _inside(study),
        _both_views(study),
        *_features(study),
    )


def name_of(motion: str) -> str:
    """As a person writes it."""
    return plots.motion_name(Motion(motion))


def in_words(ratio: Ratio) -> str:
    """With half of the 95 % interval, if it is known, rounded up: none is nothing."""
    if not math.isfinite(ratio.value):
        return MISSING
    half = ratio.error.half_95
    if not math.isfinite(half):
        return fixed(ratio.value, 3)
    return f"{fixed(ratio.value, 3)} ± {fixed(math.ceil(1000 * half) / 1000, 3)}"


def _rows_of(study: Study) -> list[tuple[str, Cycled, float | None]]:
    """Motions, then constant currents: name, what was cycled, distance [km]."""
    found = study.assessment
    motions = [(name_of(n), own.cycled, distance_km(own)) for n, own in found.motions.items()]
    return motions + [("constant current", c, None) for c in found.baselines.cycled]


def _costs(study: Study) -> Table:
    columns = (
        "motion", "mean [A]", "flight [min]", "flight [km]", "lithium [µAh]", "per Wh [µAh]",
        "SEI [µAh]", "on cracks [µAh]", "plating [µAh]", "material, negative [10⁻⁶]",
        "material, positive [10⁻⁶]",
    )  # fmt: skip
    return _table(
        "Cost of one flight from full to the cut-off with its recharge: lithium lost, what bound "
        "it, and millionths of the active material of each electrode that broke off",
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
        "Inside the cells: hottest, least margin to plating, greatest tension and pressure",
        columns,
        [
            (
                name,
                fixed(c.waveform.mean_A, 2),
                celsius(max(c.flight.max_K, c.charge.max_K)),
                fixed(1000 * c.flight.anode_V, 0),
                fixed(1000 * c.charge.anode_V, 0),
                _megapascals(max(e.negative_stress_Pa[1] for e in (c.flight, c.charge))),
                _megapascals(max(e.positive_stress_Pa[1] for e in (c.flight, c.charge))),
                _megapascals(-min(e.positive_stress_Pa[0] for e in (c.flight, c.charge))),
            )
            for name, c, _ in _rows_of(study)
        ],
        folded=True,
    )


def _megapascals(stress_Pa: float) -> str:
    return fixed(stress_Pa / 1e6, 1)


def _table(
    caption: str, titles: Sequence[str], rows: Sequence[Sequence[str]], *, folded: bool = False
) -> Table:
    """The first column is words."""
    return Table(
        caption=caption,
        columns=tuple(Column(title=t, numeric=k > 0) for k, t in enumerate(titles)),
        rows=tuple(tuple(Cell(text=text) for text in row) for row in rows),
        folded=folded,
    )


def _relative(study: Study) -> Table:
    parts = (Part.WHOLE, "flight and recharge"), (Part.FLIGHT, "in the air")
    return _table(
        "Damage of a flight over that of constant current at the same mean",
        ("motion", *(TITLES[k] for k in MEASURES)),
        [
            (f"{name_of(n)}, {words}", *(in_words(own.excess[part][k]) for k in MEASURES))
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
        half = study.attribution.order_error(name, "lithium").half_95
        per_Ah = [1e6 * c.loss.inventory_C / c.drawn_C for c in (flown, again)]
        rows.append(
            (
                name_of(name),
                _pm_units(per_Ah[0], half),
                significant(per_Ah[1]),
                celsius(flown.mean_K),
                celsius(again.mean_K),
                fixed(100 * flown.mean_soc, 0),
                fixed(100 * again.mean_soc, 0),
            )
        )
    return _table(
        "Lithium lost in the air, both views. They differ where this flight's motion was flown in "
        "a pack that was colder or warmer, or fuller, than the mean of a whole discharge. ±: in "
        "95 % of other orders the same segments would have cost that motion no more, and no less",
        titles,
        rows,
    )


def _pm_units(value: float, relative: float) -> str:
    sd = f" ± {significant(value * relative, 2)}" if math.isfinite(relative) else ""
    return f"{significant(value)}{sd}"


def _features(study: Study) -> tuple[Table, ...]:
    rows = [
        (f"{name_of(n)}: {FEATURES[f]}", *(_percent(own.without(f, k)) for k in MEASURES))
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
