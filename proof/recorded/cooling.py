"""How a cell cools, looked for by the temperature that was measured on it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from proof.recorded.measured import RealTest
from twin.calibrate.reference import ReferenceTest
from twin.effects import SelfHeating
from twin.load import Load
from twin.mismatch.problem import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]

COOLING_W_m2_K = (1.0, 200.0)  # looked for between still air and a clamp
WHOLE = 0.5  # of the most that any test draws: a test that draws less shows no warming
STEP = 0.05  # of the logarithm of a cooling, either way, for a slope


@dataclass(frozen=True, slots=True, eq=False)
class Warmed:
    """A pack at the start of a load, and the temperature that was measured along it [K]."""

    pack: Pack
    load: Load
    measured_K: FloatArray

    def heated(self, log_transfer: float) -> tuple[Pack, Solution]:
        """With its losses, cooled by exp(`log_transfer`) W/(m2 K); as at the start, and its run."""
        heating = SelfHeating(heat_transfer_W_m2_K=float(np.exp(log_transfer)))
        pack = replace(self.pack, effects=(*self.pack.effects, heating))
        return pack, simulate(pack, self.load)

    def missed_K(self, log_transfer: float) -> FloatArray:
        """Simulated minus measured, as far as it goes."""
        got_K = self.heated(log_transfer)[1].temperature_K
        return got_K - self.measured_K[: got_K.size]


def cooled(pack: Pack, tests: Sequence[RealTest]) -> Pack:
    """The same with losses that heat it, and the cooling that the fastest whole test shows.

    That is the fastest of those to whose end the pack comes; of all, if it comes to no end.
    """
    most_C = max(np.ptp(t.drawn_C) for t in tests)
    whole = (t for t in tests if np.ptp(t.drawn_C) > WHOLE * most_C)
    by_speed = sorted(whole, key=lambda t: float(t.time_s[-1]))

    def along(test: RealTest) -> Warmed:
        ambient_K = test.start_K(pack.initial_K)
        load = Load(time_s=test.time_s, current_A=test.current_A, ambient_K=ambient_K)
        assert test.temperature_K is not None
        return Warmed(replace(pack, initial_K=ambient_K), load, test.temperature_K)

    _, high = np.log(COOLING_W_m2_K)
    followed = (t for t in by_speed if along(t).heated(high)[1].status is Status.DONE)
    shown = along(next(followed, by_speed[0]))
    return shown.heated(_likeliest([shown], xatol=0.05))[0]


def of_mount(own: Sequence[tuple[ReferenceTest, Pack]]) -> tuple[float, float] | None:
    """Heat transfer of the mount that some tests were in, and its standard error [W/(m2 K)].

    One number for all of them, each counting alike, and as one measurement that errs by what is
    left: what a twin misses of a temperature holds over a test. None if none was measured.

    Args:
        own: each test, and the pack without heating at its start.
    """
    warmed = [
        Warmed(beyond_cut_offs(pack), test.load(), test.temperature_K)
        for test, pack in own
        if test.temperature_K is not None
    ]
    if not warmed:
        return None
    best = _likeliest(warmed, xatol=0.005)
    slopes_K = [(w.missed_K(best + STEP) - w.missed_K(best - STEP)) / (2 * STEP) for w in warmed]
    error_K = _missed_K(warmed, best) / np.sqrt(len(warmed))
    relative = error_K / np.sqrt(sum(float(np.mean(slope_K**2)) for slope_K in slopes_K))
    return float(np.exp(best)), float(np.exp(best) * relative)


def _likeliest(warmed: Sequence[Warmed], *, xatol: float) -> float:
    """Logarithm of the cooling with the least squares."""
    best = minimize_scalar(
        lambda log_transfer: _missed_K(warmed, log_transfer),
        bounds=tuple(np.log(COOLING_W_m2_K)), method="bounded", options={"xatol": xatol},
    )  # fmt: skip
    return float(best.x)


def _missed_K(warmed: Sequence[Warmed], log_transfer: float) -> float:
    """Root of the mean squares of each, summed."""
    return float(np.sqrt(sum(np.mean(w.missed_K(log_transfer) ** 2) for w in warmed)))
