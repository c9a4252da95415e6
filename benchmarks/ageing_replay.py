"""All ageing effects at once, beside PyBaMM: `python -m benchmarks.ageing_replay [SECONDS]`.

The LG M50 under the first SECONDS (120 unless told) of the reference flight, 10 Hz, isothermal;
both from the same BPX file and with the parameters of O'Kane 2022. PyBaMM: DFN, IDAKLU, default
mesh and tolerances, its integrator's time alone. The twin: a whole second call. Errors are against
the stored solution on converged meshes (60 s), without its first sample.
"""

import statistics
import sys
import time
from importlib import resources

import numpy as np

from tests.reference.ageing_dfn import solve_ageing
from tests.reference.dfn import DEFAULT
from tests.reference.loads import LOADS
from twin.builtin import load_cell
from twin.effects import AGEING
from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

REPEATS = 5
PACK = Pack(cell=load_cell("lg_m50"), effects=tuple(kind() for kind in AGEING))


def twin_seconds(load: Load, backend: Backend) -> float:
    """Median time of a call whose kernel is there already."""
    simulate(PACK, load, backend=backend)
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        simulate(PACK, load, backend=backend).require()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def main(seconds: float) -> None:
    """Print the table."""
    whole = LOADS["lg_m50", "flight"]
    part = whole.time_s <= seconds
    time_s, current_A = whole.time_s[part], whole.current_A[part]
    load = Load(time_s=time_s, current_A=current_A)
    with resources.as_file(resources.files("twin") / "cells" / "lg_m50.bpx.json") as file:
        answer = solve_ageing(
            file, time_s, current_A, charge=1.0, effects="all", thermal="isothermal",
            mesh=DEFAULT, tolerance=None,
        )  # fmt: skip
    stored = np.load("tests/reference/ageing-flight-all-isothermal.npz")["voltage_V"]
    both = min(stored.size, time_s.size)
    solution = simulate(PACK, load).require()
    for name, volts in (("PyBaMM", answer.outputs["voltage_V"]), ("twin", solution.voltage_V)):
        error_mV = 1e3 * (volts[1:both] - stored[1:both])
        print(
            f"{name}: {np.sqrt(np.mean(error_mV**2)):.2f} mV rms, {np.abs(error_mV).max():.1f} max"
        )
    compiled = twin_seconds(load, Backend.AUTO)
    print(f"{seconds:.0f} s of flight: PyBaMM {answer.solve_s:.1f} s, twin {1e3 * compiled:.1f} ms")
    print(f"ratio {answer.solve_s / compiled:.0f}")
    full = Load(time_s=whole.time_s, current_A=whole.current_A)
    for backend in Backend:
        print(f"600 s of flight, {backend.value}: {twin_seconds(full, backend):.3f} s")
    bare = Pack(cell=PACK.cell)
    start = time.perf_counter()
    simulate(bare, full)
    print(f"the same without ageing: {time.perf_counter() - start:.3f} s (kernel included)")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 120.0)
