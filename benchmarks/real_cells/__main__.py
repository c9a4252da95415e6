"""What a calibration has to beat on real cells: `python -m benchmarks.real_cells`.

For each cell the error of what stands for it so far, in the tests that may be fitted and in those
held out: the published parameter set where the cell comes with one, else the nearest built-in cell
with the measured charge. Each as it is, and with the state of charge at the start fitted (one
number, from the fit tests). The measured current is drawn, the measured temperature imposed (25
degC where none was measured). Cells whose recordings are not at hand are left out, and named.
"""

import sys
from collections.abc import Callable
from pathlib import Path

from benchmarks.real_cells import flown
from proof.recorded import about_energy, lg_m50, melasta, panasonic, samsung
from proof.recorded.measured import NotHere, RealCell
from proof.recorded.replay import Errors, baseline_errors, fitted_shift

SHARED = Path(__file__).parents[3] / "shared"
CELLS: tuple[Callable[[Path], RealCell], ...] = (
    panasonic.cell,
    lg_m50.cell,
    samsung.cell,
    about_energy.nmc,
    about_energy.lfp,
    melasta.cell,
    flown.cell,
)


def rows(cell: RealCell) -> list[str]:
    """Of the table, one a test."""
    shift = fitted_shift(cell)
    kind = "published" if cell.published else "not this cell"
    out = [f"{cell.name}: {kind}: {cell.source}; start {100 * shift:+.1f} % of charge"]
    for use, tests in (("fit", cell.fit), ("held out", cell.held_out)):
        for test in tests:
            e, moved = (baseline_errors(cell, test, s) for s in (0.0, shift))
            out.append(
                f"  | {use} | {test.name} | {test.time_s.size} | {test.time_s[-1]:.0f} "
                f"| {_row(e)} | {_row(moved)} |"
            )
    return out


def _row(e: Errors) -> str:
    cut = "" if e.covered == 1.0 else f" (ends after {100 * e.covered:.0f} %)"
    return f"{e.rms:.1f} / {e.largest:.0f} / {e.mean:+.1f}{cut}"


def main() -> None:
    """Print the table."""
    sys.stdout.write("  | use | test | samples | s | rms / max / mean mV | start fitted |\n")
    for load in CELLS:
        try:
            lines = rows(load(SHARED))
        except NotHere as e:
            lines = [f"left out: {e}"]
        sys.stdout.write("\n".join(lines) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
