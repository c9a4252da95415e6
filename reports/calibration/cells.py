"""How the cells of the pack differ, where their own voltages were measured."""

import numpy as np

from reports import plots
from reports.calibration.drawings import sheet
from reports.calibration.report import CalibrationReport
from reports.quantity import fixed
from reports.section import Cell, Column, Figure, Section, Table
from twin.calibrate.unlike import Difference, Unlike

SHOWN = {
    "capacity_factor": ("capacity", 100.0, "%"),
    "soc_offset": ("charge", 100.0, "%"),
    "resistance_ohm": ("resistance", 1e3, "mΩ"),
}
"""Name, factor to what is shown, and its unit."""
HEIGHT_IN = 2.4


def cells(report: CalibrationReport) -> Section | None:
    """Each cell beside the mean; None without voltages of cells."""
    unlike = report.unlike
    if unlike is None:
        return None
    return Section(
        id="cells",
        title="The cells of the pack",
        lead=(_said(unlike),),
        figures=(_figure(unlike),),
        tables=(_table(unlike),),
        notes=(
            "Differences are from the mean of the cells, with their 90 % intervals; charge is what "
            f"a cell holds beside the others where the mean cell is {fixed(100 * unlike.soc, 0)} % "
            "full. A quantity whose differences noise alone could make is left alike in the pack "
            "file.",
        ),
    )


def _said(unlike: Unlike) -> str:
    told = [SHOWN[d.quantity][0] for d in unlike.differences if d.beyond_noise]
    if not told:
        return "The voltages of the cells show no difference that is more than noise."
    weak = int(np.argmax(unlike.before_V)) + 1
    what = " and ".join(", ".join(told).rsplit(", ", 1))
    before_mV, after_mV = (1e3 * float(v[weak - 1]) for v in (unlike.before_V, unlike.after_V))
    return (
        f"The cells differ in {what}. Cell {weak} is furthest from the others: the mean cell "
        f"misses its voltage by {fixed(before_mV, 1)} mV, its own numbers by "
        f"{fixed(after_mV, 1)} mV."
    )


def _figure(unlike: Unlike) -> Figure:
    canvas, axes = sheet(HEIGHT_IN, ncols=len(unlike.differences))
    number = np.arange(1, unlike.before_V.size + 1)
    for ax, d in zip(axes[0], unlike.differences, strict=True):
        name, factor, unit = SHOWN[d.quantity]
        reach = factor * (d.interval[1] - d.value)
        colour = plots.SIMULATED if d.beyond_noise else "#9a9a9a"
        ax.errorbar(number, factor * d.value, yerr=reach, fmt="o", color=colour, capsize=3)
        ax.axhline(0.0, color=plots.MEASURED, linewidth=0.6)
        ax.set_xticks(number)
        ax.set_xlabel("cell")
        ax.set_ylabel(f"{name} [{unit}]")
    return Figure(
        caption="Each cell beside the mean of the cells, 90 % intervals; grey: no more than noise.",
        description="Differences of the cells of the pack in capacity, charge and resistance.",
        svg=plots.to_svg(canvas, "cells"),
    )


def _table(unlike: Unlike) -> Table:
    heads = [f"{SHOWN[d.quantity][0]} [{SHOWN[d.quantity][2]}]" for d in unlike.differences]
    titles = [*heads, "error as the mean [mV]", "error as it is [mV]"]
    return Table(
        caption="Difference of each cell from the mean, with its 90 % interval",
        columns=(Column(title="cell"), *(Column(title=t) for t in titles)),
        rows=tuple(_row(unlike, k) for k in range(unlike.before_V.size)),
    )


def _row(unlike: Unlike, k: int) -> tuple[Cell, ...]:
    errors = (fixed(1e3 * float(v[k]), 1) for v in (unlike.before_V, unlike.after_V))
    texts = (str(k + 1), *(_interval(d, k) for d in unlike.differences), *errors)
    return tuple(Cell(text=text) for text in texts)


def _interval(d: Difference, k: int) -> str:
    factor = SHOWN[d.quantity][1]
    low, high = (factor * float(end[k]) for end in d.interval)
    return f"{factor * float(d.value[k]):+.2f} ({low:+.2f} to {high:+.2f})"
