"""Measured minus simulated, of all tests at once: residuals, cost, and exact derivatives.

Coordinates q are standard deviations of the prior from its mean, so that the prior is |q|**2.
"""

import os
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from twin.bumps import Bumped
from twin.calibrate.cell_map import FILLERS, CellMap, Infeasible, Mapped, start_names
from twin.calibrate.parameters import (
    MOUNT,
    START_V,
    WARMING,
    Parameter,
    bump_parameters,
    cell_table,
    mount_name,
    mount_parameters,
    of_tests,
    own_name,
    start_parameters,
)
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import Sampled
from twin.calibrate.simulated import Simulated, Simulator
from twin.calibrate.single_cell import below_prior, filler_shares, labelled_C, single_cell
from twin.cell import BEYOND_V, Cell, Function
from twin.effects import SelfHeating
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

AT_ONCE = 8  # points whose whole responses are held
SPAN_K = 8.0
"""Of the tests' surroundings: less does not tell an activation energy from a rate.

Nor do cells that warm themselves: what they lose falls as they warm, and changes with their charge.
Of a Samsung 30Q that 1C warms by 11 K, 64 kJ/mol of conduction were found so, and of an LG M50 that
it warms by 9 K, 37 kJ/mol of diffusion in the salt, by which it ran out of salt at 0 degC."""


