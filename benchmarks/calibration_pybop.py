"""The twin's calibration beside PyBOP's, on the same synthetic cell.

    python -m benchmarks.calibration_pybop --python /path/to/venv/bin/python [--budget 250]
        [--case lipo_2200-0-isothermal] [--optimisers IRPropPlus,SciPyMinimize,CMAES] [--points 10]

The cell is a hidden one that PyBaMM simulated on a fine mesh (tests/reference/calibration): 0.1C,
2C, pulses, 2 mV of noise; one of the LiPo cases. PyBOP 26.3 needs numpy below 2.4, so it runs in a
virtual environment of its own (`pip install pybop==26.3 "bpx>=1.1"`), each optimiser for `--budget`
seconds of wall time; building its model is not counted, loading the twin's kernel is. About 15 min
in all; run nothing beside it.

What both are given: the few samples the twin keeps of each test, with its weights (those on a jump
of the current are left out for PyBOP, which cannot say on which side of it they lie); the start,
which is the cell of the data sheet; coordinates, bounds and prior widths of the twin; what lies
beyond an empty cell counts the same. PyBOP has one voltage at the start for all tests, which in
truth is so, and no radii: at a fixed share of active material they act through D / R**2 and j0 / R
alone, which are free. Its mesh has `--points` cells in each layer and particle, PyBaMM's own are
20: 10 take half the time and cost 7 % of the error at the truth. `twin, same numbers` is the twin
without the radii too.

IRPropPlus is what PyBOP's own example of a DFN uses (examples/scripts/battery_parameterisation/
simple_dfn.py of its repository), with exact sensitivities by IDAKLU;
SciPyMinimize is then L-BFGS-B with the same; CMAES uses no derivatives, and both cores.
The error is the root mean square of measured minus simulated, weighed as both fits weigh it. An
evaluation simulates all three tests; those with derivatives are counted apart.
"""

import argparse
import json
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from tests.reference.calibration.stored import FIT, CalibrationCase
from twin.builtin import builtin_text, load_cell
from twin.calibrate.cell_map import full_and_empty_V
from twin.calibrate.objective import Problem
from twin.calibrate.parameters import EMPTY_ENDS, Parameter, Scale
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import Sampled
from twin.calibrate.run import fit, problem_of
from twin.calibrate.simulated import Simulated
from twin.cell import BEYOND_V
from twin.load import Between
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

SIDE = Path(__file__).with_name("calibration_pybop_side.py")
FACTORS = {"diffusivity_m2_s": "diffusivity_factor", "exchange_current_A_m2": "exchange_factor"}
CLOSE = 1.05  # times the twin's error at its end: as good


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """The best so far: after how long, how many evaluations of either kind, which error."""

    seconds: float
    plain: float
    derivatives: float
    error_V: float


def twin_trace(pack: Pack, tests: Sequence[ReferenceTest], only: list[str] | None) -> list[Point]:
    """The twin's own calibration."""
    counts = {False: 0, True: 0}
    simulated = Problem.simulated

    def counted(self: Problem, q: FloatArray, test: int, *, derivative: bool = False) -> Simulated:
        counts[derivative] += 1
        return simulated(self, q, test, derivative=derivative)

    out, began = [], time.perf_counter()
    with patch.object(Problem, "simulated", counted):
        problem = problem_of(pack, tests, only=only)
        for progress in fit(problem):
            now_s, done = time.perf_counter() - began, dict(counts)
            out.append(
                Point(seconds=now_s, plain=done[False] / len(tests),
                      derivatives=done[True] / len(tests), error_V=error_V(problem, progress.q))
            )  # fmt: skip
            counts.update(done)
    return out


def error_V(problem: Problem, q: FloatArray) -> float:
    """Weighted root mean square of measured minus simulated."""
    sigma_V = np.concatenate([t.sigma_V for t in problem.tests])
    residuals = problem.residuals(q)[: sigma_V.size]
    return float(np.sqrt(np.sum(residuals**2) / np.sum(sigma_V**-2)))


def handed_over(problem: Problem, bpx: Path, given: argparse.Namespace) -> dict[str, Any]:
    """What PyBOP's side needs."""
    pack, numbers = problem.pack, problem.mapped(np.zeros(len(problem.parameters)), 0).numbers
    return {
        "bpx": str(bpx),
        "points": given.points,
        "budget_s": given.budget,
        "seed": given.seed,
        "empty_V": full_and_empty_V(pack)[1],
        "beyond_V": pack.cell.lower_cut_off_V - BEYOND_V,
        "parameters": parameters(problem.parameters, numbers),
        "tests": [test_of(t) for t in problem.tests],
    }


def parameters(free: Sequence[Parameter], numbers: Mapping[str, float]) -> list[dict[str, Any]]:
    """Those of the twin; full is where the tests start, materials by factors of the file's."""
    soc = numbers["initial_soc"]
    empty, full = (numbers[f"negative.stoichiometry_{end}"] for end in ("min", "max"))
    means = {"negative.stoichiometry_max": empty + soc * (full - empty)}
    out = []
    starts = [p for p in free if p.name.startswith("start_V:")]
    for p in (*(p for p in free if p not in starts), starts[0]):
        name, mean = p.name.partition(":")[0], means.get(p.name, p.mean)
        if name == "capacity_C":
            mean *= soc
        side, _, quantity = name.partition(".")
        if quantity in FACTORS:
            name, mean = f"{side}.{FACTORS[quantity]}", 1.0
        out.append({"name": name, "mean": mean, "std": p.std, "log": p.scale is Scale.LOG,
                    "bounds": p.bounds})  # fmt: skip
    return out


