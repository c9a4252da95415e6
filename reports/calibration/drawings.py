"""Drawings of calibrations: sheets of panels, tables of coloured cells."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure as Canvas

from reports.plots import STYLE, WIDTH_IN

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = npt.NDArray[np.float64]

LONGEST = 22  # letters of a name in a drawing
SMALL = 8.0  # points
BRIGHT = 0.55  # luminance of a cell from which its text is black


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Matrix:
    """A table of numbers, each on a colour.

    Attributes:
        rows: their names, from above.
        columns: their names.
        values: (rows, columns); NaN leaves a cell empty.
        text: what stands in a cell.
        colours: of the values,
        scale: between 0 and 1.
    """

    rows: Sequence[str]
    columns: Sequence[str]
    values: FloatArray
    text: Callable[[float], str]
    colours: Colormap
    scale: Normalize


def sheet(height_in: float, **subplots: Any) -> tuple[Canvas, npt.NDArray[np.object_]]:
    """An empty drawing with panels as `Figure.subplots` takes them, in the style of the pages."""
    with mpl.rc_context(STYLE):
        canvas = Canvas(figsize=(WIDTH_IN, height_in), layout="constrained")
        FigureCanvasSVG(canvas)
        return canvas, canvas.subplots(squeeze=False, **subplots)


def draw(ax: "Axes", matrix: Matrix, *, turned: bool = False) -> None:
    """`matrix` into an empty panel; names of columns above, `turned` if they are long."""
    height, width = matrix.values.shape
    shade = matrix.scale(np.ma.masked_invalid(matrix.values))
    ax.pcolormesh(
        np.arange(width + 1), np.arange(height + 1), shade, cmap=matrix.colours, vmin=0.0, vmax=1.0,
        edgecolor="white", linewidth=1.0,
    )  # fmt: skip
    for (i, j), value in np.ndenumerate(matrix.values):
        if not np.isnan(value):
            text, ink = matrix.text(value).replace("-", "−"), _ink(matrix, value)
            ax.text(
                j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=SMALL, color=ink,
                in_layout=False,  # within its cell: the layout need not measure each of hundreds
            )  # fmt: skip
    ax.set_ylim(height, 0)
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0, labelsize=SMALL, labeltop=True, labelbottom=False)
    ax.set_yticks(np.arange(height) + 0.5, list(matrix.rows), parse_math=False)
    look: dict[str, Any] = {"rotation": 45, "ha": "left", "rotation_mode": "anchor"}
    places = np.arange(width) + 0.5
    ax.set_xticks(places, list(matrix.columns), parse_math=False, **(look if turned else {}))


def _ink(matrix: Matrix, value: float) -> str:
    """What can be read on the colour of a cell; one without a number has none."""
    if not np.isfinite(value):
        return "black"
    red, green, blue, _ = matrix.colours(float(matrix.scale(value)))
    return "white" if 0.3 * red + 0.59 * green + 0.11 * blue < BRIGHT else "black"


def labels(names: Sequence[str], longest: int = LONGEST) -> list[str]:
    """Names of tests as they fit in a drawing: without the words that all begin with."""
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    shared = "".join(letters[0] for letters in alike) if len(names) > 1 else ""
    words = max(shared.rfind(mark) for mark in "_- ") + 1
    return [short(name[words:] or name, longest) for name in names]


def short(name: str, longest: int) -> str:
    """A name that fits; its middle is left out if it does not."""
    if len(name) <= longest:
        return name
    half = (longest - 1) // 2
    return f"{name[:half]}…{name[-half:]}"
