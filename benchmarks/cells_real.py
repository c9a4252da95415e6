"""Unlike cells of measured packs: told apart on one part, predicted on another. 5 min on two cores.

    python -m benchmarks.cells_real

Both packs have voltages of their cells. A Nissan Leaf module of 6 pairs of cells, aged, 1C down to
where the weakest is empty: fitted to the first 85 % of the time, predicted is the rest, where the
cells part. A DJI Phantom pack of 4 cells in 93 s of hover at 1 Hz: fitted to the first 60 s. The
cell to start from is a built-in one. Root mean square [mV] of each cell's difference from the mean
of the cells, measured minus simulated, over what is predicted: with all cells alike, with each as
it was offset at the last sample that was fitted, and as the twin has them apart.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from benchmarks.real_cells.__main__ import SHARED
from proof.recorded import leaf_module
from proof.recorded.measured import NotHere, recording
from proof.recorded.trials_weak import PHANTOM
from twin.at_rest import OVERFULL
from twin.builtin import load_cell
from twin.calibrate.cells_problem import QUANTITIES
from twin.calibrate.out import calibrated_cell
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import conclude, fit, problem_of
from twin.calibrate.unlike import part
from twin.effects import SeriesResistance
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate

FloatArray = npt.NDArray[np.float64]

BEYOND_V = 0.5  # below its cut-off a cell goes on


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """One recording: columns (n,) time, current of the pack, then (cells, n) voltages."""

    pack: Pack
    time_s: FloatArray
    current_A: FloatArray
    cells_V: FloatArray
    fitted_s: float
    between: Between


def leaf() -> Measured:
    """3 modules of 2s2p: 6 in series, 2 parallel."""
    cells = leaf_module.module(SHARED)
    pack = Pack(
        cell=load_cell("lg_m50"), series=leaf_module.SERIES, parallel=leaf_module.PARALLEL,
        capacity_C=66 * 3600.0,
    )  # fmt: skip
    return Measured(
        pack=pack, time_s=cells.time_s, current_A=cells.current_A, cells_V=cells.cell_voltage_V.T,
        fitted_s=0.85 * float(cells.time_s[-1]), between=Between.HOLD,
    )  # fmt: skip


def phantom() -> Measured:
    """4 in series, in hover."""
    rows = np.loadtxt(recording(SHARED, PHANTOM), delimiter=",", skiprows=1)
    pack = Pack(cell=load_cell("lipo_2200"), series=4, capacity_C=4.349 * 3600, initial_soc=0.85)
    return Measured(
        pack=pack, time_s=rows[:, 0] - rows[0, 0], current_A=-rows[:, 1], cells_V=rows[:, 3:7].T,
        fitted_s=60.0, between=Between.LINEAR,
    )  # fmt: skip


def answer(pack: Pack, m: Measured) -> FloatArray:
    """(cells, n) simulated."""
    load = Load(time_s=m.time_s, current_A=m.current_A, between=m.between)
    solution = simulate(pack, load)
    out = np.full(m.cells_V.shape, np.nan)
    out[:, : solution.time_s.size] = solution.cell_voltage_V
    return out


def row(name: str, measured: Callable[[], Measured]) -> str:
    """Of the table, and the cells above it."""
    m, begun = measured(), time.perf_counter()
    early = m.time_s <= m.fitted_s
    test = ReferenceTest(
        name=name, time_s=m.time_s[early], current_A=m.current_A[early] / m.pack.parallel,
        voltage_V=m.cells_V[:, early].mean(axis=0), cells_V=m.cells_V[:, early],
        between=m.between,
    )  # fmt: skip
    *_, best = fit(problem_of(m.pack, [test]))
    soc = min(best.problem.mapped(best.q, 0).numbers["initial_soc"], OVERFULL)
    parted = part(best, [test], parallel=m.pack.parallel, soc=soc)
    assert parted is not None
    found = conclude(parted.best.problem, parted.best.q, list(parted.tests), cross_validate=False)
    for d in parted.unlike.differences:
        said = "beyond the noise" if d.beyond_noise else "not beyond the noise"
        shown = ", ".join(f"{v:+.4f}±{s:.4f}" for v, s in zip(d.value, d.std, strict=True))
        print(f"{name}: {d.quantity} {shown} ({said}, chance {d.chance:.1g})")
    print(f"{name}: fitted rms, alike {1e3 * parted.unlike.before_V.round(5)} mV, "
          f"apart {1e3 * parted.unlike.after_V.round(5)} mV")  # fmt: skip
    cell = calibrated_cell(found)
    cell = cell.beyond(BEYOND_V, upper_V=0.0)
    ohm = found.numbers["series_resistance_ohm"] * m.pack.series / m.pack.parallel
    start = min(found.problem.mapped(found.q, 0).numbers["initial_soc"], 1.0)
    alike = Pack(cell=cell, series=m.pack.series, parallel=m.pack.parallel, initial_soc=start,
                 effects=(SeriesResistance(resistance_ohm=ohm),))  # fmt: skip
    apart = replace(alike, effects=(*alike.effects, *parted.unlike.weak))
    late, (same, own) = ~early, (answer(p, m) for p in (alike, apart))
    spread = m.cells_V - m.cells_V.mean(axis=0)
    held = spread[:, early][:, -20:].mean(axis=1, keepdims=True)
    errors = spread, spread - held, spread - (own - own.mean(axis=0))
    mean = m.cells_V.mean(axis=0)
    shown = [f"{1e3 * np.sqrt(np.nanmean(e[:, late] ** 2)):.1f}" for e in errors]
    shown += [f"{1e3 * np.sqrt(np.nanmean((mean - s.mean(axis=0))[late] ** 2)):.1f}"
              for s in (same, own)]  # fmt: skip
    lost = int(np.isnan(own[0]).sum())
    return (
        f"{name} | {' | '.join(shown)} | {lost} of {int(late.sum())} not reached "
        f"| {time.perf_counter() - begun:.0f} s | {', '.join(QUANTITIES)}"
    )


def main() -> None:
    """Print the table."""
    rows = []
    for name, measured in (("leaf", leaf), ("phantom", phantom)):
        try:
            rows.append(row(name, measured))
        except NotHere as e:
            rows.append(f"left out: {e}")
    print("pack | differences: alike | as offset before | apart | mean cell, mean of all: alike "
          "| apart")  # fmt: skip
    for line in rows:
        print(line)


if __name__ == "__main__":
    main()
