"""Make calibration cases: `python -m tests.reference.calibration.make [--out DIR] CASE...`.

A CASE is `cell-seed-thermal`, e.g. `lipo_2200-7-isothermal`; any seed. Without one: those stored
here. Writes `cell-seed.bpx.json`, the hidden cell, and `CASE.npz`, its tests by PyBaMM's DFN on two
meshes, the second 1.5 times finer than the first, extrapolated to their limit.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pybamm

from tests.reference.calibration.draw import draw
from tests.reference.calibration.protocol import TICK_S, discharge, flying, pulses
from tests.reference.calibration.stored import HERE, STORED
from tests.reference.dfn import Mesh, simulation, solve_hold, solve_linear
from tests.reference.loads import ReferenceLoad
from tests.reference.make_reference import TOLERANCE, difference_mV, limit
from twin.builtin import load_cell
from twin.constants import ZERO_CELSIUS_K

MESHES = {
    ("lipo_2200", "test"): (Mesh(layer=8, particle=24), Mesh(layer=12, particle=36)),
    ("lipo_2200", "flight"): (Mesh(layer=8, particle=24), Mesh(layer=12, particle=36)),
    ("lg_m50", "test"): (Mesh(layer=36, particle=72), Mesh(layer=54, particle=108)),
    ("lg_m50", "flight"): (Mesh(layer=18, particle=60), Mesh(layer=27, particle=90)),
}


def cut_off_s(file: Path, current_A: float, *, mesh: Mesh, thermal: str) -> float:
    """When a discharge from full reaches the cut-off, to the tick before it."""
    sim = simulation(
        file, current_A, mesh=mesh, thermal=thermal, tolerance=TOLERANCE, cut_offs=True
    )
    longest_s = 1.3 * 3600 * load_cell(file).nominal_capacity_C / 3600 / current_A
    end_s = float(sim.solve([0.0, longest_s]).t[-1])
    assert end_s < longest_s  # the cut-off was reached
    return float(np.floor(end_s / TICK_S)) * TICK_S


def loads(cell_name: str, seed: int, file: Path, thermal: str) -> dict[str, ReferenceLoad]:
    """Test -> its current."""
    rated_Ah = load_cell(cell_name).nominal_capacity_C / 3600
    mesh = MESHES[cell_name, "test"][1]
    out = {}
    for name, rate in (("0.1C", 0.1), ("2C", 2.0)):
        duration_s = cut_off_s(file, rate * rated_Ah, mesh=mesh, thermal=thermal)
        out[name] = discharge(rated_Ah, rate=rate, duration_s=duration_s)
    return out | {"pulses": pulses(rated_Ah), "flight": flying(cell_name, rated_Ah, seed)}


def solve(
    file: Path, test: str, load: ReferenceLoad, *, cell_name: str, thermal: str
) -> tuple[dict[str, object], str]:
    """One test: what is stored of it, and its columns of the README's table."""
    method = solve_hold if load.hold else solve_linear
    began = time.monotonic()
    coarse, fine = (
        method(file, load.time_s, load.current_A, mesh=mesh, thermal=thermal, tolerance=TOLERANCE)
        for mesh in MESHES[cell_name, "flight" if test == "flight" else "test"]
    )
    best_V = limit(coarse.voltage_V, fine.voltage_V)
    error_mV = difference_mV(fine.voltage_V, best_V)
    content: dict[str, object] = {
        f"{test}.time_ds": np.round(10 * load.time_s).astype(np.int32),
        f"{test}.current_A": load.current_A.astype(np.float32),
        f"{test}.voltage_V": best_V.astype(np.float32),
        f"{test}.hold": load.hold,
        f"{test}.finer_mesh_mV": np.array(error_mV),
    }
    warmest = ""
    if thermal == "lumped":
        heated_K = limit(coarse.temperature_K, fine.temperature_K)
        content[f"{test}.temperature_K"] = heated_K.astype(np.float32)
        warmest = f"{heated_K.max() - ZERO_CELSIUS_K:.2f}"
    return content, (
        f"| {test} | {load.time_s.size} | {load.time_s[-1]:.1f} | {best_V.min():.3f} "
        f"| {warmest} | {error_mV[0]:.3f} / {error_mV[1]:.3f} "
        f"| {time.monotonic() - began:.0f} |"
    )


def make(case: str, folder: Path) -> str:
    """Solve one case, write its files, return its rows of the README's table."""
    cell_name, number, thermal = case.split("-")
    hidden = draw(cell_name, int(number))
    file = folder / f"{cell_name}-{number}.bpx.json"
    file.write_text(json.dumps(hidden.bpx, indent=1) + "\n", encoding="utf-8")
    content: dict[str, object] = {
        "names": np.array(list(hidden.numbers)),
        "numbers": np.array(list(hidden.numbers.values())),
    }
    rows = []
    for test, load in loads(cell_name, int(number), file, thermal).items():
        solved, columns = solve(file, test, load, cell_name=cell_name, thermal=thermal)
        content |= solved
        rows.append(f"| {case} {columns}")
    np.savez_compressed(folder / f"{case}.npz", **content)  # type: ignore[arg-type]
    return "\n".join(rows)


def main(arguments: Iterable[str]) -> None:
    """Write the cases named, or all that are stored."""
    parser = argparse.ArgumentParser(prog="python -m tests.reference.calibration.make")
    parser.add_argument("cases", nargs="*", default=STORED, metavar="CASE")
    parser.add_argument("--out", type=Path, default=HERE, metavar="DIR")
    chosen = parser.parse_args(list(arguments))
    chosen.out.mkdir(parents=True, exist_ok=True)
    sys.stdout.write(f"PyBaMM {pybamm.__version__}, numpy {np.__version__}\n")
    for case in chosen.cases:
        sys.stdout.write(make(case, chosen.out) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
