"""Where the twin is off, and by which cause: a picture of each recording."""

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from reports.mismatch.drawn import (
    CAUSE_COLOURS,
    COLUMNS,
    FloatArray,
    chosen,
    mean_mV,
    rms_V,
    stretches,
)
from reports.mismatch.report import MismatchReport
from reports.mismatch.summary import mV
from reports.mismatch.words import name
from reports.plots import (
    MEASURED,
    decimate,
    legend,
    motion_key,
    motion_name,
    panels,
    shade,
    to_svg,
)
from reports.quantity import MISSING, fixed
from reports.section import Cell, Column, Figure, Section, Table
from segment.segment import Motion
from twin.mismatch import Course, Finding, Span

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LABELLED = 0.03  # share of a span from which it is written beside it
WIDE = 0.06  # of the picture: a narrower span has no room for that
MOST_LISTED = 10
COLUMNS_OF_SPANS = (
    Column(title="recording", numeric=False),
    Column(title="from [s]"),
    Column(title="to [s]"),
    Column(title="motion", numeric=False),
    Column(title="recorded − simulated [mV]"),
    Column(title="share of the mismatch [%]"),
)
COLUMNS_OF_MOTIONS = (
    Column(title="motion", numeric=False),
    Column(title="share of the mismatch [%]"),
)


def located(report: MismatchReport) -> Section | None:
    """Pictures, then the spans and motions with their shares."""
    finding = report.finding
    if not finding.courses:
        return None
    drawn = chosen(finding.courses)
    more = len(finding.courses) - len(drawn)
    return Section(
        id="where",
        title="Where the twin is off",
        lead=(LEAD if finding.spans else NOWHERE,),
        figures=tuple(picture(c, finding, k) for k, c in enumerate(drawn)),
        tables=_tables(finding.spans),
        notes=(
            "Lines are means over one second of the samples that count. Coloured: what each effect "
            "that was left out does to the voltage. Bars below: spans whose mean is beyond the "
            "noise, red where the recording lies above the twin, blue where below.",
            *((f"{more} more recordings are not drawn.",) if more else ()),
        ),
    )


LEAD = (
    "Recorded minus simulated voltage of the twin as configured. A span is marked where its mean "
    "is more than chance; its share is that of all squares beyond the noise."
)
NOWHERE = (
    "Recorded minus simulated voltage of the twin as configured. Nowhere is its mean more than "
    "chance."
)


def picture(course: Course, finding: Finding, number: int) -> Figure:
    """Residual over time, with what each effect makes of it and the spans beyond the noise."""
    own = [s for s in finding.spans if s.flight == course.name]
    canvas, axes = panels((2.5, 0.42) if own else (2.5,))
    ax = axes[0]
    moved = stretches(course)
    shade([ax], moved)
    noise_mV = 1e3 * finding.errors.noise
    ax.axhspan(-noise_mV, noise_mV, color="#8c8c8c", alpha=0.3, linewidth=0)
    _line(ax, mean_mV(course, course.residual_V), MEASURED, "recorded − simulated")
    for part, colour in zip(course.parts, CAUSE_COLOURS, strict=False):
        _line(ax, mean_mV(course, part.voltage_V), colour, name(part.effect))
    ax.set_ylabel("voltage [mV]")
    legend(ax)
    if own:
        _strip(axes[1], course, own)
    motion_key(canvas, moved)
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(float(course.time_s[0]), float(course.time_s[-1]))
    size = mV(rms_V(course.residual_V, course.judged))
    below = " and the spans that exceed the noise below" if own else ""
    return Figure(
        caption=f"{course.name}: {size} mV RMS. Grey band: noise, one standard deviation either "
        "way.",
        description=f"Residual voltage of {course.name} over time, {size} millivolts root mean "
        f"square, with the motions behind it{below}.",
        svg=to_svg(canvas, f"where{number}"),
    )


def _line(ax: "Axes", drawn: tuple[FloatArray, FloatArray], colour: str, label: str) -> None:
    t, y = decimate(*drawn, COLUMNS)
    if np.isfinite(y).any():
        ax.plot(t, y, color=colour, label=label, linewidth=1.2)


def _strip(ax: "Axes", course: Course, own: list[Span]) -> None:
    """The spans of one recording, the darker the larger their share."""
    whole_s = float(course.time_s[-1] - course.time_s[0]) or 1.0
    for span in own:
        colour = "#b2182b" if span.mean_V > 0 else "#2166ac"
        strength = 0.2 + 0.8 * min(span.share * 2, 1.0)
        ax.axvspan(span.start_s, span.stop_s, facecolor=colour, alpha=strength, linewidth=0)
        if span.share >= LABELLED and span.stop_s - span.start_s > WIDE * whole_s:
            ink = "white" if strength > 0.5 else "black"
            ax.text(
                (span.start_s + span.stop_s) / 2, 0.5, f"{fixed(100 * span.share, 0)} %",
                ha="center", va="center", fontsize=8, color=ink, clip_on=True,
            )  # fmt: skip
    ax.set_ylim(0.0, 1.0)
    ax.set_yticks([])
    ax.grid(visible=False)


def _tables(spans: tuple[Span, ...]) -> tuple[Table, ...]:
    if not spans:
        return ()
    rows = tuple(tuple(Cell(text=t) for t in _texts(s)) for s in spans)
    out = [
        Table(
            caption="Spans that exceed the noise, the largest first"
            + (f" ({MOST_LISTED} of {len(spans)})" if len(spans) > MOST_LISTED else ""),
            columns=COLUMNS_OF_SPANS,
            rows=rows[:MOST_LISTED],
            folded=True,
        )
    ]
    if any(shares := motion_shares(spans)):
        out.insert(
            0,
            Table(
                caption="By motion",
                columns=COLUMNS_OF_MOTIONS,
                rows=tuple(
                    (Cell(text=moving(m)), Cell(text=fixed(100 * share, 0)))
                    for m, share in shares.items()
                ),
            ),
        )
    return tuple(out)


def motion_shares(spans: tuple[Span, ...]) -> dict[str, float]:
    """Motion -> share of the mismatch, the largest first."""
    shares: dict[str, float] = defaultdict(float)
    for s in spans:
        shares[s.motion] += s.share
    return dict(sorted(shares.items(), key=lambda pair: -pair[1]))


def _texts(s: Span) -> tuple[str, ...]:
    times = fixed(s.start_s, 1), fixed(s.stop_s, 1)
    return (s.flight, *times, moving(s.motion), mV(s.mean_V), fixed(100 * s.share, 1))


def moving(motion: str) -> str:
    """As a person writes it; a dash where it is not known."""
    known = {m.value: m for m in Motion}
    return motion_name(known[motion]) if motion in known else motion or MISSING
