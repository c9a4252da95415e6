"""Channels that had no part in the verdict, beside what the adopted twin says of them."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from reports.mismatch.report import MismatchReport
from reports.plots import COMMANDED, MEASURED, SIMULATED, legend, line, panels, to_svg
from reports.quantity import MISSING, fixed, significant
from reports.section import Cell, Column, Figure, Section, Table
from twin.constants import ZERO_CELSIUS_K
from twin.mismatch import Hidden, Revealed

FloatArray = npt.NDArray[np.float64]

COLUMNS = (
    Column(title="channel", numeric=False),
    Column(title="recording", numeric=False),
    Column(title="samples"),
    Column(title="before, RMS"),
    Column(title="after, RMS"),
    Column(title="before, change since the start"),
    Column(title="after, change since the start"),
)
NAMED = {
    Hidden.TEMPERATURE: "temperature of the pack",
    Hidden.WEAKEST_CELL: "voltage of the weakest cell",
    Hidden.OTHER_CELLS: "mean voltage of the other cells",
}


def revealed(report: MismatchReport) -> Section | None:
    """A drawing of each and a table."""
    if not report.revealed:
        return None
    return Section(
        id="revealed",
        title="Put to the proof",
        lead=(
            "These measurements had no part in the verdict: it was written before they were read. "
            "Before: the twin as configured; after: the twin with what was named.",
            *(() if report.revealed[0].after is not None else (NOT_ADOPTED,)),
        ),
        figures=tuple(_figure(r, k) for k, r in enumerate(report.revealed)),
        tables=(
            Table(
                caption="Predicted minus measured",
                columns=COLUMNS,
                rows=tuple(tuple(Cell(text=t) for t in _texts(r)) for r in report.revealed),
            ),
        ),
    )


NOT_ADOPTED = (
    "Nothing was named, so there is no twin to adopt: only the one as configured is shown."
)


def _texts(r: Revealed) -> tuple[str, ...]:
    def shown(rms: Callable[[FloatArray], float], predicted: FloatArray | None) -> str:
        if predicted is None:
            return MISSING
        return f"{significant(r.factor * rms(predicted), 3)} {r.unit}"

    both = [shown(r.rms, v) for v in (r.before, r.after)]
    change = [shown(r.change_rms, v) for v in (r.before, r.after)]
    return (NAMED[r.channel], r.flight, str(r.time_s.size), *both, *change)


def _figure(r: Revealed, number: int) -> Figure:
    canvas, (ax, error) = panels((1.9, 1.1))
    warm = r.channel is Hidden.TEMPERATURE
    zero = ZERO_CELSIUS_K if warm else 0.0
    twins = [(r.before, COMMANDED, "twin as configured")]
    if r.after is not None:
        twins.append((r.after, SIMULATED, "twin with what was named"))
    for values, colour, label in twins:
        line(ax, r.time_s, values - zero, colour, label)
        line(error, r.time_s, r.factor * (values - r.measured), colour, "")
    line(ax, r.time_s, r.measured - zero, MEASURED, "measured")
    error.axhline(0.0, color=MEASURED, linewidth=0.5)
    ax.set_ylabel("temperature [°C]" if warm else "voltage [V]")
    error.set_ylabel(f"predicted −\nmeasured [{r.unit}]")
    error.set_xlabel("time [s]")
    legend(ax)
    canvas.align_ylabels()
    said = f"{fixed(r.factor * r.rms(r.before), 2)} {r.unit} RMS before"
    if r.after is not None:
        said += f", {fixed(r.factor * r.rms(r.after), 2)} {r.unit} after"
    return Figure(
        caption=f"{NAMED[r.channel]}, {r.flight}: {said}.",
        description=f"Measured and predicted {NAMED[r.channel]} over time; {said}.",
        svg=to_svg(canvas, f"revealed{number}"),
    )
