"""How far the calibrated cell is off, by test and by state of charge."""

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.colors import LogNorm

from reports.calibration.drawings import Matrix, draw, labels, sheet
from reports.calibration.report import CalibrationReport
from reports.plots import COMMANDED, MEASURED, ROW_IN, SIMULATED, named_rows, to_svg
from reports.quantity import MISSING, fixed
from reports.section import Cell, Column, Figure, Section, Table
from twin.calibrate.checks import SOC_BINS, Fitted

FloatArray = npt.NDArray[np.float64]

LEAST_SPAN = 10.0  # of the colours: an even error must not look like a profile
COLUMNS = (
    Column(title="test", numeric=False),
    Column(title="fitted [mV]"),
    Column(title="predicted from the other tests [mV]"),
    Column(title="noise [mV]"),
)


def errors(report: CalibrationReport) -> Section:
    """A picture of both profiles, and the numbers by test."""
    tests = report.found.fitted
    rows = tuple(tuple(Cell(text=text) for text in (f.name, *map(_mV, _numbers(f)))) for f in tests)
    return Section(
        id="errors",
        title="Error by test and state of charge",
        lead=(
            "Root mean square of measured minus simulated, of one cell. Noise is what samples "
            "scatter by themselves: no model can be better than that.",
        ),
        figures=(_figure(tests),),
        tables=(Table(caption="Error by test", columns=COLUMNS, rows=rows, folded=True),),
    )


def _numbers(f: Fitted) -> tuple[float, float, float]:
    held = f.held_out_rms_V
    return 1e3 * f.rms_V, np.nan if held is None else 1e3 * held, 1e3 * f.noise_V


def _mV(value: float) -> str:
    return fixed(value, 2)


def _figure(tests: tuple[Fitted, ...]) -> Figure:
    canvas, axes = sheet(
        1.1 + 1.5 * ROW_IN * len(tests), nrows=1, ncols=2, width_ratios=(1, 1.5)
    )  # fmt: skip
    bars, table = axes[0]
    names = labels([f.name for f in tests])
    fitted, held, noise = np.array([_numbers(f) for f in tests]).T
    for k in range(len(tests)):
        bars.plot([0.0, noise[k]], [k, k], color="#e3e3e3", linewidth=13, solid_capstyle="butt")
    at = np.arange(len(tests))
    bars.plot(fitted, at, "o", color=SIMULATED, label="fitted")
    if np.isfinite(held).any():
        bars.plot(held, at, "D", color=COMMANDED, label="predicted from the others", markersize=5)
    bars.set_xlim(left=0.0)
    bars.set_xlabel("error [mV]; grey: noise")
    named_rows(bars, names)
    handles = bars.get_legend_handles_labels()
    bars.legend(
        *handles, loc="lower left", bbox_to_anchor=(0, 1), ncols=2, fontsize=8, frameon=False
    )
    by_soc = 1e3 * np.array([f.rms_by_soc_V() for f in tests])
    draw(table, _profile(names, by_soc))
    table.set_yticks([])
    table.set_xlabel("error [mV] by state of charge [%]", labelpad=6)
    table.spines["bottom"].set_color(MEASURED)
    return Figure(
        caption="Left: error of each test. Right: the same by state of charge; – where the "
        "simulated cell did not come.",
        description="Root mean square error of each test and in ten bands of state of charge.",
        svg=to_svg(canvas, "errors"),
    )


def _profile(names: list[str], by_soc_mV: FloatArray) -> Matrix:
    known = by_soc_mV[np.isfinite(by_soc_mV)]
    least = float(known.min()) if known.size else 1.0
    most = max(float(known.max()) if known.size else 1.0, LEAST_SPAN * least)
    step = 100 // SOC_BINS
    return Matrix(
        rows=names,
        columns=[f"{k * step}–{(k + 1) * step}" for k in range(SOC_BINS)],
        values=by_soc_mV,
        text=lambda v: fixed(v, 1) if np.isfinite(v) else MISSING,
        colours=mpl.colormaps["YlOrBr"],
        scale=LogNorm(vmin=max(least, 1e-3), vmax=most),
    )
