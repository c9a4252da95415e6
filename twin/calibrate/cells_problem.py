"""The sum of squares of single cells: their voltages, and what may set each apart."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
import numpy.typing as npt
from scipy.linalg import helmert

from twin.at_rest import OVERFULL
from twin.calibrate.objective import Problem
from twin.calibrate.parameters import RESISTANCE_V, Parameter, Scale
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import FLOOR_V, LEAST_NOISE_V, cuts_of, local_means, noise_of
from twin.calibrate.single_cell import labelled_C
from twin.effects import WeakCell

FloatArray = npt.NDArray[np.float64]

CAPACITY, OFFSET, RESISTANCE = "capacity_factor", "soc_offset", "resistance_ohm"
QUANTITIES = (CAPACITY, OFFSET, RESISTANCE)
BY = {CAPACITY: "area_m2", OFFSET: "initial_soc", RESISTANCE: "series_resistance_ohm"}
"""The kernel's number that each changes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellsMeasured:
    """A test with the voltages of its cells.

    Attributes:
        place: of the test in the problem.
        mean_V: (m,) of the pack over its cells, at the compared samples.
        voltage_V: (cells, m) of the cells.
        sigma_V: (m,) of the difference between cells, as expected.
    """

    place: int
    mean_V: FloatArray
    voltage_V: FloatArray
    sigma_V: FloatArray


