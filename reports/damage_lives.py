"""How long the pack lasts, as a table, and by what assumption."""

import math

from reports import plots
from reports.quantity import MISSING, fixed, significant
from reports.section import Cell, Column, Row, Table
from segment.segment import Motion
from twin.damage import Lifetime, Lives, Study

UNREACHED = "not reached"


def life_rows(lives: Lives) -> tuple[Row, ...]:
    """What a pilot asks first."""
    share, soon, gentle = fixed(100 * lives.share, 0), lives.soon, lives.gentle
    always = "if always flown and charged like this, at this temperature"
    same = f"the same with no current above {fixed(lives.most_A, 1)} A"
    return (
        Row(
            label=f"Flights to {share} % of the capacity",
            value=_reached(soon),
            note=f"95 % interval {_interval(soon)}; {always}"
            if _known(soon)
            else f"{always}: {_why(soon)}",
        ),
        Row(
            label="Flights if flown more gently",
            value=_reached(gentle),
            unit="flights" if _known(gentle) else "",
            note=f"{same}; as flown {_reached(soon)}"
            if _known(gentle)
            else f"{same}: {_why(gentle)}",
        ),
    )


def life_tables(study: Study) -> tuple[Table, ...]:
    """Flights as flown, left standing, gently, and of each motion alone; none if not asked for."""
    lives = study.lives
    if lives is None:
        return ()
    all_ = [
        ("as flown, soon after one another", lives.soon),
        ("as flown, one a day", lives.daily),
        (f"as flown, no current above {fixed(lives.most_A, 1)} A", lives.gentle),
        *((f"{plots.motion_name(Motion(name))} only", one) for name, one in lives.motions.items()),
    ]
    rows = tuple(
        (label, _reached(one) if _known(one) else f"{UNREACHED}: {_why(one)}", _interval(one))
        for label, one in all_
    )
    return (
        Table(
            caption=f"Flights to {fixed(100 * lives.share, 0)} % of the first capacity. A motion "
            "alone draws the charge of this flight",
            columns=(Column(title="flown", numeric=False), Column(title="flights"),
                     Column(title="95 % interval")),
            rows=tuple(tuple(Cell(text=t) for t in row) for row in rows),
        ),
    )  # fmt: skip


def life_notes(study: Study) -> tuple[str, ...]:
    """Assumptions, and how other mixes follow."""
    lives, others = study.lives, study.others
    if lives is None:
        return ()
    steps = "Lifetimes assume that ageing goes on by the twin's own laws to the end: no interval "
    steps += "holds that. What their 95 % intervals hold: the steps of the projection"
    if lives.motions:
        steps += ", how the segments of a motion differ"
    if others is None:
        steps += "; not what is not known of cell and constants of ageing, which are taken as exact"
    else:
        steps += ", the numbers of the cell as its calibration left them" if others.of_cell else ""
        steps += (
            ", the constants of ageing as the fit to a life left them"
            if others.of_life
            else ", the constants of ageing as they differ from cell to cell (a standard deviation "
            "of a factor 10 in the growth of SEI, 3 in its resistance and in the moduli, 1.5 in "
            "the molar volumes); those of plating and cracks stay O'Kane's"
        )
        steps += f" ({lives.packs} packs drawn)"
        if not others.of_cell:
            steps += "; not that the cell may be another"
    return (f"{steps}.", *_of_mixes(lives))


def _of_mixes(lives: Lives) -> tuple[str, ...]:
    if not math.isfinite(lives.by_shares) or not math.isfinite(lives.soon.reached):
        return ()
    return (
        "Another mix of the motions lasts one over the mean of one over their flights, by the "
        "charge each draws (damage adds up, whatever the order). For the mix of this flight that "
        f"gives {fixed(lives.by_shares, 0)}, the flight itself {fixed(lives.soon.reached, 0)}.",
    )


def _known(one: Lifetime) -> bool:
    return math.isfinite(one.reached)


def _reached(one: Lifetime) -> str:
    return fixed(one.reached, 0) if _known(one) else UNREACHED


def _why(one: Lifetime) -> str:
    """Why a lifetime has no number."""
    ended = one.projection.ended
    return f"before that, {ended}" if ended else "the projection did not come as far"


def _interval(one: Lifetime) -> str:
    lower, upper = one.interval_95
    if not math.isfinite(upper):
        return MISSING
    return f"{significant(lower, 2)} to {significant(upper, 2)}"
