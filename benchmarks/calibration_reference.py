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
from dataclasses import dataclass
from zlib import crc32

import numpy as np
import numpy.typing as npt

from tests.reference.calibration.stored import FIT, STORED, CalibrationCase
from twin.builtin import load_cell
from twin.calibrate.answer import Estimate, answer
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """An estimate beside the truth."""

    estimate: Estimate
    truth: float

    @property
    def held(self) -> bool:
        """By the 90 % interval."""
        return self.estimate.lower <= self.truth <= self.estimate.upper


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrated:
    """One case; errors are those of the worst test [mV a cell].

    Attributes:
        seconds: that the fit took.
        rms_mV: measured minus simulated.
        truth_mV: PyBaMM without noise minus simulated.
        flight_mV: the same of the flight, which was not fitted,
        before_mV: and by the cell that the fit started from.
        judged: what both name.
    """

    seconds: float
    rms_mV: float
    truth_mV: float
    flight_mV: float
    before_mV: float
    judged: tuple[Judged, ...]

    def line(self, name: str) -> str:
        """Of the table under HEADER."""
        share = np.mean([j.held for j in self.judged])
        return (
            f"{name:24s} {self.seconds:5.1f}  {self.rms_mV:6.2f}  {self.truth_mV:8.2f}"
            f"  {self.flight_mV:9.2f}  {self.before_mV:9.2f}  {share:5.0%} of {len(self.judged)}"
        )


def main() -> None:
    """A line a case."""
    print(HEADER)
    for name in sys.argv[1:] or STORED:
        print(calibrated(CalibrationCase.read(name)).line(name), flush=True)


def calibrated(case: CalibrationCase) -> Calibrated:
    """Fit, predict, compare."""
    effects = (SelfHeating(heat_transfer_W_m2_K=HEAT_TRANSFER_W_m2_K),) if case.heated else ()
    pack = Pack(cell=load_cell(case.cell), effects=effects)
    tests = [_test(case, name) for name in FIT]
    begun = time.perf_counter()
    *_, best = fit(problem_of(pack, tests))
    problem = best.problem
    seconds = time.perf_counter() - begun
    shown = fitted(problem, best.q, tests)
    truth = [rms(f.simulated_V - case.tests[f.name].voltage_V) for f in shown]
    start_V = float(np.mean(problem.values(best.q)[-len(tests) :]))  # all start charged alike
    flight, before = (_flight_V(case, problem, q, start_V) for q in (best.q, 0 * best.q))
    told = answer(problem, best.q)
    return Calibrated(
        seconds=seconds,
        rms_mV=1e3 * max(f.rms_V for f in shown),
        truth_mV=1e3 * max(truth),
        flight_mV=1e3 * flight,
        before_mV=1e3 * before,
        judged=_judged(case, problem, (*told.estimates, *told.derived)),
    )


def _test(case: CalibrationCase, name: str) -> ReferenceTest:
    t = case.tests[name]
    seed = crc32(f"{case.name} {name}".encode())  # noise that no other test of any case has
    return ReferenceTest(
        name=name, time_s=t.time_s, current_A=t.current_A, voltage_V=t.noisy_V(seed),
        between=Between.HOLD if t.hold else Between.LINEAR,
    )  # fmt: skip


def _flight_V(case: CalibrationCase, problem: Problem, q: FloatArray, start_V: float) -> float:
    """Root mean square of the predicted flight against the true one."""
    test = _test(case, "flight")
    return rms(problem.replayed(q, test, start_V) - case.tests["flight"].voltage_V)


def _judged(
    case: CalibrationCase, problem: Problem, estimates: tuple[Estimate, ...]
) -> tuple[Judged, ...]:
    """What both name."""
    truth = dict(case.numbers)
    for side in ("negative", "positive"):
        rate = truth[f"{side}.rate_constant_mol_m2_s"]
        truth[f"{side}.exchange_current_A_m2"] = 0.5 * FARADAY_C_mol * rate
        name = f"{side}.diffusivity_m2_s"
        start = next(p.mean for p in problem.parameters if p.name == name)
        truth[name] = truth[f"{side}.diffusivity_factor"] * start
    return tuple(
        Judged(estimate=e, truth=truth[e.name])
        for e in estimates
        if e.name in truth and e.name not in FULL_ENDS
    )


if __name__ == "__main__":
    main()
