"""The drawing of the README from one run of `twin prove` or several.

Outcomes by class, and errors beside the baselines'.

python -m benchmarks.proof_figure docs/proof.png RUN [RUN ...]
"""

import io
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas

from proof.outcome import Baseline, Judged, Outcome, Proof, Stamp
from proof.page.baselines import methods
from proof.page.spread import draw
from proof.tally import Tally, by_class
from proof.truth import Truth
from reports.plots import MEASURED, STYLE, WIDTH_IN, named_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NEVER = Stamp(utc="", sha256="", entry="")
COLOURS = {
    Outcome.RIGHT: "#56b4a0",
    Outcome.PART: "#c9c9c9",
    Outcome.MISSED: "#8c8c8c",
    Outcome.WRONG: "#d55e00",
}
DPI = 130


def trials(run: Path) -> Iterator[Judged]:
    """Of the `proof.json` in a folder, as far as the drawing shows them."""
    for t in json.loads((run / "proof.json").read_text())["trials"]:
        yield _judged(t)


def _judged(t: dict[str, Any]) -> Judged:
    return Judged(
        name=t["name"], source=t["source"], truth=_truth(t["truth"]), verdict=t["verdict"],
        named=(), outcome=Outcome(t["outcome"]), noise_V=_volts(t["noise_mv"]),
        held_out_before_V=_volts(t["held_out_before_mv"]),
        held_out_after_V=_volts(t["held_out_after_mv"]),
        baselines=tuple(
            Baseline(
                id=b["id"], what=b["what"], numbers=b["numbers"],
                held_out_V=_volts(b["held_out_mv"]),
            )
            for b in t["baselines"]
        ),
        sized=(), channels=(), capacity_C=None,
        sealed=NEVER, judged=NEVER, opened=NEVER, seconds=t["seconds"],
    )  # fmt: skip


def _truth(t: dict[str, Any]) -> Truth:
    return Truth(
        kind=t["kind"], said=t["said"], verdicts=(), effects=(), strength=t["strength"],
        floor_V=_volts(t["floor_mv"]), noise_V=_volts(t["sample_noise_mv"]),
    )  # fmt: skip


def _volts(millivolts: float | None) -> float:
    """NaN of null."""
    return float("nan") if millivolts is None else 1e-3 * millivolts


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


def main(picture: Path, runs: list[Path]) -> None:
    """Draw the trials of all runs as one."""
    proof = Proof(
        seed=0, command="", trials=tuple(t for run in runs for t in trials(run)), not_made=(),
        versions={}, code="", head="", seconds=0.0,
    )  # fmt: skip
    picture.write_bytes(figure_png(proof))


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(run) for run in sys.argv[2:]])
