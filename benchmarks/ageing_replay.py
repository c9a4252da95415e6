"""All effects at once, beside PyBaMM: `python -m benchmarks.ageing_replay [SECONDS]`.

The LG M50 under the first SECONDS (120 unless told) of the reference flight, 10 Hz, and under a 1C
discharge to its cut-off; once isothermal, once with a lumped temperature; both from the same BPX
file and with the parameters of O'Kane 2022, stress-enhanced diffusion off. PyBaMM: DFN, IDAKLU,
default mesh and tolerances, its integrator's time alone. The twin: a whole second call. Errors are
against the stored solution on converged meshes (60 s, isothermal), without its first sample.
"""

import statistics
import sys
import time
from collections.abc import Callable
from importlib import resources

import numpy as np

from tests.reference.ageing_dfn import AgeingAnswer, solve_ageing
from tests.reference.dfn import DEFAULT
from tests.reference.loads import LOADS
from twin.builtin import load_cell
from twin.effects import AGEING, SelfHeating
from twin.kernel import Backend
from twin.load import Load
from twin.pack import Pack
from twin.protocol import ConstantCurrent, Settings, run
from twin.simulate import simulate

REPEATS = 5
TOLERANCES_V = (
    2e-4,
    1e-3,
)  # of a step: the twin's own, and one whose error is still below 0.4 mV rms
CELL = load_cell("lg_m50")
AGEING_ONLY = tuple(kind() for kind in AGEING)
PACKS = {
    "isothermal": Pack(cell=CELL, effects=AGEING_ONLY),
    "lumped": Pack(cell=CELL, effects=(SelfHeating(heat_transfer_W_m2_K=10.0), *AGEING_ONLY)),
}
DISCHARGE = ConstantCurrent(current_A=5.0, until_V=CELL.lower_cut_off_V)


def seconds(work: Callable[[], object]) -> float:
    """Median time of a call whose kernel is there already."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def pybamm_answer(load: Load, thermal: str) -> AgeingAnswer:
    """On its default mesh."""
    with resources.as_file(resources.files("twin") / "cells" / "lg_m50.bpx.json") as file:
        return solve_ageing(
            file, load.time_s, load.current_A, charge=1.0, effects="all", thermal=thermal,
            mesh=DEFAULT, tolerance=None,
        )  # fmt: skip


def errors(load: Load, theirs: AgeingAnswer) -> None:
    """Both against the converged solution."""
    stored = np.load("tests/reference/ageing-flight-all-isothermal.npz")["voltage_V"]
    both = min(stored.size, load.time_s.size)
    ours = simulate(PACKS["isothermal"], load).require().voltage_V
    for name, volts in (("PyBaMM", theirs.outputs["voltage_V"]), ("twin", ours)):
        error_mV = 1e3 * (volts[1:both] - stored[1:both])
        print(
            f"{name}: {np.sqrt(np.mean(error_mV**2)):.2f} mV rms, {np.abs(error_mV).max():.1f} max"
        )


def beside(thermal: str, seconds_of_flight: float) -> None:
    """Times and ratios of a flight and of a discharge."""
    whole, pack = LOADS["lg_m50", "flight"], PACKS[thermal]
    part = whole.time_s <= seconds_of_flight
    load = Load(time_s=whole.time_s[part], current_A=whole.current_A[part])
    theirs = pybamm_answer(load, thermal)
    ours = seconds(lambda: simulate(pack, load).require())
    print(
        f"{thermal}, {seconds_of_flight:.0f} s of flight: PyBaMM {theirs.solve_s:.2f} s, "
        f"twin {1e3 * ours:.1f} ms, ratio {theirs.solve_s / ours:.0f}"
    )
    if thermal == "isothermal":
        errors(load, theirs)
    end_s = run(pack, (DISCHARGE,)).steps[0].stopped_s
    samples = np.linspace(0.0, end_s, 100)
    slow = pybamm_answer(Load(time_s=samples, current_A=np.full(100, 5.0)), thermal)
    for tolerance_V in TOLERANCES_V:
        settings = Settings(tolerance_V=tolerance_V)
        ours = seconds(lambda s=settings: run(pack, (DISCHARGE,), settings=s).require())  # type: ignore[misc]
        print(
            f"{thermal}, 1C discharge of {end_s:.0f} s to {1e3 * tolerance_V:g} mV: PyBaMM "
            f"{slow.solve_s:.3f} s, twin {1e3 * ours:.1f} ms, ratio {slow.solve_s / ours:.1f}"
        )


def main(seconds_of_flight: float) -> None:
    """Print the table."""
    for thermal in PACKS:
        beside(thermal, seconds_of_flight)
    whole = LOADS["lg_m50", "flight"]
    full = Load(time_s=whole.time_s, current_A=whole.current_A)
    for backend in Backend:
        taken = seconds(lambda b=backend: simulate(PACKS["lumped"], full, backend=b))  # type: ignore[misc]
        print(f"600 s of flight, all effects, {backend.value}: {taken:.3f} s")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 120.0)
