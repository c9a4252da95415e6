"""How well a calibrated cell follows its tests, and tests it was not fitted to."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.calibrate.objective import Problem
from twin.calibrate.ocp_correction import slow_test
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.settle import settled
from twin.load import Between

FloatArray = npt.NDArray[np.float64]

SOC_BINS = 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """One test, measured and simulated at every sample.

    Attributes:
        name: of the test.
        time_s: (n,).
        current_A: (n,) of one cell.
        measured_V: (n,) of one cell.
        simulated_V: (n,) of one cell; NaN from where the simulation ended.
        soc: (n,) state of charge of the simulated cell by charge.
        noise_V: of a sample, as estimated from the recording alone.
        between: how the current runs between the samples.
        held_out_V: (n,) predicted by a fit to the other tests; None if there is none.
        shape: (n,) what a twin may miss there over what it may elsewhere, `Sampled.shape`.
    """

    name: str
    time_s: FloatArray
    current_A: FloatArray
    measured_V: FloatArray
    simulated_V: FloatArray
    soc: FloatArray
    noise_V: float
    between: Between = Between.HOLD
    held_out_V: FloatArray | None = None
    shape: FloatArray | float = 1.0

    @property
    def rms_V(self) -> float:
        """Of measured minus simulated; infinite if the simulation did not come to the end."""
        return rms(self.measured_V - self.simulated_V)

    @property
    def held_out_rms_V(self) -> float | None:
        """Of measured minus predicted without this test."""
        if self.held_out_V is None:
            return None
        return rms(self.measured_V - self.held_out_V)

    @property
    def even_rms_V(self) -> float:
        """The same, what is missed where the voltage dives over `shape`."""
        return rms((self.measured_V - self.simulated_V) / self.shape)

    def rms_by_soc_V(self) -> FloatArray:
        """(SOC_BINS,) from empty to full; NaN where the test has no samples."""
        place = np.clip((self.soc * SOC_BINS).astype(int), 0, SOC_BINS - 1)
        error = self.measured_V - self.simulated_V
        return np.array(
            [rms(error[place == k]) if (place == k).any() else np.nan for k in range(SOC_BINS)]
        )


def rms(error: FloatArray) -> float:
    """Root mean square; infinite where something is missing."""
    return float(np.sqrt(np.mean(error**2))) if np.isfinite(error).all() else float("inf")


def own_error_V(tests: Sequence[Fitted]) -> float:
    """Rms by which a cell's voltage is missed in tests that it was not fitted to, each alike.

    Beyond their noise; where a voltage dives, as much of it as a twin may miss elsewhere. Of tests
    that nobody predicted: by the fit. A prediction that ends early stands where it ended: that it
    is empty too soon is the worst of its errors. Infinite where one does not begin.
    """
    both_V = [(f.even_rms_V, _predicted_V(f)) for f in tests]
    missed_V = np.array([by_fit_V if by_V is None else by_V for by_fit_V, by_V in both_V])
    noise_V = np.array([f.noise_V for f in tests])
    return float(np.sqrt(np.mean(np.maximum(missed_V**2 - noise_V**2, 0.0))))


def stated_error_V(tests: Sequence[Fitted]) -> float | None:
    """The same of those that were predicted, none but by a fit; None if none was, or it is noise.

    An interrupt leaves some that were not. Nor is one whose prediction does not begin.
    """
    told = [f for f in tests if (by_V := _predicted_V(f)) is not None and by_V < np.inf]
    return (own_error_V(told) or None) if told else None


def _predicted_V(test: Fitted) -> float | None:
    """What the others miss of it; None if nobody asked."""
    if test.held_out_V is None:
        return None
    known = np.flatnonzero(np.isfinite(test.held_out_V))
    if not known.size:
        return float("inf")
    ended_V = test.held_out_V[known[-1]]
    stands_V = np.where(np.isfinite(test.held_out_V), test.held_out_V, ended_V)
    return rms((test.measured_V - stands_V) / test.shape)


def fitted(problem: Problem, q: FloatArray, tests: Sequence[ReferenceTest]) -> tuple[Fitted, ...]:
    """Every test of `problem`, in full but for rows with another current's voltage."""
    values = problem.values(q)
    first = len(problem.table) - len(tests)
    capacity_C = values[[p.name for p in problem.table].index("capacity_C")]
    out = []
    for k, test in enumerate(tests):
        start_V = float(values[first + k])
        soc, told = problem.mapped(q, k).numbers["initial_soc"], ~test.mixed()
        one = Fitted(
            name=test.name,
            time_s=test.time_s[told],
            current_A=test.current_A[told],
            measured_V=test.voltage_V[told],
            simulated_V=problem.replayed(q, test, start_V)[told],
            soc=(soc - test.drawn_C() / capacity_C)[told],
            noise_V=problem.tests[k].noise_V,
            between=test.between,
            shape=problem.tests[k].shape_at(test.time_s)[told],
        )
        out.append(one)
    return tuple(out)


def predicted(
    problem: Problem, q: FloatArray, tests: Sequence[ReferenceTest], places: Collection[int]
) -> Iterator[tuple[FloatArray, ...]]:
    """Voltages of the tests at `places` by a fit to the others; empty while it goes on.

    (n,) each, without rows that have the voltage of another current.

    The weights, what is held and bumps on the open-circuit curve are theirs, and `q`, the fit to
    all, is where this one starts. Of the tests at `places` only the state at the start is used: by
    their voltage at rest, or where a current flows from the first sample on and hides it, as `q`
    has it. What state a cell was in, no other test can predict.
    """
    left = [t.as_expected() for i, t in enumerate(problem.tests) if i not in places]
    others = problem.holding(()).of_other_tests(left)
    if slow_test(others) is None:
        others = others.plain()
    best = others.coordinates(problem.values_by_name(q))
    for s in settled(others, best):
        best = s.q
        yield ()
    starts_V = problem.values(q)[len(problem.table) - len(tests) :]
    for k, test in enumerate(problem.tests):
        if test.rested:
            starts_V[k] = test.start_V
    yield tuple(others.replayed(best, tests[k], starts_V[k])[~tests[k].mixed()] for k in places)
