"""Before and after, on what was fitted and on what was held out."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from reports.mismatch.drawn import COLUMNS, chosen, mean_mV, rms_V
from reports.mismatch.report import MismatchReport
from reports.mismatch.summary import mV
from reports.plots import (
    COMMANDED,
    SIMULATED,
    decimate,
    legend,
    panels,
    to_svg,
)
from reports.section import Cell, Column, Figure, Section, Table
from twin.mismatch import Course, Finding, Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HELD_OUT_COLOUR = "#f3ead2"
COLUMNS_OF_ERRORS = (
    Column(title="recording", numeric=False),
    Column(title="part", numeric=False),
    Column(title="before [mV]"),
    Column(title="after [mV]"),
    Column(title="noise [mV]"),
)


def improved(report: MismatchReport) -> Section | None:
    """The residual with and without what was left out; None if nothing was found."""
    finding = report.finding
    nothing = finding.verdict in (Verdict.NONE, Verdict.UNKNOWN) or finding.contradictory
    if nothing or not finding.courses:
        return None
    return Section(
        id="fit",
        title="Before and after",
        lead=(
            "What was left out is fitted to one part of the recordings and judged on the other. "
            "An effect that is only fitted, not found, mends the first alone.",
        ),
        figures=(_figure(finding),),
        tables=(_table(finding),),
        notes=(CUT,) if any(_in_both(c) for c in finding.courses) else (),
    )


CUT = (
    "A single recording is cut into parts that are fitted and held out in turn; the seconds "
    "between them count in neither."
)


def _in_both(c: Course) -> bool:
    return bool(c.judged_ahead.any() and (c.judged & ~c.judged_ahead).any())


def _figure(finding: Finding) -> Figure:
    drawn = chosen(finding.courses)
    canvas, axes = panels([1.7] * len(drawn), share_x=False)
    noise_mV = 1e3 * finding.errors.noise
    for ax, course in zip(axes, drawn, strict=True):
        _shade_held_out(ax, course)
        ax.axhspan(-noise_mV, noise_mV, color="#8c8c8c", alpha=0.3, linewidth=0)
        for values_V, colour, label in (
            (course.residual_V, COMMANDED, "before"),
            (course.after_V, SIMULATED, "after"),
        ):
            smooth = decimate(*mean_mV(course, values_V), COLUMNS)
            ax.plot(*smooth, color=colour, label=label, linewidth=1.1)
        ax.set_xlim(float(course.time_s[0]), float(course.time_s[-1]))
        ax.set_title(course.name, fontsize=9, loc="left", parse_math=False)
        ax.set_ylabel("error [mV]")
    axes[-1].set_xlabel("time [s]")
    legend(axes[0])
    canvas.align_ylabels()
    errors = finding.errors
    return Figure(
        caption="Recorded minus simulated, means over one second. Grey band: noise. Sand: held "
        "out, not fitted.",
        description=f"Error over time before and after; on what was held out "
        f"{mV(errors.held_out_before)} and {mV(errors.held_out_after)} millivolts.",
        svg=to_svg(canvas, "fit"),
    )


def _shade_held_out(ax: "Axes", course: Course) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], course.judged_ahead.astype(int), [0]])))
    for a, b in edges.reshape(-1, 2).tolist():
        ax.axvspan(
            course.time_s[a], course.time_s[b - 1], facecolor=HELD_OUT_COLOUR, linewidth=0, zorder=0
        )


def _table(finding: Finding) -> Table:
    errors = finding.errors
    rows: list[tuple[str, str, float, float]] = []
    for part, before, after in (
        ("fitted", errors.before, errors.after),
        ("held out", errors.held_out_before, errors.held_out_after),
    ):
        own = [(c, where) for c in finding.courses if (where := _samples(c, part)).any()]
        rows += [("all", part, before, after)] if len(own) > 1 else []
        rows += [(c.name, part, rms_V(c.residual_V, w), rms_V(c.after_V, w)) for c, w in own]
    return Table(
        caption="Recorded minus simulated, root mean square",
        columns=COLUMNS_OF_ERRORS,
        rows=tuple(
            tuple(Cell(text=t) for t in (who, part, mV(before), mV(after), mV(errors.noise)))
            for who, part, before, after in rows
        ),
    )


def _samples(c: Course, part: str) -> npt.NDArray[np.bool_]:
    """(n,) those of a recording that are in a part."""
    return c.judged_ahead if part == "held out" else c.judged & ~c.judged_ahead
