"""Cells of a pack that differ: how much there is of each, how full it is, how well connected.

The calibrated cell stands for their mean. Each cell has a share of coated area, a state of charge
at the start of each test and a resistance of its own, fitted to the voltages of the cells: to their
mean as closely as the calibrated cell follows it, to their differences as closely as noise lets
them be known, since what the model of the cell misses it misses in all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from twin.calibrate.answer import NINETY, Answer
from twin.calibrate.cells_problem import (
    CAPACITY,
    OFFSET,
    QUANTITIES,
    RESISTANCE,
    CellsMeasured,
    CellsProblem,
    cells_measured,
)
from twin.calibrate.known import known
from twin.calibrate.polish import polish
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import FLOOR_V, sampled
from twin.calibrate.run import Progress, fit
from twin.effects import WeakCell

FloatArray = npt.NDArray[np.float64]

CHANCE = 0.01
"""Differences of a quantity that noise alone makes as large more often than this are left out."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Difference:
    """Of one quantity among the cells, from their mean.

    Attributes:
        quantity: one of QUANTITIES.
        unit: of the values.
        value: (cells,); the offset of the state of charge is that at `Unlike.soc`.
        std: (cells,) standard errors.
        chance: that noise alone makes differences as large.
    """

    quantity: str
    unit: str
    value: FloatArray
    std: FloatArray
    chance: float

    @property
    def beyond_noise(self) -> bool:
        """They are there."""
        return self.chance < CHANCE

    @property
    def interval(self) -> tuple[FloatArray, FloatArray]:
        """(cells,) ends of the 90 % intervals."""
        return self.value - NINETY * self.std, self.value + NINETY * self.std


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unlike:
    """What the voltages of the cells tell of each.

    Attributes:
        soc: state of charge of the mean cell to which the offsets belong.
        differences: of each quantity, those that are not beyond the noise as they were when they
            were last in the fit.
        weak: the cells that differ, as a pack has them; none if nothing is beyond the noise.
        answer: the fit, of the quantities that are kept.
        before_V: (cells,) rms of measured minus simulated where all are like the mean cell,
        after_V: and with their differences.
    """

    soc: float
    differences: tuple[Difference, ...]
    weak: tuple[WeakCell, ...]
    answer: Answer | None
    before_V: FloatArray
    after_V: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parted:
    """A calibration of one cell, and what sets the cells of the pack apart from it.

    Attributes:
        best: the fit of that cell.
        tests: of it.
        unlike: the cells beside it.
    """

    best: Progress
    tests: tuple[ReferenceTest, ...]
    unlike: Unlike


def part(
    best: Progress, tests: Sequence[ReferenceTest], *, parallel: int, soc: float
) -> Parted | None:
    """The cells whose voltages `tests` have, about `best`, a fit to the mean of the cells.

    The mean of unlike cells is the voltage of none: where the smallest is empty it bends too soon.
    So where they differ, the cell that was most like their mean is fitted itself, and all are
    compared with it. The offsets of the state of charge are those when the mean cell is at `soc`.
    None where no test has voltages of cells.
    """
    if all(t.cells_V is None for t in tests):
        return None
    unlike = _unlike(best, tests, parallel=parallel, soc=soc)
    if not unlike.weak:
        return Parted(best=best, tests=tuple(tests), unlike=unlike)
    typical = int(unlike.before_V.argmin())
    own = tuple(
        t if t.cells_V is None else replace(t, voltage_V=t.cells_V[typical], remarks=(
            *t.remarks, f"the cells differ: fitted is cell {typical + 1}, most like their mean"
        ))
        for t in tests
    )  # fmt: skip
    nominal_C = best.problem.nominal_C
    problem = best.problem.of_other_tests([sampled(t, nominal_C) for t in own])
    *_, again = fit(problem, start=best.problem.values_by_name(best.q))
    unlike = _unlike(again, tests, parallel=parallel, soc=soc)
    return Parted(best=again, tests=own, unlike=unlike)


