"""A life, every sample resolved: `python -m benchmarks.life [CYCLES]` (1000; 2 min on one core).

Each built-in cell: 8 min of its reference flight at 10 Hz, scaled to draw SHARE of its capacity,
half an hour of rest, 1C CC-CV charge, half an hour of rest, all ageing effects and self-heating.
For the LG M50 stress enhances diffusion too, as where its constants come from (O'Kane 2022):
without, they take a tenth of the positive electrode in a single charge.
"""

import resource
import sys
import time
from itertools import islice

import numpy as np

from tests.reference.loads import LOADS
from twin.ageing import Aged, Regime, age
from twin.builtin import load_cell
from twin.effects import AGEING, AnyEffect, SelfHeating, StressEnhancedDiffusion
from twin.load import Load
from twin.pack import Pack

SHARE = {"lipo_2200": 0.75, "lg_m50": 0.25}  # the LG M50 is made for 2C
MORE: dict[str, tuple[AnyEffect, ...]] = {
    "lipo_2200": (),
    "lg_m50": (StressEnhancedDiffusion(),),
}
FLIGHT_S, PERIOD_S = 480.0, 0.1


def flight(name: str, capacity_C: float) -> Load:
    """The reference flight, over and over."""
    time_s = np.arange(0.0, FLIGHT_S + PERIOD_S / 2, PERIOD_S)
    gusts = np.resize(LOADS[name, "flight"].current_A, time_s.size)
    mean_A = SHARE[name] * capacity_C / FLIGHT_S
    return Load(time_s=time_s, current_A=gusts * (mean_A / gusts.mean()))


def row(name: str, count: int) -> str:
    """Of the table, for one cell."""
    cell = load_cell(name)
    pack = Pack(cell=cell, effects=(SelfHeating(), *(kind() for kind in AGEING), *MORE[name]))
    regime = Regime(load=flight(name, cell.nominal_capacity_C))
    start = time.perf_counter()
    first: Aged | None = None
    for last in islice(age(pack, regime), count + 1):  # the first is the charge
        first = first or last
    seconds = time.perf_counter() - start
    assert first is not None
    new, old = first.cycle.health, last.cycle.health
    memory_MB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return (
        f"| {name} | {last.cycle.number} | {last.cycle.status.name} | {seconds:.0f} "
        f"| {memory_MB:.0f} | {new.capacity_C / 3600:.3f} | {old.capacity_C / 3600:.3f} "
        f"| {old.lithium_error:.0e} | {old.salt_change:.0e} |"
    )


if __name__ == "__main__":
    print("| cell | cycles | ended | s | MB | Ah new | Ah at the end | lithium | salt |")
    print("|---|---|---|---|---|---|---|---|---|")
    for cell_name in SHARE:
        print(row(cell_name, int(sys.argv[1]) if len(sys.argv) > 1 else 1000), flush=True)