class Problem:
    """Tests of one cell, and the parameters that are free.

    Attributes:
        pack: of one cell.
        tests: what was measured.
        table: all parameters of the cell, then how it cools in mounts and tests, where several
            show it, then the start of each test.
        free: (k,) positions in `table` of those that are asked for; the others stay at their mean.
        held: (k,) which of these stay there too, since the tests do not tell them.
        unbumped: of a cell with bumps on its potential the test that tells it best, and what a fit
            without them leaves of that, `even_rms_V`; else None.
    """

    def __init__(  # noqa: PLR0913
        self, pack: Pack, tests: Sequence[Sampled], *, only: Sequence[str] | None = None,
        table: Sequence[Parameter] | None = None, held: Collection[str] = (),
        unbumped: tuple[str, float] | None = None,
    ) -> None:  # fmt: skip
        """`only` names the parameters of the cell that are free, None all; starts are free.

        `held` names free ones that stay at their mean: their coordinates and bounds are 0.
        """
        self.pack, self.tests, self.unbumped = single_cell(pack), tuple(tests), unbumped
        self._heats = any(isinstance(e, SelfHeating) for e in pack.effects)
        if table is None:
            table = cell_table(
                self.pack,
                warm_and_cold=self._span_K() > SPAN_K,
                warming=any(self.warming(k) for k in range(len(self.tests))),
            )
        cell = tuple(table)
        kept = [i for i, p in enumerate(cell) if only is None or p.name in only]
        cools = WARMING[1] in [cell[i].name for i in kept]
        warm = [t for k, t in enumerate(self.tests) if cools and self.warming(k)]
        mounts = mount_parameters(warm)
        self.table = (*cell, *mounts, *start_parameters(self.tests, pack))
        self._of_cell = len(cell)
        self._mounts = {p.name: len(cell) + n for n, p in enumerate(mounts)}
        self.free = (*kept, *range(len(cell), len(self.table)))
        self.held = np.array([self.table[i].name in held for i in self.free])
        own = [MOUNT] if mounts else []
        self._map = CellMap(self.pack, (*(p.name for p in cell), *own, START_V))
        self._simulator = Simulator(self.pack)
        self._last: tuple[bytes, FloatArray] = b"", np.zeros(0)
        self._filler_means = filler_shares(self.pack)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """(k,) the free ones."""
        return tuple(self.table[i] for i in self.free)

    @property
    def derived(self) -> tuple[str, ...]:
        """What follows from the parameters, and is part of the answer."""
        return self._map.derived

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) least and largest coordinates."""
        low, high = zip(*(p.bounds for p in self.parameters), strict=True)
        return np.where(self.held, 0.0, low), np.where(self.held, 0.0, high)

    def values(self, q: FloatArray) -> FloatArray:
        """(table,) of all parameters."""
        out = self._means()
        out[list(self.free)] = [p.value(c) for p, c in zip(self.parameters, q, strict=True)]
        return out

    def values_by_name(self, q: FloatArray) -> dict[str, float]:
        """Of all parameters."""
        return dict(zip((p.name for p in self.table), self.values(q).tolist(), strict=True))

    def coordinates(self, values: Mapping[str, float]) -> FloatArray:
        """(k,) of the free parameters at values by name; those without one at their mean."""
        q = [p.coordinate(values[p.name]) if p.name in values else 0.0 for p in self.parameters]
        return np.asarray(np.clip(q, *self.bounds), dtype=float)

    def warming(self, test: int) -> bool:
        """Whether it was measured how the cell warms, and it does so in the twin."""
        return self._heats and self.tests[test].temperature_K is not None

    def _cooling(self, values: FloatArray, test: Sampled | ReferenceTest) -> float:
        """How a test cools, over how the cell does on the whole; 1 where nothing shows it."""
        return float(np.prod([values[place] for place in self._places(test)]))

    def _places(self, test: Sampled | ReferenceTest) -> list[int]:
        """In `table`, of how a test cools."""
        names = (mount_name(test), own_name(test))
        return [self._mounts[name] for name in names if name in self._mounts]

    def residuals(self, q: FloatArray) -> FloatArray:
        """Measured minus simulated voltage over what is expected of it, test by test.

        Then the prior's, which are -q and the fillers'; then those of the temperatures. Where no
        cell has these values all residuals are large, the larger the farther it is from possible.
        The last are kept: who is told of a step asks for those that it was judged by.
        """
        last, key = self._last, q.tobytes()
        if last[0] != key:
            self._last = last = key, self._residuals([q])[0]
        return last[1]

    def _residuals(self, points: Sequence[FloatArray]) -> list[FloatArray]:
        """At each of the points; the same test of several goes side by side."""
        numbers = [self._numbers_at(q) for q in points]
        possible = [own for own in numbers if not isinstance(own, Infeasible)]
        asked = [(t, own[k]) for k, t in enumerate(self.tests) for own in possible]
        done = self._simulator.plain(asked)
        answers = (done[k :: len(possible)] for k in range(len(possible)))
        both = zip(points, numbers, strict=True)
        return [
            self._missed(q, own if isinstance(own, Infeasible) else next(answers))
            for q, own in both
        ]

    def _numbers_at(self, q: FloatArray) -> list[dict[str, float]] | Infeasible:
        """Of the kernel, in each test."""
        values = self.values(q)
        try:
            return [self._map(self._values_at(values, k))[0] for k in range(len(self.tests))]
        except Infeasible as e:
            return e

    def _missed(self, q: FloatArray, answers: Sequence[Simulated] | Infeasible) -> FloatArray:
        warming = [k for k in range(len(self.tests)) if self.warming(k)]
        if isinstance(answers, Infeasible):
            far_V = BEYOND_V * (2.0 + abs(answers.by))
            rows = [np.full(t.at.size, -far_V) / t.sigma_V for t in self.tests]
            warm = [np.zeros(self.tests[k].at.size) for k in warming]
            derived = np.zeros(len(self.derived))
        else:
            both = zip(self.tests, answers, strict=True)
            rows = [(t.voltage_V - a.voltage_V) / t.sigma_V for t, a in both]
            warm = [self._missed_K(answers[k], k) for k in warming]
            derived = self._map(self._values_at(self.values(q), 0))[1]
        fillers, _ = self.missed_fillers(derived)
        return np.concatenate([*rows, -q, fillers, *warm])

    def _missed_K(self, answer: Simulated, test: int) -> FloatArray:
        measured_K = self.tests[test].temperature_K
        assert measured_K is not None
        missed_K = np.where(np.isnan(measured_K), 0.0, measured_K - answer.temperature_K)
        return np.asarray(missed_K / self.tests[test].sigma_K)

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """`residuals` and their derivative by q; Infeasible if no cell has these values."""
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            jobs = [
                pool.submit(self.simulated, q, i, derivative=True) for i in range(len(self.tests))
            ]
            done = [job.result() for job in jobs]
        rows, slopes, warm, warming = [], [], [], []
        for k, (test, simulated) in enumerate(zip(self.tests, done, strict=True)):
            assert simulated.by_q is not None
            rows.append((test.voltage_V - simulated.voltage_V) / test.sigma_V)
            slopes.append(-simulated.by_q / test.sigma_V[:, None])
            if self.warming(k):
                assert simulated.warming_by_q is not None
                assert test.temperature_K is not None
                warm.append(self._missed_K(simulated, k))
                told = ~np.isnan(test.temperature_K)
                warming.append(-simulated.warming_by_q * told[:, None] / test.sigma_K)
        mapped = self.mapped(q, 0)
        fillers, by_filler = self.missed_fillers(mapped.derived)
        by_q = by_filler[:, None] * self.chain(q, mapped.derived_by_values[FILLERS], 0)
        residuals = np.concatenate([*rows, -q, fillers, *warm])
        return residuals, np.vstack([*slopes, -np.eye(q.size), by_q, *warming])

    def cost(self, q: FloatArray) -> float:
        """Half the sum of squares of `residuals`."""
        return _half_square(self.residuals(q))

    def costs(self, points: FloatArray) -> FloatArray:
        """(m,) of points (m, k) of the unit cube: what a search minimises."""
        low, high = self.bounds
        whole = list(low + points * (high - low))
        parts = [self._residuals(whole[k:][:AT_ONCE]) for k in range(0, len(whole), AT_ONCE)]
        return np.array([_half_square(r) for part in parts for r in part])

    def simulated(self, q: FloatArray, test: int, *, derivative: bool = False) -> Simulated:
        """The test number `test`; Infeasible if no cell has these values."""
        values, sample = self._values_at(self.values(q), test), self.tests[test]
        if not derivative:
            return self._simulator.plain([(sample, self._map(values)[0])])[0]
        mapped = self._map.mapped(values)
        by_q = self.chain(q, mapped.by_values, test)
        names, start = start_names(self._map.directions, mapped.numbers["initial_soc"])
        used = np.flatnonzero(np.abs(by_q).max(axis=1) > 0)
        response = self.response(mapped.numbers, test, [names[i] for i in used])
        assert response.by_q is not None
        assert response.warming_by_q is not None
        inner = by_q[used] / start[used, None]
        return replace(
            response, by_q=response.by_q @ inner, warming_by_q=response.warming_by_q @ inner
        )

    def response(self, numbers: Mapping[str, float], test: int, names: Sequence[str]) -> Simulated:
        """The test number `test` with these numbers of the kernel, and derivatives by `names`."""
        return self._simulator.response(self.tests[test], numbers, names)

    def rms_V(self, q: FloatArray, test: int) -> float:
        """Of measured minus simulated at the compared samples of a test."""
        off_V = self.tests[test].voltage_V - self.simulated(q, test).voltage_V
        return float(np.sqrt(np.mean(off_V**2)))

    def even_rms_V(self, q: FloatArray, test: int) -> float:
        """The same, what is missed where the voltage dives over `Sampled.shape`."""
        sample = self.tests[test]
        off_V = sample.voltage_V - self.simulated(q, test).voltage_V
        return float(np.sqrt(np.mean((off_V / sample.shape) ** 2)))

    @property
    def nominal_C(self) -> float:
        """Capacity of the cell as it is labelled."""
        return labelled_C(self.pack)

    def rest_V(self, q: FloatArray, soc: float) -> float:
        """Open-circuit voltage at a state of charge; `q` as in `replayed`."""
        return self._map.rest_V(self._values_of_cell(q), soc)

    def replayed(self, q: FloatArray, test: ReferenceTest, start_V: float) -> FloatArray:
        """(n,) voltage at every sample of any `test`; NaN from where the simulation ended.

        It cools as in its mount; in one that is not among those of this problem, as on the whole.
        `q` (k,): those of mounts and tests may be left out. Infeasible if no cell has these values.
        """
        mount = self._cooling(self.values(q), test) if q.size == len(self.free) else 1.0
        numbers = self._map(np.append(self._values_of_cell(q, mount), start_V))[0]
        done = self._simulator.finely(test.load(), numbers).voltage_V
        return np.concatenate([done, np.full(test.time_s.size - done.size, np.nan)])

    def of_other_tests(self, tests: Sequence[Sampled]) -> "Problem":
        """The same cell and free parameters; starts as `tests` have them."""
        return self._with(tests=tests)

    def holding(self, names: Collection[str]) -> "Problem":
        """The same with the parameters `names`, and no others, held at their mean."""
        return self._with(held=names)

    def refined(self, q: FloatArray) -> "Problem":
        """The same, with what its steps and mesh miss at `q` (k,) added to what is simulated.

        A deferred correction: `q` where this problem is least is that of fine steps and mesh.
        """
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            values, tests = self.values(q), range(len(self.tests))
            numbers = [self._map(self._values_at(values, k))[0] for k in tests]
            missed = pool.map(self._simulator.missed_V, self.tests, numbers)
            corrected = [replace(t, missed_V=m) for t, m in zip(self.tests, missed, strict=True)]
        return self.of_other_tests(corrected)

    def with_only(self, names: Sequence[str], tests: Sequence[int]) -> "Problem":
        """The same with fewer free parameters of the cell, and some of the tests."""
        return self._with(only=names, tests=[self.tests[k] for k in tests], held=())

    def bumped(self, potential: Bumped, *, unbumped: tuple[str, float]) -> "Problem":
        """The same with bumps on the positive electrode's potential, their heights free."""
        cell = _with_potential(self.pack.cell, potential)
        names = potential.names("positive")
        heights = [p for p in bump_parameters(cell) if p.name in names]
        table = (*self.table[: self._of_cell], *heights)
        pack = replace(self.pack, cell=cell)
        return self._with(pack=pack, table=table, only=[*self._only, *names], unbumped=unbumped)

    def plain(self) -> "Problem":
        """The same without bumps on that potential."""
        potential = self.pack.cell.positive.ocp_V
        if not isinstance(potential, Bumped):
            return self
        bumps = potential.names("positive")
        return self._with(
            pack=replace(self.pack, cell=_with_potential(self.pack.cell, potential.plain)),
            table=[p for p in self.table[: self._of_cell] if p.name not in bumps],
            only=[name for name in self._only if name not in bumps],
            unbumped=None,
        )

    def _with(self, **changes: Any) -> "Problem":
        """The same but for some of what it was made from."""
        names = [p.name for p in self.parameters]
        given: dict[str, Any] = {
            "pack": self.pack,
            "tests": self.tests,
            "only": self._only,
            "table": self.table[: self._of_cell],
            "held": [name for name, held in zip(names, self.held, strict=True) if held],
            "unbumped": self.unbumped,
        }
        return Problem(**given | changes)

    @property
    def _only(self) -> list[str]:
        """Names of the free parameters of the cell."""
        return [p.name for p in self.parameters if not of_tests(p.name)]

    def _values_of_cell(self, q: FloatArray, mount: float = 1.0) -> FloatArray:
        out = self._means()[: self._of_cell]
        for place, p, c in zip(self.free, self.parameters, q.tolist(), strict=False):
            if place < self._of_cell:
                out[place] = p.value(c)
        return np.append(out, mount) if self._mounts else out

    def mapped(self, q: FloatArray, test: int) -> Mapped:
        """What the kernel is given."""
        return self._map.mapped(self._values_at(self.values(q), test))

    def numbers(self, q: FloatArray) -> dict[str, float]:
        """Of the cell, cooled as on the whole, at the start of the first test."""
        values = self.values(q)
        start_V = values[-len(self.tests)]
        return self._map(np.append(self._values_of_cell(q), start_V))[0]

    def missed_fillers(self, derived: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `below_prior` has those of `derived`."""
        return below_prior(derived[FILLERS], self._filler_means)

    def chain(self, q: FloatArray, by_values: FloatArray, test: int) -> FloatArray:
        """(rows, k) by coordinates, from (rows, values) by the values of one test."""
        own = {i: i for i in range(self._of_cell)}
        own[len(self.table) - len(self.tests) + test] = by_values.shape[1] - 1
        factors = self._places(self.tests[test])
        own |= dict.fromkeys(factors, self._of_cell)
        cooling = self._cooling(self.values(q), self.tests[test])
        out = np.zeros((by_values.shape[0], q.size))
        for k, (i, p) in enumerate(zip(self.free, self.parameters, strict=True)):
            if i in own:
                others = cooling / p.value(float(q[k])) if i in factors else 1.0
                out[:, k] = by_values[:, own[i]] * p.slope(float(q[k])) * others
        return out

    def _means(self) -> FloatArray:
        return np.array([p.mean for p in self.table])

    def _values_at(self, values: FloatArray, test: int) -> FloatArray:
        """Those of the cell, then of one test: how it cools in its mount, and its start."""
        own = [self._cooling(values, self.tests[test])] if self._mounts else []
        return np.append(values[: self._of_cell], [*own, values[test - len(self.tests)]])

    def _span_K(self) -> float:
        """Between the coldest and the warmest surroundings of the tests."""
        known_K = [t.load.ambient_K for t in self.tests]
        return max(known_K) - min(known_K)


def _with_potential(cell: Cell, ocp_V: Function) -> Cell:
    return replace(cell, positive=replace(cell.positive, ocp_V=ocp_V))


def _half_square(residuals: FloatArray) -> float:
    return 0.5 * float(residuals @ residuals)
