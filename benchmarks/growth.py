"""How the cost of a replay grows: `python -m benchmarks.growth [PICTURE.png]`.

600 s of the reference flight at 10 Hz, LG M50, compiled; the median of five calls each: with the
nodes of an electrode, the length of the flight, the unlike cells in series and the effects.
"""

import statistics
import sys
import time

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tests.reference.loads import LOADS
from twin.builtin import load_cell
from twin.effects import AGEING, AnyEffect, SelfHeating, StressEnhancedDiffusion, WeakCell
from twin.load import Load
from twin.mesh import electrode_mesh
from twin.pack import Pack
from twin.simulate import simulate

REPEATS = 5
CELL = load_cell("lg_m50")
ALL: tuple[AnyEffect, ...] = (SelfHeating(), *(kind() for kind in AGEING))
FLIGHT = LOADS["lg_m50", "flight"]


def flight(seconds: float) -> Load:
    """The flight over and over, at half its current: an hour of it empties no cell."""
    times = np.arange(0.0, seconds + 0.05, 0.1)
    gusts = np.resize(FLIGHT.current_A, times.size)
    return Load(time_s=times, current_A=gusts * min(0.5, 150.0 / seconds))


def cost_s(pack: Pack, load: Load, mesh=None) -> float:  # type: ignore[no-untyped-def]
    """Median seconds of a call whose kernel is there already."""
    simulate(pack, load, mesh=mesh)
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        simulate(pack, load, mesh=mesh)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def curves() -> dict[str, list[tuple[str, float]]]:
    """Title -> (label, seconds) one after the other."""
    aged, load = Pack(cell=CELL, effects=ALL), flight(600.0)
    meshes = {order + 1: electrode_mesh((0.0, 1.0), (order,)) for order in (2, 3, 5, 7, 9, 11)}
    weak = [WeakCell(cell=k, capacity_factor=1 - k / 100) for k in (1, 2, 3)]
    effects: dict[str, tuple[AnyEffect, ...]] = {
        "none": (), "heat": (SelfHeating(),), "ageing": ALL[1:], "both": ALL,
        "+ stress": (*ALL, StressEnhancedDiffusion()),
    }  # fmt: skip
    return {
        "nodes of an electrode": [(str(n), cost_s(aged, load, m)) for n, m in meshes.items()],
        "seconds of flight": [
            (str(s), cost_s(aged, flight(float(s)))) for s in (60, 300, 600, 1800, 3600)
        ],
        "unlike cells of 4 in series": [
            (str(k + 1), cost_s(Pack(cell=CELL, series=4, effects=(*ALL, *weak[:k])), load))
            for k in range(4)
        ],
        "effects": [
            (name, cost_s(Pack(cell=CELL, effects=e), load)) for name, e in effects.items()
        ],
    }


def main(picture: str | None) -> None:
    """Print the numbers, draw them if asked to."""
    found = curves()
    for title, points in found.items():
        print(title + ": " + ", ".join(f"{label}: {1e3 * s:.0f} ms" for label, s in points))
    if picture is None:
        return
    canvas = Figure(figsize=(11, 3), layout="constrained")
    FigureCanvasAgg(canvas)
    for axes, (title, points) in zip(canvas.subplots(1, 4), found.items(), strict=True):
        labels, values = zip(*points, strict=True)
        axes.bar(labels, [1e3 * s for s in values], color="#4477aa")
        axes.set_xlabel(title)
        axes.set_ylabel("ms")
        axes.tick_params(axis="x", labelsize=8, rotation=30 if title == "effects" else 0)
    canvas.savefig(picture, dpi=120)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
