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
import numpy.typing as npt
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize
from scipy.special import expit

from twin.load import Load
from twin.mismatch.flight import Flight, FloatArray
from twin.mismatch.pauses import LONG
from twin.mismatch.wander import Wander
from twin.mismatch.white import NORMAL, STEP
from twin.pack import Pack
from twin.simulate import simulate

IntArray = npt.NDArray[np.int64]

BEGINS = [0.0, 2.0, 3.0], [-4.0, 2.0, 3.0]  # log of a size, logits of two shares
LIMITS = (-18.0, 9.0), (-9.0, 9.0), (-9.0, 9.0)
SMALL_A = 0.01  # of noise that is put in, so that the twin stays as it is
CLOSE = 0.02  # of a point and a cost: a search ends
WAVES = 10_000  # frequencies


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Likeliest:
    """A current behind its record.

    Attributes:
        current_A: (n,) its mean.
        left_A: by which that may be off, standard deviation.
        left_s: integral of the correlation of that over later times.
        damping: of that as an oscillator (`Wander`).
    """

    current_A: FloatArray
    left_A: float
    left_s: float
    damping: float


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


def answers_ohm(pack: Pack, flight: Flight, left: Wander) -> float:
    """By how much a twin and its instruments answer to what a current is off by.

    To noise that is as slow as `left`, where the samples count.
    """
    drawn = left.drawn(np.diff(flight.time_s), np.random.default_rng(0))
    noise_A = SMALL_A / left.size_V * drawn
    noisy = replace(flight.load, current_A=flight.load.current_A + noise_A)
    as_is_V, moved_V = (simulate(pack, own).voltage_V for own in (flight.load, noisy))
    n = min(as_is_V.size, moved_V.size)
    at = flight.judged[:n]
    return (
        float(np.std((moved_V[:n] - as_is_V[:n])[at]) / np.std(noise_A[:n][at]))
        if at.any()
        else 0.0
    )


def likeliest(load: Load, noise_A: float) -> Likeliest:
    """The mean of a current given its record in white noise: Wiener's filter, as least squares.

    A current z is taken to be autoregressive of second order, (1 - a L)(1 - b L) z = w about its
    mean, L the step to the sample before; a, b (0 to 1) and the variance of w are the likeliest by
    the record. Across a switch (STEP deviations of all changes, or more) and a pause nothing is
    expected of it.
    """
    change_A, dt = np.abs(np.diff(load.current_A)), np.diff(load.time_s)
    usual = change_A <= STEP * np.median(change_A) / NORMAL
    usual &= dt <= LONG * np.median(dt)
    rows = np.flatnonzero(usual[1:] & usual[:-1])
    mean_A = float(np.mean(load.current_A))
    record = (load.current_A - mean_A) / noise_A

    def at(point: FloatArray) -> tuple[float, FloatArray]:
        return _given(record, _steps(point), rows, float(point[0]))

    def cost(point: FloatArray) -> float:
        return at(point)[0]

    ends = [
        minimize(cost, np.array(begin), method="Nelder-Mead", bounds=LIMITS, tol=CLOSE).x
        for begin in BEGINS
    ]
    best = min(ends, key=cost)
    left, steps_left, damping = _left(_steps(best), float(np.exp(best[0])))
    return Likeliest(
        current_A=mean_A + noise_A * at(best)[1],
        left_A=noise_A * sqrt(left),
        left_s=float(np.median(dt)) * steps_left,
        damping=damping,
    )


def _steps(point: FloatArray) -> FloatArray:
    """(3,) of (1 - a L)(1 - b L), by the logits of a and b."""
    a, b = expit(point[1:])
    return np.array([1.0, -(a + b), a * b])


def _given(
    record: FloatArray, steps: FloatArray, rows: IntArray, log_size: float
) -> tuple[float, FloatArray]:
    """Minus twice the logarithm of the probability of a record (n,) in noise of 1, and its mean.

    z is of least |z - record|^2 + |steps z|^2 / exp(log_size), the latter from `rows` on.
    """
    bands = np.zeros((steps.size, record.size))
    for later in range(steps.size):
        for k in range(steps.size - later):
            weight = steps[::-1][k] * steps[::-1][k + later]  # oldest first, as samples are
            bands[later] += np.bincount(rows + k, np.full(rows.size, weight), record.size)
    bands *= np.exp(-log_size)
    bands[0] += 1.0
    factor = cholesky_banded(bands, lower=True)
    mean = np.asarray(cho_solve_banded((factor, True), record))
    dets = 2.0 * float(np.sum(np.log(factor[0]))) + log_size * rows.size
    return float(record @ (record - mean)) + dets, mean


def _left(steps: FloatArray, size: float) -> tuple[float, float, float]:
    """Of what the mean is off by: its variance, the integral of its correlation [steps], damping.

    Its spectrum is size / (size + |steps|^2) of that of the noise, which is one of an
    autoregressive process of second order: its poles are roots of that denominator.
    """
    turns = np.exp(-1j * np.outer(np.linspace(0.0, np.pi, WAVES), np.arange(steps.size)))
    spectrum = size / (size + np.abs(turns @ steps) ** 2)
    variance = float(np.mean(spectrum))
    whole = np.correlate(steps, steps, mode="full")
    whole[steps.size - 1] += size
    rates = -np.log(sorted(np.roots(whole).astype(complex), key=abs)[: steps.size - 1])
    swing = sqrt(float(np.prod(rates).real))
    return variance, float(spectrum[0]) / (2.0 * variance), float(np.sum(rates).real) / (2 * swing)
