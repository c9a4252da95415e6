"""How far the simulated truths of `twin prove` are from the twin, on finer and finer meshes.

    python -m benchmarks.truth_mesh

Two minutes about 1C. What falls with the points is the error of the truth.
"""

import numpy as np

from proof.simulated.cell_truth import CellTruth
from proof.simulated.dfn import POINTS, solve
from twin.builtin import load_cell
from twin.constants import ZERO_CELSIUS_K
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate

ROOM_K, SOC = ZERO_CELSIUS_K + 25.0, 0.6
FINER = (1, 2, 3)


def main() -> None:
    """A line a cell and mesh."""
    time_s = 0.1 * np.arange(1200.0)
    wave = 1.0 + 0.3 * np.sin(3.0 * time_s) + 0.3 * np.sin(0.7 * time_s)  # of 1C
    for name in POINTS:
        cell = load_cell(name)
        current_A = wave * cell.nominal_capacity_C / 3600.0
        load = Load(time_s=time_s, current_A=current_A, ambient_K=ROOM_K, between=Between.LINEAR)
        twin_V = simulate(Pack(cell=cell, initial_soc=SOC, initial_K=ROOM_K), load).voltage_V
        truth = CellTruth(cell=name, soc=SOC, start_K=ROOM_K, ambient_K=ROOM_K)
        for finer in FINER:
            voltage_V, _ = solve(truth, time_s, current_A, finer=finer)
            rms_V = float(np.sqrt(np.mean((voltage_V - twin_V) ** 2)))
            points = finer * POINTS[name]["x_n"]
            print(f"{name}: {points} points an electrode, {1e3 * rms_V:.2f} mV rms", flush=True)


if __name__ == "__main__":
    main()