class CellsProblem:
    """The fit of some quantities of each cell; `polish` solves it.

    Attributes:
        parameters: (k,) of the first quantity for each cell, then of the next; the offset of the
            state of charge once more for each test.
    """

    def __init__(
        self, problem: Problem, q: FloatArray, measured: Sequence[CellsMeasured],
        quantities: Sequence[str],
    ) -> None:  # fmt: skip
        self._problem, self._measured = problem, tuple(measured)
        given = problem.pack.cell_parameters()
        self._numbers = [given | problem.mapped(q, m.place).numbers for m in measured]
        self.cells = len(measured[0].voltage_V)
        self._spread = helmert(self.cells)
        self._places: list[tuple[str, int, int | None]] = [
            (quantity, cell, test)
            for quantity in quantities
            for test in (range(len(measured)) if quantity == OFFSET else (None,))
            for cell in range(self.cells)
        ]
        self.parameters = tuple(self._parameter(*place) for place in self._places)

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) least and largest coordinates."""
        low, high = zip(*(p.bounds for p in self.parameters), strict=True)
        return np.array(low), np.array(high)

    @property
    def parts(self) -> dict[str, int]:
        """Of the residuals: the mean of each test, and each of its contrasts between cells."""
        return {
            f"{self._problem.tests[m.place].name}, {row}": m.sigma_V.size
            for m in self._measured
            for row in ("mean", *(f"contrast {n}" for n in range(1, self.cells)))
        }

    def cost(self, q: FloatArray) -> float:
        """Half the sum of squares."""
        volts = [self.voltages(q, test, derivative=False)[0] for test in range(self.tests)]
        residuals = [row for test, v in enumerate(volts) for row in self._rows(v, test)]
        return 0.5 * float(sum(row @ row for row in (*residuals, q)))

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals of means and contrasts, then of the prior; and their derivative by q."""
        rows, slopes = [], []
        for test, m in enumerate(self._measured):
            simulated_V, by_q = self.voltages(q, test)
            rows.extend(self._rows(simulated_V, test))
            slopes.append(-by_q.mean(axis=0) / self._of_mean_V(test)[:, None])
            slopes.extend(-np.tensordot(self._spread, by_q, 1) / m.sigma_V[:, None])
        return np.concatenate([*rows, -q]), np.vstack([*slopes, -np.eye(q.size)])

    def _rows(self, simulated_V: FloatArray, test: int) -> list[FloatArray]:
        """The pack's own sensor tells the mean, those of the cells how they differ."""
        m = self._measured[test]
        mean_V = m.mean_V - simulated_V.mean(axis=0)
        contrasts_V = self._spread @ (m.voltage_V - simulated_V)
        return [mean_V / self._of_mean_V(test), *(contrasts_V / m.sigma_V)]

    def _of_mean_V(self, test: int) -> FloatArray:
        return self._problem.tests[self._measured[test].place].sigma_V

    def voltages(
        self, q: FloatArray, test: int, *, derivative: bool = True
    ) -> tuple[FloatArray, FloatArray]:
        """(cells, m) simulated in a test, and (cells, m, k) by q, zeros if not asked for."""
        m = self._measured[test].sigma_V.size
        volts, by_q = np.empty((self.cells, m)), np.zeros((self.cells, m, q.size))
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            jobs = [
                pool.submit(self._voltage, q, cell, test, derivative=derivative)
                for cell in range(self.cells)
            ]
            for cell, job in enumerate(jobs):
                volts[cell], columns, slopes = job.result()
                by_q[cell][:, columns] = slopes
        return volts, by_q

    def _voltage(
        self, q: FloatArray, cell: int, test: int, *, derivative: bool
    ) -> tuple[FloatArray, list[int], FloatArray]:
        """Of one cell (m,), the columns of q that act on it, and (m, columns) by those."""
        base, own = self._numbers[test], self._own(cell, test)
        weak = WeakCell().at({quantity: self._value(q, k) for quantity, k in own.items()})
        numbers = weak.changed(base, 1)
        numbers["initial_soc"] = min(max(base["initial_soc"] + weak.soc_offset, 0.0), OVERFULL)
        names = [BY[name] for name in own] if derivative else []
        response = self._problem.response(numbers, self._measured[test].place, names)
        assert response.by_q is not None
        if not derivative:
            return response.voltage_V, [], response.by_q
        slope = [self.parameters[k].slope(float(q[k])) for k in own.values()]
        per = [base["area_m2"] if quantity == CAPACITY else 1.0 for quantity in own]
        return response.voltage_V, list(own.values()), response.by_q * np.multiply(slope, per)

    @property
    def tests(self) -> int:
        """That have voltages of cells."""
        return len(self._measured)

    def measured_V(self, test: int) -> FloatArray:
        """(cells, m) in a test."""
        return self._measured[test].voltage_V

    def soc_at_start(self, test: int) -> float:
        """Of the mean cell."""
        return float(self._numbers[test]["initial_soc"])

    def columns(self, quantity: str) -> list[int]:
        """Of one quantity."""
        return [k for k, (name, _, _) in enumerate(self._places) if name == quantity]

    def _own(self, cell: int, test: int) -> dict[str, int]:
        """Quantity -> column, of those that act on a cell in a test."""
        return {
            quantity: k
            for k, (quantity, of, during) in enumerate(self._places)
            if of == cell and during in (None, test)
        }

    def _value(self, q: FloatArray, k: int) -> float:
        return self.parameters[k].value(float(q[k]))

    def _parameter(self, quantity: str, cell: int, test: int | None) -> Parameter:
        known_as = next(p for p in WeakCell.parameters if p.name == quantity)
        lower, upper, std = known_as.lower, known_as.upper, known_as.prior_std
        if quantity == RESISTANCE:  # what is usual depends on the size of the cell
            std = RESISTANCE_V / (labelled_C(self._problem.pack) / 3600)
        if quantity == OFFSET:
            assert test is not None
            lower, upper = -self.soc_at_start(test), OVERFULL - self.soc_at_start(test)
        during = "" if test is None else f":{self._problem.tests[self._measured[test].place].name}"
        return Parameter(
            name=f"cell {cell + 1}.{quantity}{during}",
            unit="" if known_as.unit == "1" else known_as.unit,
            mean=known_as.value,
            std=std,
            lower=lower,
            upper=upper,
            scale=Scale.LOG if quantity == CAPACITY else Scale.LINEAR,
        )


def cells_measured(problem: Problem, tests: Sequence[ReferenceTest]) -> Iterator[CellsMeasured]:
    """Of those tests that have voltages of cells."""
    for place, test in enumerate(tests):
        if test.cells_V is None:
            continue
        sample = problem.tests[place]
        index = np.searchsorted(test.time_s, sample.load.time_s[sample.at])
        cuts = cuts_of(test)
        cells = [replace(test, voltage_V=volts) for volts in test.cells_V]
        noise_V = sqrt(np.mean([max(noise_of(cell), LEAST_NOISE_V) ** 2 for cell in cells]))
        yield CellsMeasured(
            place=place,
            mean_V=local_means(test, index, cuts)[0],
            voltage_V=np.stack([local_means(cell, index, cuts)[0] for cell in cells]),
            sigma_V=np.sqrt(noise_V**2 / sample.count + FLOOR_V**2),
        )
