"""What each test tells about each parameter, and which parameters the tests cannot tell apart."""

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LogNorm, Normalize

from reports.calibration.drawings import Matrix, draw, labels, sheet
from reports.calibration.names import called, in_order, is_start
from reports.calibration.report import CalibrationReport
from reports.plots import ROW_IN, to_svg
from reports.quantity import fixed, significant
from reports.section import Figure, Section
from twin.calibrate.answer import Answer, Combination
from twin.calibrate.information import Information

BEST_SHOWN = 0.01  # of the prior's uncertainty: the darkest of the colours
ALIKE = 0.5  # correlations from here on are written into their cell
HEAVY = 0.3  # likewise loadings
LETTERS = 12  # of a test's name above its column
TURNED = 4  # more columns than that have their names turned
LEAST_mV = 0.05  # an effect below is none


def identifiability(report: CalibrationReport) -> Section:
    """The map, the correlations, and the combinations that are known best and least."""
    found = report.found
    cell = in_order(found.information.names)
    return Section(
        id="identifiability",
        title="What the tests can tell",
        lead=(
            "A parameter is known from a test if it moves the voltage, and no other parameter "
            "moves it the same way. What no test tells apart is known in combination only.",
        ),
        figures=(
            _map_figure(found.information, cell),
            *((_correlation_figure(found.answer),) if len(cell) > 1 else ()),
            _combination_figure(found.answer),
        ),
    )


def _map_figure(told: Information, cell: list[int]) -> Figure:
    tests = labels(told.tests, LETTERS)
    rows = [called(told.names[k]).text for k in cell]
    canvas, axes = sheet(
        1.6 + ROW_IN * len(cell), nrows=1, ncols=2, width_ratios=(len(tests), len(tests) + 1)
    )  # fmt: skip
    moved, left = axes[0]
    turned = len(tests) > TURNED
    effect_mV = 1e3 * told.effect_V[:, cell].T
    strongest = max(float(effect_mV.max()), 10 * LEAST_mV)
    effects = Matrix(
        rows=rows,
        columns=tests,
        values=effect_mV,
        text=lambda v: significant(v, 2) if v >= LEAST_mV else "0",
        colours=mpl.colormaps["YlOrBr"],
        scale=LogNorm(vmin=LEAST_mV, vmax=strongest, clip=True),
    )
    draw(moved, effects, turned=turned)
    moved.set_xlabel("moves the voltage by [mV]", labelpad=6)
    matrix = Matrix(
        rows=[""] * len(rows),
        columns=[*tests, "all"],
        values=100 * np.vstack([told.alone, told.together])[:, cell].T,
        text=lambda v: significant(v, 2) if v < 99.5 else "100",
        colours=mpl.colormaps["YlGnBu_r"],
        scale=LogNorm(vmin=100 * BEST_SHOWN, vmax=100.0, clip=True),
    )
    draw(left, matrix, turned=turned)
    left.axvline(len(tests), color="white", linewidth=5)
    left.set_xlabel("leaves of the prior's uncertainty [%]", labelpad=6)
    return Figure(
        caption="Left: how far each parameter moves the voltage of each test, RMS, for one "
        "standard deviation of its prior. Right: how much of the prior's uncertainty a test alone "
        "leaves, and all together: 100 tells nothing, 1 nearly all. A parameter that moves the "
        "voltage and stays uncertain is masked by others that move it alike.",
        description="Effect on the voltage, and standard error over that of the prior, for each "
        "parameter and test.",
        svg=to_svg(canvas, "map"),
    )


def _correlation_figure(told: Answer) -> Figure:
    cell = in_order(told.names)
    values = told.correlations[np.ix_(cell, cell)].copy()
    values[np.triu_indices(len(cell))] = np.nan
    names = [called(told.names[k]).text for k in cell]
    canvas, axes = sheet(1.9 + ROW_IN * len(cell))
    matrix = Matrix(
        rows=names[1:],
        columns=names[:-1],
        values=values[1:, :-1],
        text=lambda v: fixed(v, 2) if abs(v) >= ALIKE else "",
        colours=mpl.colormaps["RdBu_r"],
        scale=Normalize(-1.0, 1.0),
    )
    draw(axes[0, 0], matrix, turned=True)
    return Figure(
        caption=f"Correlations of the estimates; written out from {ALIKE} on. Near 1 or −1: only "
        "a combination of the two is known.",
        description="Correlation coefficients of all pairs of parameters.",
        svg=to_svg(canvas, "correlations"),
    )


def _combination_figure(told: Answer) -> Figure:
    """Columns are combinations; only the loadings that the answer lists are drawn."""
    all_ = (*told.stiff, *told.sloppy)
    names = [told.names[k] for k in in_order(told.names)]
    values = np.array([[*(dict(c.loadings).get(n, np.nan) for n in names), _of_starts(c)]
                       for c in all_]).T  # fmt: skip
    canvas, axes = sheet(1.7 + ROW_IN * len(names))
    ax = axes[0, 0]
    matrix = Matrix(
        rows=[*(called(n).text for n in names), "rest voltage before a test"],
        columns=[_left(c) for c in all_],
        values=values,
        text=lambda v: fixed(v, 1) if abs(v) >= HEAVY else "",
        colours=mpl.colormaps["PuOr"],
        scale=Normalize(-1.0, 1.0),
    )
    draw(ax, matrix, turned=True)
    ax.axvline(len(told.stiff), color="black", linewidth=1.0, linestyle="--")
    return Figure(
        caption="Combinations of parameters from the best known (left) to the least: above each, "
        "how much of the prior's uncertainty the data alone leave of it. Right of the dashed line "
        "the prior tells more than the data.",
        description="Loadings of the eigenvectors of the information that the tests hold.",
        svg=to_svg(canvas, "combinations"),
    )


def _of_starts(c: Combination) -> float:
    """The largest loading of a test's start; NaN if none is listed."""
    return max((v for n, v in c.loadings if is_start(n)), key=abs, default=np.nan)


def _left(c: Combination) -> str:
    return f"{significant(100 * c.std, 2)} %" if c.std < 10 else "none"
