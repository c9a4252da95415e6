"""A measured test replayed: the measured current drawn, the measured temperature imposed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from proof.recorded.measured import BEYOND_V, RealCell, RealTest
from twin.cell_mesh import mesh_of
from twin.layout import Layout
from twin.load import Load
from twin.mismatch.left import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]
Model = Callable[[Pack, Load, FloatArray | None], Solution]

SHIFTS = (-0.2, 0.05)  # of the state of charge at the start
SPANS = 60  # of a test, each at one temperature: at 9.1C the LiPo's rises by 0.5 K in one


def follow(model: Model, pack: Pack, test: RealTest) -> FloatArray:
    """(m,) voltage along the test, as far as it goes; SPANS spans at their measured temperature."""
    assert test.temperature_K is not None
    layout = Layout(mesh_of(pack.cell))
    where = layout.slice_of("temperature_K")
    state, out = None, np.empty(0)
    ends = np.unique(np.linspace(0, test.time_s.size - 1, SPANS + 1).astype(int)).tolist()
    for start, stop in pairwise(ends):
        span = slice(start, stop + 1)
        mean_K = float(test.temperature_K[span].mean())
        if state is not None:
            state[where] = mean_K
        load = Load(time_s=test.time_s[span], current_A=test.current_A[span])
        part = model(replace(pack, initial_K=mean_K), load, state)
        out = np.append(out[:start], part.voltage_V)
        if part.status is not Status.DONE:
            break
        state = part.end_state.copy()
    return out


def twin(pack: Pack, load: Load, state: FloatArray | None) -> Solution:
    """The P2D twin."""
    return simulate(pack, load, state=state)


def answer(pack: Pack, test: RealTest, shift: float = 0.0) -> FloatArray:
    """(m,) voltage at the terminals, at the measured temperature or, without one, the pack's.

    It starts at the pack's state of charge, less what was drawn before, plus `shift`; from 0 to 1.
    """
    soc = pack.initial_soc - test.drawn_before_C / pack.window_C + shift
    start = replace(pack, initial_soc=float(np.clip(soc, 0.0, 1.0)))
    if test.temperature_K is not None:
        return follow(twin, start, test)
    load = Load(time_s=test.time_s, current_A=test.current_A, ambient_K=start.initial_K)
    return simulate(start, load).voltage_V


def whole_V(pack: Pack, load: Load) -> FloatArray:
    """(n,) voltage along a load, the cut-offs out of the way; from where it ends as at its end."""
    got = simulate(beyond_cut_offs(pack), load).voltage_V
    return np.append(got, np.full(load.time_s.size - got.size, got[-1]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Simulated minus measured voltage of a test, per cell of the series [mV].

    Attributes:
        rms: over the samples as they were recorded, the first and those without a voltage left out.
        largest: absolute.
        mean: simulated above measured is positive.
        covered: share of the samples the simulation reached before an electrode ran empty, or
            the voltage was beyond what `wide` allows.
    """

    rms: float
    largest: float
    mean: float
    covered: float

    @property
    def of_all(self) -> float:
        """`rms`, samples that were not reached counting as BEYOND_V of error."""
        lost = (1e3 * BEYOND_V) ** 2
        return float(np.sqrt(self.covered * self.rms**2 + (1 - self.covered) * lost))


def errors(answer_V: FloatArray, test: RealTest, series: int = 1) -> Errors:
    """Of an answer at the first m samples of a test."""
    m = answer_V.size
    off_mV = 1e3 * (answer_V - test.voltage_V[:m])[1:] / series
    off_mV = off_mV[np.isfinite(off_mV)]
    return Errors(
        rms=float(np.sqrt(np.mean(off_mV**2))),
        largest=float(np.abs(off_mV).max()),
        mean=float(off_mV.mean()),
        covered=m / test.time_s.size,
    )


def baseline_errors(cell: RealCell, test: RealTest, shift: float = 0.0) -> Errors:
    """What a calibration has to beat."""
    return errors(answer(cell.baseline, test, shift), test, cell.baseline.series)


def fitted_shift(cell: RealCell) -> float:
    """Of the start of charge, one for all tests, with the least mean error of the fit tests.

    Charged to the same voltage, a cell does not hold what its parameter set calls 100 %; whoever
    uses the set mends that first.
    """

    def misfit_mV(shift: float) -> float:
        return float(np.mean([baseline_errors(cell, test, shift).of_all for test in cell.fit]))

    best = minimize_scalar(misfit_mV, bounds=SHIFTS, method="bounded", options={"xatol": 1e-3})
    return float(best.x) if best.fun < misfit_mV(0.0) else 0.0
