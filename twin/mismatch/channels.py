"""What was measured beyond voltage and current: temperature, voltages of cells.

Each is a further residual, measured minus simulated, with its own noise and its own tolerance for
what a thermometer on the outside, or an unbalanced pack, differ by without meaning. They count in
the evidence beside the voltage: an effect that mends the voltage and spoils them is no better.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from twin.mismatch.flight import BoolArray, Flight, FloatArray
from twin.mismatch.noise import beginnings, means_from
from twin.mismatch.white import step_V, white_V
from twin.solution import Solution

THERMOMETER_K = 3.0
"""By which a pack, where it is measured, differs from the twin's one temperature; it wanders in
SLOW_THERMAL_S. Three thermometers on one LiPo pouch of 6.5 Ah differ by up to 2.3 K at 2C and 5.0 K
at 5C (SINTEF's recordings of a Melasta SLPBA842124HV)."""
LEAST_THERMAL_K = 0.1
SLOW_THERMAL_S = 600.0
PERIOD_S = 10.0  # of the means that are compared: what is told here changes slowly
MOST_MEANS = 400
BALANCE_V = 10e-3  # by which cells in order differ, with the error of their voltmeters
SLOW_BALANCE_S = 300.0


@dataclass(frozen=True, slots=True, eq=False)
class Whitening:
    """Means of what counts, freed of white noise and of a slow part that wanders.

    The covariance of both is exact, from the first mean on and over gaps; residuals that are
    nothing but those have variance 1 and are independent.

    Attributes:
        at: (m,) the samples that count, in order.
        first: (k,) where in `at` each mean begins.
        lower: (k, k) Cholesky factor of their covariance.
    """

    at: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    lower: FloatArray

    @property
    def samples(self) -> npt.NDArray[np.int64]:
        """(k,) of each mean the first."""
        return self.at[self.first]

    def __call__(self, columns: FloatArray) -> FloatArray:
        """(k, c) of (n, c)."""
        means = means_from(columns[self.at], self.first)
        return np.asarray(solve_triangular(self.lower, means, lower=True))


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """One measurement of a recording.

    Attributes:
        measured: (n,)
        simulated: (m,) the same of a solution, m <= n.
        whiten: what of it counts, and what is chance in that.
    """

    measured: FloatArray
    simulated: Callable[[Solution], FloatArray]
    whiten: Whitening

    def residual(self, solution: Solution | None) -> FloatArray:
        """(n,) measured minus simulated; beyond the end of the twin as at its end."""
        known = self.simulated(solution) if solution is not None else np.zeros(0)
        if not known.size:
            return np.zeros(self.measured.size)
        held = np.full(self.measured.size, known[-1])
        held[: known.size] = known
        return np.asarray(self.measured - held)


def channels(flight: Flight) -> tuple[Channel, ...]:
    """Those of a recording."""
    return (*_warmth(flight), *_cells(flight))


def _warmth(flight: Flight) -> Iterator[Channel]:
    measured = flight.temperature_K
    if measured is None:
        return
    counted = flight.judged & np.isfinite(measured)
    if not counted.any():
        return
    white_K = max(step_V(measured) / np.sqrt(12.0), LEAST_THERMAL_K)
    slow = THERMOMETER_K, SLOW_THERMAL_S
    yield Channel(measured, _temperature, whitening(flight.time_s, counted, white_K, slow))


def _cells(flight: Flight) -> Iterator[Channel]:
    """The weakest below the mean of the others: which one that is a twin of equal cells tells not.

    Only where every cell was measured.
    """
    cells = flight.cell_voltage_V
    if cells is None or cells.shape[1] != flight.pack.series or flight.pack.series < 2:
        return
    counted = flight.judged & np.all(np.isfinite(cells), axis=1)
    if np.count_nonzero(counted) < 2:
        return
    weakest = int(np.argmin(cells[counted].mean(axis=0)))
    measured = cells[:, weakest] - np.delete(cells, weakest, axis=1).mean(axis=1)
    period_s = float(np.median(np.diff(flight.time_s[counted])))
    told_V = white_V(measured[counted], flight.load.current_A[counted], period_s)
    one_V = BALANCE_V if told_V is None else told_V  # too few samples to tell
    mean_V = one_V / np.sqrt(max(PERIOD_S / period_s, 1.0))
    slow = BALANCE_V, SLOW_BALANCE_S
    yield Channel(measured, _spread, whitening(flight.time_s, counted, mean_V, slow))


def whitening(
    time_s: FloatArray, counted: BoolArray, white: float, slow: tuple[float, float]
) -> Whitening:
    """`white` of each mean; size and time of the `slow` part."""
    at: npt.NDArray[np.int64] = np.flatnonzero(counted)
    t = time_s[at] - time_s[at[0]]
    first = beginnings(t, max(PERIOD_S, float(t[-1]) / MOST_MEANS))
    middle_s = means_from(t, first)
    size, memory_s = slow
    apart_s = np.abs(middle_s[:, None] - middle_s)
    covariance = size**2 * np.exp(-apart_s / memory_s) + white**2 * np.eye(first.size)
    return Whitening(at, first, np.asarray(np.linalg.cholesky(covariance), dtype=float))


def _temperature(solution: Solution) -> FloatArray:
    return solution.temperature_K


def _spread(solution: Solution) -> FloatArray:
    cells = solution.cell_voltage_V
    if not cells.shape[1]:
        return np.zeros(0)
    weakest = int(np.argmin(cells.mean(axis=1)))
    return np.asarray(cells[weakest] - np.delete(cells, weakest, axis=0).mean(axis=0))
