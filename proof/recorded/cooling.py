"""How a cell cools, looked for by the temperature that was measured on it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from proof.recorded.measured import RealTest
from twin.calibrate.answer import Answer
from twin.calibrate.objective import Problem
from twin.calibrate.parameters import MOUNT_STD, TEST_STD, WARMING, mount_name
from twin.effects import SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]

COOLING_W_m2_K = (1.0, 200.0)  # looked for between still air and a clamp
WHOLE = 0.5  # of the most that any test draws: a test that draws less shows no warming


def cooled(pack: Pack, tests: Sequence[RealTest]) -> Pack:
    """The same with losses that heat it, and the cooling that the fastest whole test shows.

    That is the fastest of those to whose end the pack comes; of all, if it comes to no end.
    """
    most_C = max(np.ptp(t.drawn_C) for t in tests)
    whole = (t for t in tests if np.ptp(t.drawn_C) > WHOLE * most_C)
    by_speed = sorted(whole, key=lambda t: float(t.time_s[-1]))

    def heated(log_transfer: float) -> Pack:
        heating = SelfHeating(heat_transfer_W_m2_K=float(np.exp(log_transfer)))
        return replace(pack, effects=(*pack.effects, heating))

    def along(test: RealTest, log_transfer: float) -> Solution:
        start_K = test.start_K(pack.initial_K)
        load = Load(time_s=test.time_s, current_A=test.current_A, ambient_K=start_K)
        return simulate(replace(heated(log_transfer), initial_K=start_K), load)

    low, high = np.log(COOLING_W_m2_K)
    followed = (t for t in by_speed if along(t, high).status is Status.DONE)
    shown = next(followed, by_speed[0])
    measured_K = shown.temperature_K
    assert measured_K is not None

    def missed_K(log_transfer: float) -> float:
        got_K = along(shown, log_transfer).temperature_K
        return float(np.sqrt(np.mean((got_K - measured_K[: got_K.size]) ** 2)))

    best = minimize_scalar(missed_K, bounds=(low, high), method="bounded", options={"xatol": 0.05})
    return replace(heated(float(best.x)), initial_K=shown.start_K(pack.initial_K))


def of_mounts(problem: Problem, q: FloatArray, told: Answer) -> dict[str, tuple[float, float]]:
    """Heat transfer of a calibrated cell in one more test in each mount [W/(m2 K)].

    And its standard error. Under "" that in a mount which none of the tests was in. Empty if no
    warming was measured.

    Args:
        problem: that was solved.
        q: (k,) its least squares.
        told: the answer there.
    """
    places = {name: k for k, name in enumerate(told.names)}
    if WARMING[1] not in places:
        return {}
    values, stds = problem.values_by_name(q), np.array([p.std for p in problem.parameters])
    by_log = told.covariance * np.outer(stds, stds)

    def of(names: Sequence[str], std: float) -> tuple[float, float]:
        own = [places[name] for name in names if name in places]
        value = float(np.prod([values[told.names[k]] for k in own]))
        return value, value * float(np.sqrt(by_log[np.ix_(own, own)].sum() + std**2))

    found = {
        t.mount: of((WARMING[1], mount_name(t)), TEST_STD)
        for k, t in enumerate(problem.tests)
        if problem.warming(k)
    }
    return found | {"": of((WARMING[1],), float(np.hypot(MOUNT_STD, TEST_STD)))}
