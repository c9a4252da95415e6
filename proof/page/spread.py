"""Points in rows along one scale, each row with its median."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FuncFormatter

from proof.outcome import Judged
from proof.tally import recorded
from proof.targets import OVER_NOISE
from reports.plots import COMMANDED, MEASURED, SIMULATED, named_rows, panels, to_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW_IN = 0.5
ASIDE = 0.22  # of a row: points lie so far above and below its middle
GOLDEN = 0.6180339887  # steps by it spread points evenly, whatever their number


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """A row: values over the floor with the trials that they are of."""

    name: str
    ours: bool
    points: tuple[tuple[float, Judged], ...]


def spread(methods: Sequence[Method], name: str) -> str:
    """As SVG, on a logarithmic scale."""
    canvas, (ax,) = panels([0.95 + ROW_IN * len(methods)])
    draw(ax, methods)
    return to_svg(canvas, name)


def draw(ax: "Axes", methods: Sequence[Method]) -> None:
    """Held-out errors over the floor, a row a method."""
    for k, method in enumerate(methods):
        colour = SIMULATED if method.ours else COMMANDED
        for real in (False, True):
            here = [(x, k + aside(i)) for i, (x, t) in enumerate(method.points)
                    if recorded(t) is real]  # fmt: skip
            if here:
                face = colour if real else "white"
                ax.plot(
                    *zip(*here, strict=True),
                    "o",
                    markersize=5,
                    color=colour,
                    markerfacecolor=face,
                    alpha=0.85,
                )
        if method.points:
            middle = float(np.median([x for x, _ in method.points]))
            ax.plot([middle, middle], [k - 0.36, k + 0.36], color=MEASURED, linewidth=1.6)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    ax.xaxis.set_minor_formatter(FuncFormatter(lambda x, _: _minor(ax, x)))
    ax.tick_params(axis="x", which="minor", labelsize=8)
    ax.axvline(1.0, color=MEASURED, linewidth=0.8)
    ax.axvline(OVER_NOISE, color=MEASURED, linewidth=0.8, linestyle="--")
    for x, text in ((1.0, "floor "), (OVER_NOISE, f" {OVER_NOISE} ×")):
        ax.annotate(
            text, (x, 1.0), xycoords=("data", "axes fraction"), fontsize=8, va="bottom",
            ha="right" if x == 1.0 else "left",
        )  # fmt: skip
    ax.set_xlabel("held-out error over the floor\n(open: simulated, filled: recorded)")
    named_rows(ax, [m.name for m in methods])


def aside(place: int) -> float:
    """Of a point in its row, from -ASIDE to ASIDE."""
    return ASIDE * (2.0 * ((place * GOLDEN) % 1.0) - 1.0)


def _minor(ax: "Axes", x: float) -> str:
    """Labels of 2 and 5, where the scale spans few decades."""
    low, high = ax.get_xlim()
    leading = f"{x:.0e}"[0]
    return f"{x:g}" if leading in "25" and high < 300 * low else ""
