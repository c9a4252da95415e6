"""Real cells calibrated to their fit tests, and judged on the tests held out.

    python -m benchmarks.calibration_real [--evaluations N] [CELL ...]

CELL: lg_m50, samsung, panasonic, nmc, lfp. Root mean square of simulated minus measured [mV] in
each test by: what stands for the cell (`benchmarks.real_cells`), the same with its start fitted,
least squares, and least squares with a search (none with N = 0). In all four the measured
temperature is imposed, and all tests start at one state of charge: the calibrated cells at that of
their first fit test, though in the fit each test had its own. Samples that a simulation does not
come to count as 500 mV of error. Left open: rms by which cells drawn from the fit by least squares
differ from it in the test (`twin.mismatch.allowed`), of those that come as far.

The fit itself heats by its own losses; how fast it cools is taken from the temperature of the
fastest fit test. A fit test with gaps in the voltage is fitted as several, each from its own start.
"""

import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from benchmarks.real_cells.__main__ import SHARED
from proof.recorded import about_energy, lg_m50, panasonic, samsung
from proof.recorded.base import cooled
from proof.recorded.measured import (
    NotHere,
    RealCell,
    RealTest,
    narrow,
    recorded_parts,
    wide,
)
from proof.recorded.replay import answer, errors, fitted_shift
from twin.calibrate.doubt import Other, cells_drawn, read_doubt
from twin.calibrate.out import calibrated_cell, fit_text
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import Search, conclude, fit, problem_of
from twin.calibrate.search import search
from twin.effects import SelfHeating, SeriesResistance
from twin.mismatch.allowed import CELLS as CELLS_DRAWN
from twin.pack import Pack

CELLS: dict[str, Callable[[Path], RealCell]] = {
    "lg_m50": lg_m50.cell,
    "samsung": samsung.cell,
    "panasonic": panasonic.cell,
    "nmc": about_energy.nmc,
    "lfp": about_energy.lfp,
}
HEADER = "use | test | as it is | start fitted | least squares | searched | left open"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stand:
    """A pack that stands for a cell, and where its tests start: `shift` of state of charge.

    `others` are cells that its tests allow as well; none where it was not calibrated.
    """

    pack: Pack
    shift: float
    others: tuple[Other, ...] = ()


def to_fit(cell: RealCell) -> tuple[Pack, list[ReferenceTest]]:
    """What is calibrated, with its own cut-offs, and its tests as `twin calibrate` reads them."""
    tests = [part for t in cell.fit for part in recorded_parts(t)]
    pack = replace(cell.baseline, cell=narrow(cell.baseline.cell))
    starts_K = [float(t.temperature_K[0]) for t in tests if t.temperature_K is not None]
    if starts_K:
        pack = cooled(replace(pack, initial_K=float(np.mean(starts_K))), tests)
    return pack, [t.reference(ambient_K=t.start_K(pack.initial_K)) for t in tests]


def calibrated(
    pack: Pack, tests: list[ReferenceTest], finder: Search | None, evaluations: int
) -> Stand:
    """By a fit to `tests`; what it cost and reached goes to the standard error stream."""
    begun = time.perf_counter()
    steps = fit(problem_of(pack, tests), search=finder, evaluations=evaluations)
    for stage, part in groupby(steps, key=lambda p: p.stage):
        *_, best = part
        seconds = time.perf_counter() - begun
        sys.stderr.write(
            f"  {stage}: cost {best.cost:.6g}, {1e3 * best.rms_V:.2f} mV, {seconds:.0f} s\n"
        )
    found = conclude(best.problem, best.q, tests, cross_validate=False)
    if found.correction is not None:
        sys.stderr.write(f"  {found.correction}\n")
    resistance = SeriesResistance(resistance_ohm=found.numbers["series_resistance_ohm"])
    kept = tuple(e for e in pack.effects if not isinstance(e, SelfHeating | SeriesResistance))
    own = Pack(cell=wide(calibrated_cell(found)), effects=(*kept, resistance))
    return Stand(
        pack=own,
        shift=found.problem.mapped(found.q, 0).numbers["initial_soc"] - 1.0,
        others=cells_drawn(own, read_doubt(fit_text(found), name="the fit"), CELLS_DRAWN),
    )


def rows(cell: RealCell, evaluations: int) -> list[str]:
    """Of the table, one a test."""
    pack, tests = to_fit(cell)
    stands = [Stand(pack=cell.baseline, shift=s) for s in (0.0, fitted_shift(cell))]
    stands.append(found := calibrated(pack, tests, None, 0))
    if evaluations:
        stands.append(calibrated(pack, tests, search, evaluations))
    uses = [*(("fit", t) for t in cell.fit), *(("held out", t) for t in cell.held_out)]
    return [
        " | ".join([use, t.name, *(_rms(s, t) for s in stands), _left_open(found, t)])
        for use, t in uses
    ]


def _left_open(stand: Stand, test: RealTest) -> str:
    own_V = answer(stand.pack, test, stand.shift)
    each_V = [answer(other.instead(stand.pack), test, stand.shift) for other in stand.others]
    off_V = [v[: own_V.size] - own_V for v in each_V if v.size >= own_V.size]
    return f"{1e3 * np.sqrt(np.mean(np.square(off_V))):.1f}" if off_V else "-"


def _rms(stand: Stand, test: RealTest) -> str:
    e = errors(answer(stand.pack, test, stand.shift), test)
    return f"{e.of_all:.1f}" + (
        "" if e.covered == 1.0 else f" (ends after {100 * e.covered:.0f} %)"
    )


def main() -> None:
    """A table a cell."""
    parser = ArgumentParser(description="Real cells, calibrated.")
    parser.add_argument("cells", nargs="*", metavar="CELL", choices=[*CELLS, []])  # []: none given
    parser.add_argument("--evaluations", type=int, default=4000, metavar="N")
    given = parser.parse_args()
    for name in given.cells or CELLS:
        try:
            cell = CELLS[name](SHARED)
        except NotHere as e:
            print(f"left out: {e}")
            continue
        kind = "published" if cell.published else "not this cell"
        print(f"{cell.name}; {kind}: {cell.source}\n{HEADER}")
        print("\n".join(rows(cell, given.evaluations)), flush=True)


if __name__ == "__main__":
    main()
