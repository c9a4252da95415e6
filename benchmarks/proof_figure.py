"""The drawing of the README from one run of `twin prove` or several.

python -m benchmarks.proof_figure docs/proof.png RUN [RUN ...]
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from proof.outcome import Baseline, Judged, Outcome, Proof, Stamp
from proof.page.figure import figure_png
from proof.truth import Truth

NEVER = Stamp(utc="", sha256="", entry="")


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
        floor_V=_volts(t["floor_mv"]),
    )  # fmt: skip


def _volts(millivolts: float | None) -> float:
    """NaN of null."""
    return float("nan") if millivolts is None else 1e-3 * millivolts


def main(picture: Path, runs: list[Path]) -> None:
    """Draw the trials of all runs as one."""
    proof = Proof(
        seed=0, command="", trials=tuple(t for run in runs for t in trials(run)), not_made=(),
        versions={}, head="", seconds=0.0,
    )  # fmt: skip
    picture.write_bytes(figure_png(proof))


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(run) for run in sys.argv[2:]])
