"""The likeliest current behind a noisy record of it: `quieted`.

A twin answers to the noise of a recorded current, which never flowed. It makes noise of residuals,
draws numbers of effects to less than they are (errors in variables), and whatever smooths it looks
better than what does not: an instrument that undoes a lag which is not there, kinetics that answer
less. To the mean of the current given its record a fit is unbiased (regression calibration:
Carroll, Ruppert, Stefanski, Crainiceanu, Measurement Error in Nonlinear Models, 2006, chapter 4).
"""

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize_scalar

from twin.load import Load
from twin.mismatch.flight import Flight, FloatArray
from twin.mismatch.white import NORMAL, STEP

ORDERS = (1, 2)  # of the differences that are random: a current, or its rate of change, walks
LOG_SIZES = (-15.0, 10.0)  # of their variance, over that of the noise
WAVES = 10_000  # frequencies


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Likeliest:
    """A current behind its record.

    Attributes:
        current_A: (n,) its mean.
        left_A: by which that may be off, standard deviation.
        left_s: time over which it forgets that: slow noise is as large as it was in the record.
    """

    current_A: FloatArray
    left_A: float
    left_s: float


def quieted(flight: Flight, noise_A: float) -> tuple[Flight, Likeliest]:
    """With the likeliest current instead of the recorded one, what was added between moved alike.

    Args:
        flight: as it was recorded.
        noise_A: white noise of its current, standard deviation (`white.current_noise`).
    """
    recorded = flight.recorded_load
    found = likeliest(recorded, noise_A)
    moved_A = np.interp(flight.time_s, recorded.time_s, found.current_A - recorded.current_A)
    load = replace(flight.load, current_A=flight.load.current_A + moved_A)
    return replace(flight, load=load), found


def likeliest(load: Load, noise_A: float) -> Likeliest:
    """The mean of a current that walks at random, given its record in white noise.

    Either the current walks or its rate of change does, and by as much as is likeliest by the
    record. Where it was switched (STEP deviations of its differences, or more) it may have changed
    by anything.
    """
    found = [(order, *_smoothed(load, order, noise_A)) for order in ORDERS]
    order, _, size, mean_A = min(found, key=lambda f: f[1])
    bend = (2.0 - 2.0 * np.cos(np.linspace(0.0, np.pi, WAVES))) ** order
    left = float(np.mean(1.0 / (1.0 + bend / size)))  # of the variance of the noise
    return Likeliest(
        current_A=mean_A,
        left_A=noise_A * sqrt(left),
        left_s=float(np.median(np.diff(load.time_s))) / (2.0 * left),
    )


def _smoothed(load: Load, order: int, noise_A: float) -> tuple[float, float, FloatArray]:
    """Minus twice the logarithm of the probability of the record, v / noise_A^2, mean current (n,).

    With the variance v of the differences D z of the current z that makes that least; z is of least
    |z - recorded|^2 / noise_A^2 + |D z|^2 / v.
    """
    differences = _differences(load, order)
    gram = (differences.T @ differences).tocoo()
    bands = np.stack([np.pad(gram.diagonal(-k), (0, k)) for k in range(order + 1)])
    unit = np.zeros_like(bands)
    unit[0] = 1.0

    def at(log_size: float) -> tuple[float, FloatArray]:
        factor = cholesky_banded(unit + np.exp(-log_size) * bands, lower=True)
        mean_A = np.asarray(cho_solve_banded((factor, True), load.current_A))
        left = float(load.current_A @ (load.current_A - mean_A)) / noise_A**2
        dets = 2.0 * float(np.sum(np.log(factor[0]))) + log_size * differences.shape[0]
        return left + dets, mean_A

    best = minimize_scalar(lambda x: at(x)[0], bounds=LOG_SIZES, method="bounded")
    cost, mean_A = at(float(best.x))
    cost += differences.shape[0] * float(np.log(2.0 * np.pi * noise_A**2))
    return cost, float(np.exp(best.x)), mean_A


def _differences(load: Load, order: int) -> sparse.csr_array:
    """(m, n) of a current, per median interval and where it was not switched; unit variance."""
    dt = np.diff(load.time_s) / np.median(np.diff(load.time_s))
    steps_A = np.abs(np.diff(load.current_A))
    usual = steps_A <= STEP * np.median(steps_A) / NORMAL
    n = load.time_s.size
    one = sparse.csr_array(sparse.eye_array(n))
    slopes = sparse.csr_array(sparse.diags_array(1.0 / dt) @ (one[1:] - one[:-1]))
    if order == 1:
        weights, rows, good = np.sqrt(dt), slopes, usual
    else:
        weights, rows = np.sqrt(2.0 / (dt[1:] + dt[:-1])), slopes[1:] - slopes[:-1]
        good = usual[1:] & usual[:-1]
    return sparse.csr_array(sparse.diags_array(weights[good]) @ rows[good])
