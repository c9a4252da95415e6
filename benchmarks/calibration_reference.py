"""Calibrate cells that PyBaMM simulated on a fine mesh from hidden numbers.

    python -m benchmarks.calibration_reference [CASE ...]

0.1C, 2C and pulses with 2 mV of noise are fitted; a flight that was not is predicted. Printed: time
of the fit, measured minus simulated (noise included) of the worst test, the same against PyBaMM
without noise, the flight by the calibrated cell and by the one it started from, and how many of
the 90 % intervals hold the truth. The full ends of the windows are left out: in the truth they lie
where the charged cell rests, here at the voltage the cell to start from has when full.
"""

import sys
import time

import numpy as np
import numpy.typing as npt

from tests.reference.calibration.stored import FIT, STORED, CalibrationCase
from twin.builtin import load_cell
from twin.calibrate.answer import Answer, answer
from twin.calibrate.checks import fitted, rms
from twin.calibrate.objective import Problem
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.run import fit, problem_of
from twin.constants import FARADAY_C_mol
from twin.effects import SelfHeating
from twin.load import Between
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]
HEAT_TRANSFER_W_m2_K = 10.0  # of the lumped cases
FULL_ENDS = ("negative.stoichiometry_max", "positive.stoichiometry_min")
HEADER = "case                     fit s  rms mV  truth mV  flight mV  before mV  intervals"


def main() -> None:
    """A line a case."""
    print(HEADER)
    for name in sys.argv[1:] or STORED:
        _calibrate(CalibrationCase.read(name))


def _calibrate(case: CalibrationCase) -> None:
    effects = (SelfHeating(heat_transfer_W_m2_K=HEAT_TRANSFER_W_m2_K),) if case.heated else ()
    pack = Pack(cell=load_cell(case.cell), effects=effects)
    tests = [_test(case, name, seed) for seed, name in enumerate(FIT)]
    begun = time.perf_counter()
    problem = problem_of(pack, tests)
    *_, best = fit(problem)
    problem = best.problem
    seconds = time.perf_counter() - begun
    shown = fitted(problem, best.q, tests)
    truth = [rms(f.simulated_V - case.tests[f.name].voltage_V) for f in shown]
    start_V = float(np.mean(problem.values(best.q)[-len(tests) :]))  # all start charged alike
    flight, before = (_flight_V(case, problem, q, start_V) for q in (best.q, 0 * best.q))
    held = _held(case, problem, answer(problem, best.q))
    print(f"{case.name:24s} {seconds:5.1f}  {1e3 * max(f.rms_V for f in shown):6.2f}"
          f"  {1e3 * max(truth):8.2f}  {1e3 * flight:9.2f}  {1e3 * before:9.2f}"
          f"  {np.mean(held):5.0%} of {len(held)}", flush=True)  # fmt: skip


def _test(case: CalibrationCase, name: str, seed: int) -> ReferenceTest:
    t = case.tests[name]
    return ReferenceTest(
        name=name, time_s=t.time_s, current_A=t.current_A, voltage_V=t.noisy_V(seed),
        between=Between.HOLD if t.hold else Between.LINEAR,
    )  # fmt: skip


def _flight_V(case: CalibrationCase, problem: Problem, q: FloatArray, start_V: float) -> float:
    """Root mean square of the predicted flight against the true one."""
    test = _test(case, "flight", 0)
    return rms(problem.replayed(q, test, start_V) - case.tests["flight"].voltage_V)


def _held(case: CalibrationCase, problem: Problem, told: Answer) -> list[bool]:
    """For what both name: does the interval hold the truth?"""
    truth = dict(case.numbers)
    for side in ("negative", "positive"):
        rate = truth[f"{side}.rate_constant_mol_m2_s"]
        truth[f"{side}.exchange_current_A_m2"] = 0.5 * FARADAY_C_mol * rate
        name = f"{side}.diffusivity_m2_s"
        start = next(p.mean for p in problem.parameters if p.name == name)
        truth[name] = truth[f"{side}.diffusivity_factor"] * start
    estimates = [*told.estimates, *told.derived]
    return [
        e.lower <= truth[e.name] <= e.upper
        for e in estimates
        if e.name in truth and e.name not in FULL_ENDS
    ]


if __name__ == "__main__":
    main()