def test_of(sampled: Sampled) -> dict[str, Any]:
    """Samples that are compared, and the jumps of the current [A] with their times [s]."""
    time_s, current_A = sampled.load.time_s, sampled.load.current_A
    change = np.flatnonzero(np.diff(current_A)) + 1
    jumps = [(float(time_s[i]), float(current_A[i] - current_A[i - 1])) for i in change]
    if current_A[0]:
        jumps.insert(0, (0.0, float(current_A[0])))
    at_s = time_s[sampled.at]
    clear = ~np.isin(at_s, time_s[change])
    return {
        "jumps": jumps, "time_s": at_s[clear].tolist(),
        "voltage_V": sampled.voltage_V[clear].tolist(), "sigma_V": sampled.sigma_V[clear].tolist(),
    }  # fmt: skip


def pybop_trace(name: str, told: dict[str, Any], python: str, folder: Path) -> dict[str, Any]:
    """What PyBOP's side leaves."""
    problem, trace = folder / "problem.json", folder / "trace.json"
    problem.write_text(json.dumps(told))
    command = [python, str(SIDE), name, str(problem), str(trace)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    left: dict[str, Any] = json.loads(trace.read_text())
    return left


def points_of(left: dict[str, Any], told: dict[str, Any]) -> list[Point]:
    """Its trace, the cost as an error."""
    weight = sum(float(np.sum(np.array(t["sigma_V"]) ** -2)) for t in told["tests"])
    by = "derivatives" if left["derivatives"] else "plain"
    none = {"plain": 0.0, "derivatives": 0.0}
    return [
        Point(seconds=seconds, error_V=float(np.sqrt(cost / weight)), **none | {by: float(count)})
        for seconds, count, cost in left["trace"]
    ]


def measured(case: CalibrationCase, name: str, seed: int) -> ReferenceTest:
    """A test of the hidden cell, with noise."""
    t = case.tests[name]
    between = Between.HOLD if t.hold else Between.LINEAR
    return ReferenceTest(name=name, time_s=t.time_s, current_A=t.current_A,
                         voltage_V=t.noisy_V(seed), between=between)  # fmt: skip


def line(name: str, trace: Sequence[Point], twin: Sequence[Point], goal_V: float) -> str:
    """One row of the table."""
    then = [p for p in trace if p.seconds <= twin[-1].seconds]
    met = next((p for p in trace if p.error_V <= goal_V), None)
    last = trace[-1]
    return (
        f"{name:20s} {last.seconds:8.1f} {last.plain:7.0f} {last.derivatives:7.0f}"
        f" {1e3 * last.error_V:9.3f} {f'{1e3 * then[-1].error_V:.3f}' if then else '-':>10}  "
        + (
            f"{met.seconds:.1f} s, {met.plain:.0f} + {met.derivatives:.0f}"
            if met
            else "not reached"
        )
    )


def main() -> None:
    """A line a method."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--python", required=True, help="of the environment that has PyBOP")
    options.add_argument("--case", default="lipo_2200-0-isothermal")
    options.add_argument("--budget", type=float, default=250.0, metavar="SECONDS")
    options.add_argument("--optimisers", default="IRPropPlus,SciPyMinimize,CMAES")
    options.add_argument("--points", type=int, default=10)
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    case = CalibrationCase.read(given.case)
    pack = Pack(cell=load_cell(case.cell))
    tests = [measured(case, name, seed) for seed, name in enumerate(FIT)]
    whole = problem_of(pack, tests)
    only = [p.name for p in whole.parameters if not p.name.endswith("particle_radius_m")]
    told_of = problem_of(pack, tests, only=only)
    if EMPTY_ENDS[1] not in only:
        options.error(
            f"{given.case}: its {EMPTY_ENDS[0]} is free, PyBOP's side has no words for it"
        )
    twin = twin_trace(pack, tests, None)
    goal_V = CLOSE * twin[-1].error_V
    print(f"{'':20s} {'s':>8} {'evaluations':>15} {'error mV':>9} "
          f"{f'{twin[-1].seconds:.0f} s: mV':>10}  {1e3 * goal_V:.3f} mV after")  # fmt: skip
    print(line("twin", twin, twin, goal_V), flush=True)
    print(line("twin, same numbers", twin_trace(pack, tests, only), twin, goal_V), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        bpx = Path(folder) / "cell.json"
        bpx.write_text(builtin_text(case.cell))
        told = handed_over(told_of, bpx, given)
        for name in given.optimisers.split(","):
            left = pybop_trace(name, told, given.python, Path(folder))
            print(f"{line(f'PyBOP {name}', points_of(left, told), twin, goal_V)}; {left['ended']}; "
                  f"built in {left['built_s']:.0f} s", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
