"""The proof in one drawing, for a README: outcomes by class, and errors beside the baselines'."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas

from proof.outcome import Outcome, Proof
from proof.page.baselines import methods
from proof.page.spread import draw
from proof.tally import Tally, by_class
from reports.plots import MEASURED, STYLE, WIDTH_IN, named_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {
    Outcome.RIGHT: "#56b4a0",
    Outcome.PART: "#c9c9c9",
    Outcome.MISSED: "#8c8c8c",
    Outcome.WRONG: "#d55e00",
}
DPI = 130


def figure_png(proof: Proof) -> bytes:
    """As PNG."""
    canvas = drawing(proof)
    FigureCanvasAgg(canvas)
    out = io.BytesIO()
    with mpl.rc_context(STYLE):
        canvas.savefig(out, format="png", dpi=DPI, metadata={"Software": None})
    return out.getvalue()


def drawing(proof: Proof) -> Canvas:
    """Outcomes at the left; errors at the right if there is something to compare."""
    own = [t for t in proof.trials if t.baselines]
    shares = by_class(proof.trials)
    height_in = 1.3 + 0.3 * max(len(shares), 6)
    with mpl.rc_context(STYLE):
        canvas = Canvas(figsize=(WIDTH_IN, height_in), layout="constrained")
        axes = canvas.subplots(1, 2 if own else 1, squeeze=False)[0]
    _outcomes(axes[0], shares)
    if own:
        axes[0].set_title("verdicts beside the truth", fontsize=9, loc="left", pad=26)
        draw(axes[1], methods(own))
        axes[1].set_title("error on what was held out", fontsize=9, loc="left", pad=26)
    return canvas


def _outcomes(ax: "Axes", shares: Sequence[Tally]) -> None:
    for outcome, colour in COLOURS.items():
        before = [sum(t.outcomes[o] for o in list(COLOURS)[: list(COLOURS).index(outcome)])
                  / t.right.of for t in shares]  # fmt: skip
        wide = [t.outcomes[outcome] / t.right.of for t in shares]
        ax.barh(range(len(shares)), [100 * w for w in wide], left=[100 * b for b in before],
                color=colour, label=outcome.value, height=0.72)  # fmt: skip
    for k, t in enumerate(shares):
        ax.text(101, k, f"{t.right.count} of {t.right.of}", va="center", fontsize=8, color=MEASURED)
    ax.set_xlim(0, 100)
    ax.set_xlabel("share of the trials [%]")
    ax.grid(visible=False)
    named_rows(ax, [t.what for t in shares])
    if shares:
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, frameon=False, fontsize=8,
                  borderaxespad=0.2)  # fmt: skip
