"""Whether the slow discharge demands a correction of the open-circuit curve, and which.

Bumps are fitted to what the fit of all parameters leaves of the slow discharge, with a prior: what
windows, capacity and losses can explain is theirs already. At so low a current the voltage moves as
the potential does where the electrode is on the mean.

The evidence is a difference of BIC, its variance and its number of samples those of what the bumps
leave: samples that are correlated count less.
"""

import numpy as np
import numpy.typing as npt

from twin.calibrate.answer import correlation_time
from twin.calibrate.objective import Problem
from twin.calibrate.ocp_correction import Correction, bumps
from twin.calibrate.resample import expected_V

FloatArray = npt.NDArray[np.float64]

BUMPS = 12
BUMP_V = 0.01  # standard deviation of the prior of a height
MOST_V = 0.05  # of a height
STRONG = 10.0  # gain from which the evidence counts as very strong (Kass and Raftery, 1995)
LEAST_V = 2e-3  # rms of a correction: drift of a sensor over hours looks like a smaller one
WHOLE_TEST = 0.5  # of the capacity: a test that draws less shows too little of the curve
SLOW_PER_H = 0.25  # of the capacity: a faster discharge does not tell a potential from losses


def demanded(problem: Problem, q: FloatArray) -> Correction | None:
    """By what the fit `q` (k,) leaves of the slowest test; None if nothing is, or none is slow."""
    slow = slow_discharge(problem)
    if slow is None:
        return None
    test = problem.tests[slow]
    numbers = problem.mapped(q, slow).numbers
    capacity_C = dict(zip((p.name for p in problem.table), problem.values(q), strict=True))[
        "capacity_C"
    ]
    soc = numbers["initial_soc"] - test.drawn_C / capacity_C
    full, empty = (numbers[f"positive.stoichiometry_{end}"] for end in ("min", "max"))
    residual_V = test.voltage_V - problem.simulated(q, slow).voltage_V
    noise_V = expected_V(test.noise_V, test.count)
    return correction_of(test.name, empty + soc * (full - empty), residual_V, noise_V)


def slow_discharge(problem: Problem) -> int | None:
    """Position of the test with the least current throughout, of those that draw most charge."""
    most_A = [float(np.abs(t.load.current_A).max()) for t in problem.tests]
    spans_C = [float(np.ptp(t.drawn_C)) for t in problem.tests]
    slow = [
        k
        for k, (current_A, span_C) in enumerate(zip(most_A, spans_C, strict=True))
        if 3600 * current_A < SLOW_PER_H * problem.nominal_C
        and span_C > WHOLE_TEST * problem.nominal_C
    ]
    return min(slow, key=lambda k: most_A[k], default=None)


def correction_of(
    test: str, y: FloatArray, residual_V: FloatArray, least_V: FloatArray
) -> Correction | None:
    """What a slow discharge demands; None if it demands none.

    Args:
        test: its name.
        y: (m,) mean stoichiometry of the positive electrode.
        residual_V: (m,) measured minus simulated.
        least_V: (m,) its standard deviation by noise.
    """
    centres = np.linspace(y[0], y[-1], BUMPS)
    width = float(abs(centres[1] - centres[0]))
    rows = bumps(y, centres.tolist(), width) / least_V[:, None]
    off = residual_V / least_V
    free = off - rows @ np.linalg.lstsq(rows, off)[0]
    correlated = correlation_time(free)
    variance = max(1.0, float(np.mean(free**2)) * correlated)  # of a sample that tells as one
    covariance = np.linalg.inv(rows.T @ rows / variance + np.eye(BUMPS) / BUMP_V**2)
    heights = np.clip(covariance @ rows.T @ off / variance, -MOST_V, MOST_V)
    left = off - rows @ heights
    set_by_data = BUMPS - float(np.trace(covariance)) / BUMP_V**2
    saved = float(off @ off - left @ left) / variance
    gain = saved - set_by_data * np.log(max(off.size / correlated, 1.0))
    added_V = rows @ heights * least_V
    if gain < STRONG or float(np.sqrt(np.mean(added_V**2))) < LEAST_V:
        return None
    return Correction(
        centres=tuple(centres.tolist()),
        width=width,
        heights_V=tuple(heights.tolist()),
        stds_V=tuple(np.sqrt(np.diag(covariance)).tolist()),
        test=test,
        rms_V=float(np.sqrt(np.mean(residual_V**2))),
        corrected_rms_V=float(np.sqrt(np.mean((left * least_V) ** 2))),
        gain=float(gain),
    )
