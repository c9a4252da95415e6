"""Hidden differences between 4 cells in series made by PyBaMM, told apart. 3 min on two cores.

    python -m benchmarks.cells_pybamm

The DFN of the built-in LiPo cell (PyBaMM's own mesh) four times under one current: a cell with
capacity factor f is the same cell under current / f. 2C and pulses from full, 2 mV of noise in each
cell. The fit starts from the built-in cell and knows nothing of the differences.
"""

import time
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybamm

from tests.reference.dfn import DEFAULT, simulation
from tests.twin.calibrate.synthetic import NOISE_V, PROTOCOLS, load_of
from twin.builtin import load_cell
from twin.calibrate.cells_problem import QUANTITIES
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import fit, problem_of
from twin.calibrate.unlike import part
from twin.effects import WeakCell
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

HIDDEN = (
    WeakCell(cell=1, capacity_factor=1.02),
    WeakCell(cell=2, capacity_factor=0.93, soc_offset=-0.03, resistance_ohm=2e-3),
    WeakCell(cell=3, soc_offset=-0.01),
    WeakCell(cell=4, capacity_factor=1.03, soc_offset=-0.005, resistance_ohm=5e-4),
)
NAMES = ("2C", "pulses")


def voltage_V(weak: WeakCell, time_s: FloatArray, current_A: FloatArray) -> FloatArray:
    """(m,) of one cell as far as PyBaMM comes; the current is held between the samples."""
    edges = time_s[1:] - 1e-3
    times = np.sort(np.concatenate([time_s, edges]))
    held = current_A[np.searchsorted(time_s, times, side="right") - 1]
    current = pybamm.Interpolant(times, held / weak.capacity_factor, pybamm.t)
    with resources.as_file(resources.files("twin") / "cells" / "lipo_2200.bpx.json") as file:
        made = simulation(Path(file), current, mesh=DEFAULT, thermal="isothermal", tolerance=1e-6)
    values = made.parameter_values
    start = [values[f"Initial concentration in {s} electrode [mol.m-3]"] for s in
             ("negative", "positive")]  # fmt: skip
    cell = load_cell("lipo_2200")
    for side, full in zip(("negative", "positive"), start, strict=True):
        electrode = getattr(cell, side)
        low, high = electrode.stoichiometry_min, electrode.stoichiometry_max
        slope = (high - low) * (1 if side == "negative" else -1) * weak.soc_offset
        most = electrode.max_concentration_mol_m3
        values[f"Initial concentration in {side} electrode [mol.m-3]"] = full + slope * most
    solution = made.solve(time_s[[0, -1]], t_interp=time_s)
    shown = solution["Terminal voltage [V]"](time_s[time_s <= solution.t[-1]])
    ohmic = weak.resistance_ohm * current_A[: shown.size]
    return np.asarray(shown - ohmic, dtype=float)


def measured(name: str, noise: np.random.Generator) -> ReferenceTest:
    """One protocol, until the mean cell is empty."""
    cell = load_cell("lipo_2200")
    time_s, current_A = load_of(PROTOCOLS[name], cell.nominal_capacity_C / 3600)
    volts = [voltage_V(weak, time_s, current_A) for weak in HIDDEN]
    n = min(v.size for v in volts)
    cells_V = np.stack([v[:n] for v in volts])
    over = cells_V.mean(axis=0) < cell.lower_cut_off_V
    n = int(np.argmax(over)) if over.any() else n
    cells_V = cells_V[:, :n] + NOISE_V * noise.standard_normal((len(HIDDEN), n))
    return ReferenceTest(
        name=name, time_s=time_s[:n], current_A=current_A[:n], voltage_V=cells_V.mean(axis=0),
        cells_V=cells_V,
    )  # fmt: skip


def main() -> None:
    """Print truth and answer of each quantity."""
    begun, noise = time.perf_counter(), np.random.default_rng(2)
    tests = [measured(name, noise) for name in NAMES]
    print(f"made in {time.perf_counter() - begun:.0f} s", flush=True)
    pack = replace(Pack(cell=load_cell("lipo_2200")), series=len(HIDDEN))
    *_, best = fit(problem_of(pack, tests))
    parted = part(best, tests, parallel=1, soc=1.0)
    assert parted is not None
    scale = float(np.mean([w.capacity_factor for w in parted.unlike.weak] or [1.0]))
    for quantity, found in zip(QUANTITIES, parted.unlike.differences, strict=True):
        hidden = np.array([getattr(w, quantity) for w in HIDDEN])
        truth = (hidden - hidden.mean()) * (scale if quantity == QUANTITIES[0] else 1.0)
        off = (found.value - truth) / found.std
        print(f"{quantity}: hidden {truth.round(5)}, found {found.value.round(5)}, "
              f"standard errors off {off.round(1)}")  # fmt: skip
    print(f"rms, mV: alike {(1e3 * parted.unlike.before_V).round(2)}, "
          f"apart {(1e3 * parted.unlike.after_V).round(2)}")  # fmt: skip
    print(f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