def _unlike(best: Progress, tests: Sequence[ReferenceTest], *, parallel: int, soc: float) -> Unlike:
    """Quantities that do not differ beyond the noise are left out, one after the other."""
    measured = tuple(cells_measured(best.problem, tests))
    kept, seen = list(QUANTITIES), dict[str, Difference]()
    while True:
        own = CellsProblem(best.problem, best.q, measured, kept)
        at = _solved(own)
        answer = known(own, at, own.parameters, own.parts, least=_least(measured))
        found = {name: _difference(own, at, answer, name, soc) for name in kept}
        seen |= found
        least = max(found.values(), key=lambda d: d.chance)
        if least.beyond_noise:
            break
        kept.remove(least.quantity)
        if not kept:
            at = np.zeros(at.size)
            break
    return Unlike(
        soc=soc,
        differences=tuple(seen[name] for name in QUANTITIES),
        weak=_weak(own, at, kept, seen, parallel),
        answer=answer if kept else None,
        before_V=_rms(own, np.zeros(at.size)),
        after_V=_rms(own, at),
    )


def _solved(own: CellsProblem) -> FloatArray:
    *_, last = polish(own, np.zeros(len(own.parameters)))
    return last.q


def _least(measured: Sequence[CellsMeasured]) -> float:
    """Mean square of residuals that noise alone leaves, over what was expected."""
    return float(np.mean([np.mean(1 - (FLOOR_V / m.sigma_V) ** 2) for m in measured]))


def _difference(
    own: CellsProblem, q: FloatArray, answer: Answer, quantity: str, soc: float
) -> Difference:
    """Of one quantity, from the mean of the cells, with its joint chance."""
    columns = own.columns(quantity)
    value = np.array([own.parameters[k].value(float(q[k])) for k in columns])
    slope = np.array([own.parameters[k].slope(float(q[k])) for k in columns])
    covariance = answer.covariance[np.ix_(columns, columns)] * np.outer(slope, slope)
    if quantity == OFFSET:
        value, covariance = _at_soc(own, q, value, covariance, soc)
    n = own.cells
    centred = np.eye(n) - 1.0 / n
    difference, spread = centred @ value, centred @ covariance @ centred
    square = float(difference @ np.linalg.pinv(spread, hermitian=True) @ difference)
    return Difference(
        quantity=quantity,
        unit=own.parameters[columns[0]].unit,
        value=difference,
        std=np.sqrt(np.diag(spread)),
        chance=float(chi2.sf(square, n - 1)),
    )


def _at_soc(
    own: CellsProblem, q: FloatArray, value: FloatArray, covariance: FloatArray, soc: float
) -> tuple[FloatArray, FloatArray]:
    """(cells,) offsets when the mean cell is at `soc`, from those at the starts of the tests.

    The charge between moves a cell of capacity factor f by 1/f as much. Tests are weighed by what
    each tells.
    """
    n, capacity = own.cells, own.columns(CAPACITY)
    factor = np.ones(n)
    if capacity:
        factor = np.array([own.parameters[k].value(float(q[k])) for k in capacity])
    centred = np.eye(n) - 1.0 / n
    precision, weighed = np.zeros((n, n)), np.zeros(n)
    for test in range(value.size // n):
        part = slice(test * n, (test + 1) * n)
        moved = value[part] + (soc - own.soc_at_start(test)) * (1.0 / factor - 1.0)
        weight = np.linalg.inv(covariance[part, part])
        precision += weight
        weighed += weight @ moved
    together: FloatArray = np.linalg.inv(precision).astype(float)
    return centred @ together @ weighed, together


def _weak(
    own: CellsProblem, q: FloatArray, kept: Sequence[str], seen: Mapping[str, Difference],
    parallel: int,
) -> tuple[WeakCell, ...]:  # fmt: skip
    """Every cell as the pack has it: kept quantities as fitted, the offset without its mean."""
    if not kept:
        return ()
    out = []
    for cell in range(own.cells):
        values = {
            name: own.parameters[own.columns(name)[cell]].value(float(q[own.columns(name)[cell]]))
            for name in kept
            if name != OFFSET
        }
        if OFFSET in kept:
            values[OFFSET] = float(seen[OFFSET].value[cell])
        if RESISTANCE in values:
            values[RESISTANCE] /= parallel
        out.append(WeakCell(cell=cell + 1).at(values))
    return tuple(out)


def _rms(own: CellsProblem, q: FloatArray) -> FloatArray:
    """(cells,) of measured minus simulated at the compared samples of all tests."""
    errors = [own.measured_V(test) - own.voltages(q, test)[0] for test in range(own.tests)]
    return np.asarray(np.sqrt(np.mean(np.hstack(errors) ** 2, axis=1)))
