"""Drawings of the damage: motions beside constant currents, and the flight as it was flown."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from reports import plots
from segment.segment import Motion
from twin.damage import MEASURES, Assessment, Attribution, Part, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TITLES: Mapping[str, str] = {
    "lithium": "lithium lost",
    "negative": "active material, negative",
    "positive": "active material, positive",
    "total": "all three reactions",
    "sei": "SEI",
    "sei_on_cracks": "SEI on cracks",
    "plating": "plating",
}
"""Measure -> its name, in the order they are drawn: modes, then reactions."""
ROWS = (("lithium", "negative", "positive", "total"), ("sei", "sei_on_cracks", "plating", ""))
STEADY = "#6b6b6b"


def normalised_svg(found: Assessment) -> str:
    """Modes above, reactions below: circles are constant currents, stars are motions."""
    with mpl.rc_context(plots.STYLE):
        canvas = Canvas(figsize=(plots.WIDTH_IN, 5.2), layout="constrained")
        FigureCanvasSVG(canvas)
        axes = canvas.subplots(2, 4)
    for row, names in zip(axes, ROWS, strict=True):
        for ax, name in zip(row, names, strict=True):
            if name:
                _panel(ax, found, name)
            else:
                ax.set_axis_off()
                ax.legend(handles=_key(found), loc="center", frameon=False, fontsize=10)
        row[0].set_ylabel("over the lowest constant current")
    return plots.to_svg(canvas, "normalised")


def _panel(ax: "Axes", found: Assessment, name: str) -> None:
    of = number(name, Part.WHOLE)
    base = of(found.baselines.reference)
    values = [of(c) / base for c in found.baselines.cycled]
    ax.plot(
        found.baselines.currents_A, values, color=STEADY, marker="o", markersize=7,
        markerfacecolor="white",
    )  # fmt: skip
    for motion, own in found.motions.items():
        ratio = own.normalised[Part.WHOLE][name]
        half = ratio.error.half_95
        bar = half if np.isfinite(half) else 0.0
        ax.errorbar(
            own.manoeuvre.waveform.mean_A, ratio.value, bar, marker="*", markersize=13,
            color=plots.MOTION_COLOUR[Motion(motion)], markeredgecolor="black",
            markeredgewidth=0.5, ecolor="black",
        )  # fmt: skip
        values.append(ratio.value)
    _keep_wide(ax, values)
    ax.set_title(TITLES[name], loc="left", fontsize=10)
    ax.set_xlabel("mean current [A]")
    ax.ticklabel_format(useOffset=False)


def _keep_wide(ax: "Axes", values: list[float]) -> None:
    """Not less than 2 % from bottom to top: finer differences are those of nothing."""
    middle, half = (max(values) + min(values)) / 2, (max(values) - min(values)) / 2
    half = max(1.25 * half, 0.01)
    ax.set_ylim(middle - half, middle + half)


def _key(found: Assessment) -> list[Line2D]:
    steady = Line2D(
        [], [], color=STEADY, marker="o", markersize=7, markerfacecolor="white",
        label="constant current",
    )  # fmt: skip
    return [steady] + [
        Line2D(
            [],
            [],
            linestyle="",
            marker="*",
            markersize=13,
            markeredgecolor="black",
            markeredgewidth=0.5,
            color=plots.MOTION_COLOUR[Motion(name)],
            label=plots.motion_name(Motion(name)),
        )
        for name in found.motions
    ]


def course_svg(flown: Attribution) -> str:
    """Lithium lost, and active material lost, per minute of each segment over the flight."""
    canvas, axes = plots.panels([1.9, 1.9])
    rates = (
        ("lithium", 1e3 / 3.6, "lithium lost\n[µAh/min]"),
        ("negative", 1e9, "negative material\nlost [10⁻⁹/min]"),
    )
    for ax, (name, scale, label) in zip(axes, rates, strict=True):
        for span, cost in zip(flown.spans, flown.costs, strict=False):
            if cost.duration_s:
                ax.bar(
                    span.start_s, 60 * scale * MEASURES[name](cost.loss) / cost.duration_s,
                    width=cost.duration_s, align="edge", linewidth=0.4, edgecolor="white",
                    color=plots.MOTION_COLOUR[Motion(span.name)],
                )  # fmt: skip
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time since the start of the log [s]")
    return plots.to_svg(canvas, "attribution")
