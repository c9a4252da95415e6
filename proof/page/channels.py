"""What was measured and concealed, beside what the twins say of it."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure as Canvas

from proof.capacity import FITTED
from proof.outcome import Judged, Opened, Proof
from proof.page.words import short
from proof.tally import simulated
from proof.targets import CAPACITY, TEMPERATURE_K, WEAK_CELL_V, capacity_error, predicted_rms
from reports.plots import (
    COMMANDED,
    MEASURED,
    SIMULATED,
    STYLE,
    WIDTH_IN,
    broken_at_gaps,
    decimate,
    to_svg,
)
from reports.quantity import MISSING, ampere_hours, fixed
from reports.section import Cell, Column, Figure, Section, Table
from twin.constants import ZERO_CELSIUS_K

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ABREAST = 3
HEIGHT_IN = 1.85
ORDER = ("temperature", "weakest cell")  # of drawings; what else there is follows
DRAWN = 250  # columns of a small drawing
MOST_DRAWN = 18  # of one channel; of more recorded ones, those with the largest error
LIMITS = {"temperature": TEMPERATURE_K, "weakest cell": WEAK_CELL_V}
COLUMNS = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="recording", numeric=False),
    Column(title="channel", numeric=False),
    Column(title="before, rms"),
    Column(title="as named, rms"),
    Column(title="look-alike, rms"),
    Column(title="unit", numeric=False),
    Column(title="wanted", numeric=False),
    Column(title="verdict was", numeric=False),
)
CAPACITIES = (
    Column(title="trial", numeric=False, whole=True),
    Column(title="cell", numeric=False),
    Column(title="measured [Ah]"),
    Column(title="found [Ah]"),
    Column(title="off by [%]"),
    Column(title="the last check-up instead: off by [%]"),
    Column(title="would have done as well", numeric=False),
    Column(title="verdict was", numeric=False),
)
Pair = tuple[Judged, Opened]


def channels(proof: Proof) -> Section | None:
    """Drawings by channel, a table of all, and capacities; None if nothing was concealed."""
    trials = sorted(proof.trials, key=simulated)
    own = [(t, c) for t in trials for c in t.channels]
    asked = [t for t in proof.trials if t.truth.capacity_C is not None]
    if not own and not asked:
        return None
    names = sorted({c.channel for _, c in own}, key=lambda n: (n not in ORDER, n != ORDER[0], n))
    return Section(
        id="channels",
        title="What was concealed, revealed",
        lead=(
            "The tool had current and voltage alone. What is shown here was recorded or simulated "
            "with them, sealed, and looked at when the verdict was written. Before: the twin as "
            "configured; after: the twin with what was named, of effects that look alike the first "
            "that acts on this channel, which nobody knew before it was opened. What counts is the "
            "twin with what was named, whatever looks like it. Recorded ones come first.",
        ),
        figures=tuple(
            _figure([p for p in own if p[1].channel == which], which, f"channel{k}")
            for k, which in enumerate(names)
        ),
        tables=(*_table(own), *_capacities(asked)),
    )


def _figure(own: Sequence[Pair], which: str, place: str) -> Figure:
    worst = sorted(own, key=lambda p: (simulated(p[0]), -predicted_rms(p[1])))[:MOST_DRAWN]
    drawn = [p for p in own if any(p is w for w in worst)]
    abreast = min(ABREAST, len(drawn))
    down = -(-len(drawn) // abreast)
    with mpl.rc_context(STYLE):
        canvas = Canvas(figsize=(WIDTH_IN, HEIGHT_IN * down + 0.3), layout="constrained")
        FigureCanvasSVG(canvas)
        axes = canvas.subplots(down, abreast, squeeze=False)
    for ax in axes.ravel()[len(drawn) :]:
        ax.set_axis_off()
    for ax, (t, c) in zip(axes.ravel(), drawn, strict=False):
        _small(ax, t, c)
    for row in axes:
        row[0].set_ylabel("temperature [°C]" if drawn[0][1].unit == "K" else "voltage [V]")
    for ax in axes.ravel()[max(0, len(drawn) - abreast) : len(drawn)]:
        ax.set_xlabel("time [s]")
    known = {line.get_label(): line for ax in axes.ravel() for line in ax.get_lines()}
    canvas.legend(
        handles=[known[k] for k in ("measured", "before", "after") if k in known],
        loc="outside upper left", ncols=3, frameon=False,
    )  # fmt: skip
    more = len(own) - len(drawn)
    rest = f" {more} more are in the table alone." if more else ""
    return Figure(
        caption=f"{which}: measured, and by the twins; rms of predicted minus measured.{rest}",
        description="; ".join(f"{t.name}, {c.recording}: {_errors(c)}" for t, c in drawn),
        svg=to_svg(canvas, place),
    )


def _small(ax: "Axes", t: Judged, c: Opened) -> None:
    zero = ZERO_CELSIUS_K if c.unit == "K" else 0.0
    for values, colour, label in (
        (c.before, COMMANDED, "before"),
        (c.after, SIMULATED, "after"),
        (c.measured, MEASURED, "measured"),
    ):
        if values is not None:
            drawn = decimate(*broken_at_gaps(c.time_s, values - zero), DRAWN)
            ax.plot(*drawn, color=colour, label=label, linewidth=1.1)
    title = f"{short(f'{t.name}, {c.recording}')}\n{_errors(c)}"
    ax.set_title(title, fontsize=8, loc="left", parse_math=False)


def _errors(c: Opened) -> str:
    after = "" if c.rms_after is None else f" → {_shown(c, c.rms_after)}"
    return f"{_shown(c, c.rms_before)}{after} {_unit(c)}"


def _shown(c: Opened, rms: float) -> str:
    return fixed(rms, 1) if c.unit == "K" else fixed(1e3 * rms, 1)


def _unit(c: Opened) -> str:
    return "K" if c.unit == "K" else "mV"


def _table(own: Sequence[Pair]) -> tuple[Table, ...]:
    if not own:
        return ()
    rows = tuple(_row(t, c) for t, c in own)
    return (Table(caption="Predicted minus measured", columns=COLUMNS, rows=rows),)


def _row(t: Judged, c: Opened) -> tuple[Cell, ...]:
    limit = LIMITS.get(c.channel)
    named, alike = (
        MISSING if rms is None else _shown(c, rms) for rms in (c.rms_named, c.rms_after)
    )
    wanted = MISSING if limit is None else f"≤ {fixed(limit if c.unit == 'K' else 1e3 * limit, 0)}"
    return (
        Cell(text=t.name),
        Cell(text=c.recording),
        Cell(text=c.channel),
        Cell(text=_shown(c, c.rms_before)),
        Cell(text=named, doubt=limit is not None and not predicted_rms(c) <= limit),
        Cell(text=alike),
        Cell(text=_unit(c)),
        Cell(text=wanted),
        Cell(text=t.outcome.value),
    )


def _capacities(asked: Sequence[Judged]) -> tuple[Table, ...]:
    if not asked:
        return ()
    rows = tuple(_capacity(t) for t in asked)
    text = (
        f"Capacity after the recordings (wanted: within {fixed(100 * CAPACITY, 0)} %). In "
        f"{sum(map(_as_well, asked))} of {len(asked)} the last check-up, which was fitted, taken "
        "for the next one, would have done as well: there the twin adds nothing"
    )
    return (Table(caption=text, columns=CAPACITIES, rows=rows),)


def _capacity(t: Judged) -> tuple[Cell, ...]:
    off = capacity_error(t)
    text = "not found" if off is None else fixed(100 * off, 1)
    same = _last(t)
    return (
        Cell(text=t.name),
        Cell(text=t.source),
        Cell(text=ampere_hours(t.truth.capacity_C, 2)),
        Cell(text=ampere_hours(t.capacity_C, 2)),
        Cell(text=text, doubt=off is None or not abs(off) <= CAPACITY),
        Cell(text=fixed(None if same is None else 100 * same, 1)),
        Cell(text="yes" if _as_well(t) else "no", doubt=_as_well(t)),
        Cell(text=t.outcome.value),
    )


def _last(t: Judged) -> float | None:
    """By how much the charge of the recording that was fitted is off, relative."""
    given_Ah, true_C = (t.truth.details or {}).get(FITTED), t.truth.capacity_C
    return 3600 * float(given_Ah) / true_C - 1 if given_Ah and true_C else None


def _as_well(t: Judged) -> bool:
    """Whether that is no farther off than what was found."""
    off, same = capacity_error(t), _last(t)
    return same is not None and (off is None or abs(same) <= abs(off))
