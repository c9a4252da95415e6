"""The parameters: value, interval, prior and verdict of each."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D

from reports.calibration.drawings import sheet
from reports.calibration.names import (
    VERDICT_COLOUR,
    called,
    is_mount,
    is_start,
    phrase,
    with_unit,
    word,
)
from reports.calibration.report import CalibrationReport
from reports.calibration.summary import cell_estimates
from reports.plots import ROW_IN, named_rows, to_svg
from reports.quantity import significant
from reports.section import Cell, Column, Figure, Section, Table
from twin.bumps import is_bump
from twin.calibrate.answer import NINETY, Estimate
from twin.calibrate.parameters import Parameter

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FARTHEST = 5.0  # standard deviations of the prior that are drawn
VERDICTS_AT = 0.6  # of the width of their panel
COLUMNS = (
    Column(title="parameter", numeric=False),
    Column(title="value"),
    Column(title="90 % from"),
    Column(title="to"),
    Column(title="unit", numeric=False),
    Column(title="prior"),
    Column(title="left of the prior's uncertainty"),
    Column(title="verdict", numeric=False),
    Column(title="name in the files", numeric=False),
)


def parameters(report: CalibrationReport) -> Section:
    """Drawn beside their priors, and as a table."""
    told = report.found.answer
    shown = cell_estimates(report.found)
    beside = {
        "Rest voltages before the tests, fitted with them": is_start,
        "How the cell cools in mounts and tests, fitted with them": is_mount,
        "Correction of the open-circuit curve, fitted with them": is_bump,
    }
    tables = [_table("Parameters of the cell", shown)]
    for caption, belongs in beside.items():
        if own := [e for e in told.estimates if belongs(e.name)]:
            tables.append(_table(caption, own))
    return Section(
        id="parameters",
        title="Parameters",
        lead=(
            "The prior is what was assumed before: the cell of the pack file, and how far such "
            "numbers usually are off. A narrow bar inside a wide grey one is something these tests "
            "found out; where both are alike they tell nothing, and the assumption stands.",
        ),
        figures=(_figure(report, shown),),
        tables=tuple(tables),
        notes=(
            "identified: no more than half of the prior's uncertainty is left; partly: the prior "
            "has a share in the value; prior: these tests do not show it; at bound: it would go "
            "farther if it were let. Intervals rest on the model being right but for what is left "
            "unexplained.",
            "Those without bounds follow from the others: both electrodes hold the capacity "
            "between the ends of their windows, and spheres have the surface of their radius.",
        ),
    )


def _table(caption: str, estimates: list[Estimate]) -> Table:
    rows = tuple(tuple(Cell(text=text) for text in _texts(e)) for e in estimates)
    return Table(caption=caption, columns=COLUMNS, rows=rows, folded=True)


def _texts(e: Estimate) -> tuple[str, ...]:
    c = called(e.name, e.unit)
    return (
        c.text, c.value(e.value), c.value(e.lower), c.value(e.upper), c.unit, c.value(e.prior),
        f"{significant(100 * e.left_of_prior, 2)} %", word(e.verdict), e.name,
    )  # fmt: skip


def _figure(report: CalibrationReport, shown: list[Estimate]) -> Figure:
    by_name = {p.name: p for p in report.found.problem.table}
    canvas, axes = sheet(
        1.0 + ROW_IN * len(shown), nrows=1, ncols=2, width_ratios=(2.6, 1), sharey=True
    )  # fmt: skip
    ax, words = axes[0]
    words.axis("off")
    for row, e in enumerate(shown):
        _draw(ax, row, e, by_name.get(e.name))
        for place, text in ((0.0, with_unit(e)), (VERDICTS_AT, word(e.verdict))):
            words.text(
                place, row, text, va="center", fontsize=9, color=VERDICT_COLOUR[e.verdict],
                parse_math=False, clip_on=False,
            )  # fmt: skip
    named_rows(ax, [called(e.name, e.unit).text for e in shown])
    ax.set_xlim(-FARTHEST, FARTHEST)
    ax.set_xlabel("standard deviations of the prior, from its mean (logarithmic for most)")
    ax.legend(
        handles=[
            Line2D([], [], color="#d9d9d9", linewidth=9, label="prior, 90 %"),
            Line2D([], [], color="#333333", marker="o", linewidth=3, label="calibrated, 90 %"),
            Line2D([], [], color="#333333", marker="|", linestyle="", label="bounds"),
        ],
        loc="lower left", bbox_to_anchor=(0, 1), ncols=3, fontsize=9,
        frameon=False,
    )  # fmt: skip
    return Figure(
        caption="Every parameter beside its prior. A bar that reaches the edge goes on beyond it.",
        description="; ".join(f"{phrase(e.name)} {with_unit(e)}, {word(e.verdict)}" for e in shown),
        svg=to_svg(canvas, "intervals"),
    )


def _draw(ax: "Axes", row: int, e: Estimate, parameter: Parameter | None) -> None:
    """One row; numbers that follow from others have no bounds."""
    colour = VERDICT_COLOUR[e.verdict]
    low, at, high = (_place(e, v, parameter) for v in (e.lower, e.value, e.upper))
    ax.plot([-NINETY, NINETY], [row, row], color="#d9d9d9", linewidth=9, solid_capstyle="butt")
    ax.plot([low, high], [row, row], color=colour, linewidth=3, solid_capstyle="butt")
    ax.plot(np.clip(at, -FARTHEST, FARTHEST), row, "o", color=colour, markersize=5)
    if parameter is not None:
        near = [b for b in parameter.bounds if abs(b) < FARTHEST]
        ax.plot(near, [row] * len(near), "|", color="#333333", markersize=8)


def _place(e: Estimate, value: float, parameter: Parameter | None) -> float:
    """In standard deviations of the prior from its mean; for what follows, of theirs."""
    if parameter is not None:
        return parameter.coordinate(value)
    return (value - e.prior) / (e.std / e.left_of_prior)
