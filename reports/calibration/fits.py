"""Every test, measured and simulated."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from reports.calibration.drawings import sheet
from reports.calibration.report import CalibrationReport
from reports.plots import COMMANDED, MEASURED, SIMULATED, decimate, legend, to_svg
from reports.quantity import ampere_hours, fixed, significant
from reports.section import Cell, Column, Figure, Notice, Section, Severity, Table
from twin.calibrate.checks import Fitted
from twin.calibrate.phases import phases
from twin.calibrate.resample import FLOOR_V, Sampled
from twin.load import Between

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = npt.NDArray[np.float64]

ALL_COLUMNS, MOST_COLUMNS, LEAST_COLUMNS = 1800, 600, 100
"""Of the drawings of all tests together, and of each: many tests must not make the page huge."""
DETAIL = 0.05  # of a test: the stretch that is drawn again, larger
BUSY = 4  # changes of the current in it, at least
UNITS = ((7200.0, 3600.0, "h"), (600.0, 60.0, "min"), (0.0, 1.0, "s"))
"""(shortest time [s] that is shown in it, its length [s], its name)"""
COLUMNS = (
    Column(title="test", numeric=False),
    Column(title="samples"),
    Column(title="compared"),
    Column(title="duration"),
    Column(title="charge drawn [Ah]"),
    Column(title="current of a cell [A]"),
    Column(title="voltage of a cell [V]"),
)


def fits(report: CalibrationReport) -> Section:
    """Voltage of every test, as measured, as fitted, and as predicted without it."""
    tests = report.found.fitted
    columns = min(MOST_COLUMNS, max(LEAST_COLUMNS, ALL_COLUMNS // len(tests)))
    held = any(f.held_out_V is not None for f in tests)
    also = (
        " Orange: the same test predicted by a fit to the others, of which it shows only where it "
        "starts." if held else ""
    )  # fmt: skip
    return Section(
        id="fits",
        title="Measured and simulated",
        lead=(f"Voltages and currents are those of one cell.{also}",),
        notices=tuple(_ended(f) for f in tests if not np.isfinite(f.simulated_V).all()),
        figures=tuple(_figure(f, k, columns) for k, f in enumerate(tests)),
        tables=(_table(report),),
        notes=(
            "Lines are drawn through the first, lowest, highest and last sample of each of "
            f"{columns} columns, so that no peak is lost. The grey band is the noise of the "
            "recording, one standard deviation either way.",
        ),
    )


def _ended(f: Fitted) -> Notice:
    done = int(np.argmin(np.isfinite(f.simulated_V)))
    at_s = float(f.time_s[max(done - 1, 0)])
    text = (
        f"{f.name}: the simulated cell comes to {_time(at_s)} of {_time(float(f.time_s[-1]))} "
        "only; beyond that it has no voltage, and the test as a whole no error."
    )
    return Notice(text=text, severity=Severity.DOUBT)


def _figure(f: Fitted, number: int, columns: int) -> Figure:
    closer = busiest(f)
    _, unit_s, unit = _unit(float(f.time_s[-1]))
    canvas, axes = sheet(
        4.6, nrows=3, ncols=1 if closer is None else 2, sharex="col",
        height_ratios=(0.9, 2.2, 1.4), width_ratios=(1,) if closer is None else (1.5, 1),
    )  # fmt: skip
    _draw(axes[:, 0], f, slice(None), unit_s, columns)
    legend(axes[1, 0])
    if closer is not None:
        rows = slice(*np.searchsorted(f.time_s, closer).tolist())
        _draw(axes[:, 1], f, rows, unit_s, columns)
        axes[0, 1].set_title("the same, larger", fontsize=9, loc="left")
        for ax in axes[:, 0]:
            ax.axvspan(closer[0] / unit_s, closer[1] / unit_s, color="#f3ead2", zorder=0)
    for ax, label in zip(
        axes[:, 0], ("current [A]", "voltage [V]", "measured −\nsimulated [mV]"), strict=True
    ):
        ax.set_ylabel(label)
    for ax in axes[-1]:
        ax.set_xlabel(f"time [{unit}]")
    canvas.align_ylabels()
    return Figure(
        caption=f"{f.name}: {_said(f)}.",
        description=f"Current, voltage and error of the test {f.name} over time; {_said(f)}.",
        svg=to_svg(canvas, f"fit{number}"),
    )


def _draw(
    axes: npt.NDArray[np.object_], f: Fitted, rows: slice, unit_s: float, columns: int
) -> None:
    current, voltage, error = axes

    def line(ax: "Axes", values: FloatArray, colour: str, label: str, **look: Any) -> None:
        t_s, y = decimate(f.time_s[rows], values[rows], columns)
        if np.isfinite(y).any():
            ax.plot(t_s / unit_s, y, color=colour, label=label, **look)

    runs = "steps-post" if f.between is Between.HOLD else "default"
    line(current, f.current_A, MEASURED, "", drawstyle=runs)
    line(voltage, f.measured_V, MEASURED, "measured", linewidth=1.6)
    if f.held_out_V is not None:
        line(voltage, f.held_out_V, COMMANDED, "predicted from the other tests")
        line(error, 1e3 * (f.measured_V - f.held_out_V), COMMANDED, "")
    line(voltage, f.simulated_V, SIMULATED, "fitted")
    error.axhspan(-1e3 * f.noise_V, 1e3 * f.noise_V, color="#e3e3e3", zorder=0)
    line(error, 1e3 * (f.measured_V - f.simulated_V), SIMULATED, "")
    error.axhline(0.0, color=MEASURED, linewidth=0.5)
    error.set_xlim(float(f.time_s[rows][0]) / unit_s, float(f.time_s[rows][-1]) / unit_s)


def busiest(f: Fitted) -> tuple[float, float] | None:
    """The short stretch [s] in which the current changes most often; None if it hardly does."""
    changed_s = f.time_s[phases(f.current_A, f.measured_V, felt_V=FLOOR_V)]
    width_s = DETAIL * float(f.time_s[-1])
    within = np.searchsorted(changed_s, changed_s + width_s) - np.arange(changed_s.size)
    first = int(np.argmax(within))
    if within[first] < BUSY:
        return None
    start_s = max(0.0, float(changed_s[first]) - 0.1 * width_s)
    return start_s, min(start_s + 1.2 * width_s, float(f.time_s[-1]))


def _said(f: Fitted) -> str:
    fit = f"{fixed(1e3 * f.rms_V, 2)} mV RMS fitted"
    held = f.held_out_rms_V
    if held is not None:
        fit += f", {fixed(1e3 * held, 2)} mV predicted from the other tests"
    return f"{fit}, noise {fixed(1e3 * f.noise_V, 2)} mV"


def _table(report: CalibrationReport) -> Table:
    """`Sampled` knows what is compared of each test."""
    compared = {t.name: t for t in report.found.problem.tests}
    rows = tuple(
        tuple(Cell(text=text) for text in (f.name, *_numbers(f, compared[f.name])))
        for f in report.found.fitted
    )
    return Table(caption="The tests", columns=COLUMNS, rows=rows)


def _numbers(f: Fitted, compared: Sampled) -> tuple[str, ...]:
    amps, volts = (
        f"{significant(float(v.min()), 3)} to {significant(float(v.max()), 3)}"
        for v in (f.current_A, f.measured_V)
    )
    samples = str(f.time_s.size), str(compared.at.size)
    drawn = ampere_hours(float(compared.drawn_C[-1]))
    return (*samples, _time(float(f.time_s[-1])), drawn, amps, volts)


def _unit(duration_s: float) -> tuple[float, float, str]:
    return next(u for u in UNITS if duration_s >= u[0])


def _time(time_s: float) -> str:
    _, unit_s, unit = _unit(time_s)
    return f"{fixed(time_s / unit_s, 1)} {unit}"
