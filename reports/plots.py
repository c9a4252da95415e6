"""Drawings as SVG: the same input gives the same bytes."""

import io
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch

from segment.segment import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = npt.NDArray[np.float64]

# Okabe and Ito's palette, told apart by people of any colour vision, with a grey and a violet.
MOTION_COLOUR = {
    Motion.GROUND: "#cfcfcf",
    Motion.TAKEOFF: "#f0e442",
    Motion.LANDING: "#cc79a7",
    Motion.HOVER: "#56b4e9",
    Motion.VERTICAL: "#e69f00",
    Motion.HORIZONTAL: "#009e73",
    Motion.MIXED: "#6a51a3",
}
MEASURED, COMMANDED, SIMULATED = "#1b1b1b", "#d55e00", "#0072b2"
DRAWN_GAP_S = 2.0  # a line across a longer stretch without samples would be an invention
WIDTH_IN = 11.0
ROW_IN = 0.235  # height of a row of text
COLUMNS = 1000  # drawn width in pixels: finer detail than a column of the screen cannot be seen
DECIMALS = re.compile(r"(\.\d\d)\d+")  # a hundredth of a point is finer than any screen
HASH = re.compile(r"(?<=[\"#])[pm][0-9a-f]{10}(?=[\")])")
STYLE: Any = {  # its keys are typed as literals too many to name
    "svg.fonttype": "none",  # text stays text: small, searchable, in the reader's font
    "svg.hashsalt": "drone-battery-health",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.linewidth": 0.4,
    "grid.color": "#d9d9d9",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "lines.linewidth": 0.9,
}


def decimate(
    time_s: FloatArray, values: FloatArray, columns: int = COLUMNS
) -> tuple[FloatArray, FloatArray]:
    """The samples that decide what a line of `columns` pixels looks like.

    In each column the first, the lowest, the highest and the last sample are kept, so no peak is
    lost; a column without a single finite sample gives NaN, which breaks the line.
    """
    if time_s.size <= 4 * columns:
        return time_s, values
    edges = np.linspace(time_s[0], time_s[-1], columns + 1)
    cuts = np.searchsorted(time_s, edges[1:-1])
    kept: list[int] = []
    for part in np.split(np.arange(time_s.size), cuts):
        finite = part[np.isfinite(values[part])]
        if finite.size:
            lowest, highest = finite[np.argmin(values[finite])], finite[np.argmax(values[finite])]
            kept += sorted({int(finite[0]), int(lowest), int(highest), int(finite[-1])})
        if part.size > finite.size:
            kept.append(int(part[~np.isfinite(values[part])][0]))
    index = np.unique(kept)
    return time_s[index], values[index]


def broken_at_gaps(
    time_s: FloatArray, values: FloatArray, gap_s: float = DRAWN_GAP_S
) -> tuple[FloatArray, FloatArray]:
    """The same line, with a NaN in every step longer than `gap_s`, so that none is drawn there."""
    after = np.flatnonzero(np.diff(time_s) > gap_s) + 1
    middle = (time_s[after - 1] + time_s[after]) / 2
    return np.insert(time_s, after, middle), np.insert(values, after, np.nan)


def line(ax: "Axes", time_s: FloatArray, values: FloatArray, colour: str, label: str) -> None:
    """Draw `values` over time, broken at gaps; nothing at all if none of them is finite."""
    t, y = decimate(*broken_at_gaps(time_s, values))
    if np.isfinite(y).any():
        ax.plot(t, y, color=colour, label=label)


def panels(heights_in: Sequence[float], *, share_x: bool = True) -> tuple[Canvas, list["Axes"]]:
    """An empty drawing of panels below each other, with a common time axis if `share_x`."""
    with mpl.rc_context(STYLE):
        canvas = Canvas(figsize=(WIDTH_IN, sum(heights_in)), layout="constrained")
        FigureCanvasSVG(canvas)
        axes = canvas.subplots(
            len(heights_in), 1, sharex=share_x, squeeze=False, height_ratios=list(heights_in)
        )
    return canvas, list(axes[:, 0])


def second_scale(ax: "Axes") -> "Axes":
    """A scale of its own on the right of a panel, for a second quantity."""
    with mpl.rc_context(STYLE):
        right = ax.twinx()
    right.grid(visible=False)
    right.spines["right"].set_visible(True)
    return right


class Moving(Protocol):
    """A time with one motion: a `Segment`, or what is known of one."""

    @property
    def motion(self) -> Motion:
        """What the vehicle did."""

    @property
    def start_s(self) -> float:
        """From when."""

    @property
    def stop_s(self) -> float:
        """Until when."""


def shade(axes: Sequence["Axes"], segments: Sequence[Moving]) -> None:
    """Colour the background of each panel by motion."""
    for ax in axes:
        for segment in segments:
            ax.axvspan(
                segment.start_s, segment.stop_s,
                facecolor=MOTION_COLOUR[segment.motion], alpha=0.28, linewidth=0,
            )  # fmt: skip


def legend(ax: "Axes", also: "Axes | None" = None) -> None:
    """Names of the lines, above the panel, where they hide nothing."""
    handles = [*ax.get_lines(), *(also.get_lines() if also else ())]
    named = [h for h in handles if not str(h.get_label()).startswith("_")]
    if named:
        ax.legend(
            handles=named, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(named),
            borderaxespad=0.1, frameon=False, fontsize=9,
        )  # fmt: skip


def rgb(motion: Motion) -> tuple[float, float, float]:
    """The motion's colour as three numbers in 0..1."""
    return to_rgb(MOTION_COLOUR[motion])


def motion_name(motion: Motion) -> str:
    """As a person writes it."""
    return "take-off" if motion is Motion.TAKEOFF else motion.value


def motion_key(canvas: Canvas, segments: Sequence[Moving]) -> None:
    """A legend of the motions that occur, above the drawing."""
    present = [m for m in Motion if any(s.motion is m for s in segments)]
    if present:
        handles = [
            Patch(
                facecolor=MOTION_COLOUR[m], alpha=0.5, label=m.value.replace("takeoff", "take-off")
            )
            for m in present
        ]
        canvas.legend(
            handles=handles, loc="outside upper left", ncols=len(present), frameon=False, fontsize=9
        )


def to_svg(canvas: Canvas, name: str, *, text_as_paths: bool = False) -> str:
    """A complete `<svg>` element as wide as its place, every id in it starting with `name`.

    `text_as_paths` is for formulas, whose fonts a reader may not have.
    """
    out = io.StringIO()
    with mpl.rc_context(STYLE | ({"svg.fonttype": "path"} if text_as_paths else {})):
        canvas.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    svg = out.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(?<= d=")[^"]*', lambda m: DECIMALS.sub(r"\1", m.group()), svg)
    number: dict[str, str] = {}  # hashes of coordinates differ with the last bit of the layout
    svg = HASH.sub(lambda m: number.setdefault(m.group(), f"{m.group()[0]}{len(number)}"), svg)
    svg = re.sub(r'\b(id="|href="#|url\(#)', rf"\g<1>{name}-", svg)
    svg = re.sub(r'(<svg\b[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg\b[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    return svg.replace("<svg ", '<svg aria-hidden="true" ', 1)


def named_rows(ax: "Axes", names: Sequence[str]) -> None:
    """Names at the left of rows 0, 1, ... from above."""
    ax.set_yticks(range(len(names)), list(names), parse_math=False)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)
