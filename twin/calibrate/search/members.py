"""The algorithms, each behind the same ask and tell: CMA-ES of `cma`, the others of `pymoo`.

Both libraries are imported when the first member is made.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

SMALLEST_BATCH = 8
COLLAPSED = 1e-9
"""Of the box, in every coordinate: nothing that is calibrated is known that well. CMA-ES stops here
too."""
IDLE_GENERATIONS = 60  # without a better point, then a population is given up


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seed:
    """What a member starts from.

    Attributes:
        points: (m, k) its population; CMA-ES starts at the first of them.
        costs: (m,) NaN where not evaluated yet.
        spread: (k,) standard deviation of CMA-ES at the start.
        size: of the population.
        random: seed of its random numbers.
    """

    points: FloatArray
    costs: FloatArray
    spread: FloatArray
    size: int
    random: int


class Member(Protocol):
    """One algorithm at work."""

    def ask(self) -> FloatArray:
        """(m, k) points to evaluate, inside the box; empty if it has no more."""

    def tell(self, costs: FloatArray) -> None:
        """(m,) costs of what was asked."""

    def exhausted(self) -> bool:
        """Whether it will not get any further by itself."""


class Cma:
    """CMA-ES (Hansen, arXiv 1604.00772), bounds by the smooth fold of the library."""

    def __init__(self, seed: Seed) -> None:
        import cma

        random, k = np.random.default_rng(seed.random), seed.points.shape[1]
        scale = float(seed.spread.max())
        options = {
            "bounds": [[0.0] * k, [1.0] * k],
            "CMA_stds": seed.spread / scale,
            "popsize": seed.size,
            "tolx": COLLAPSED,
            "randn": lambda *shape: random.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
        }
        self._strategy: Any = cma.CMAEvolutionStrategy(seed.points[0], scale, options)
        self._asked: list[FloatArray] = []

    def ask(self) -> FloatArray:
        """One generation."""
        self._asked = self._strategy.ask()
        return np.clip(np.array(self._asked), 0.0, 1.0)  # rounding of the fold

    def tell(self, costs: FloatArray) -> None:
        """Update mean, step and covariance."""
        self._strategy.tell(self._asked, costs.tolist())

    def exhausted(self) -> bool:
        """By the library's own criteria: step, costs or covariance leave nothing to gain."""
        return bool(self._strategy.stop())


class Swarm:
    """A population algorithm of pymoo; of its start, only what is not known is asked for."""

    def __init__(self, make: Callable[..., Any], seed: Seed) -> None:
        from pymoo.core.population import Population
        from pymoo.core.problem import Problem

        k = seed.points.shape[1]
        self._problem = Problem(n_var=k, n_obj=1, xl=0.0, xu=1.0)
        start = Population.new(X=seed.points)
        self._algorithm = make(len(start), start)
        self._algorithm.setup(
            self._problem, seed=seed.random, termination=("n_gen", np.inf), verbose=False
        )
        self._asked: Any = self._algorithm.ask()
        self._costs = seed.costs.copy()
        self._unknown = np.flatnonzero(np.isnan(self._costs))
        self._best, self._idle = np.inf, 0
        if not self._unknown.size:
            self._advance()

    def ask(self) -> FloatArray:
        """One generation, or what is not known of the first."""
        if self._asked is None:
            self._asked = self._algorithm.ask()
            m = 0 if self._asked is None else len(self._asked)
            self._costs, self._unknown = np.full(m, np.nan), np.arange(m)
        if not self._unknown.size:
            return np.empty((0, self._problem.n_var))
        points: FloatArray = self._asked.get("X")[self._unknown]
        return np.clip(points, 0.0, 1.0)

    def tell(self, costs: FloatArray) -> None:
        """Select."""
        self._costs[self._unknown] = costs
        self._advance()

    def exhausted(self) -> bool:
        """The population has collapsed in place or in cost, or has long not improved."""
        if self._asked is not None:
            return not self._unknown.size
        x, f = self._algorithm.pop.get("X"), self._algorithm.pop.get("F")
        flat = np.ptp(f) <= 1e-12 * np.abs(f).max()
        return bool(np.ptp(x, axis=0).max() < COLLAPSED or flat or self._idle > IDLE_GENERATIONS)

    def _advance(self) -> None:
        from pymoo.core.evaluator import Evaluator
        from pymoo.problems.static import StaticProblem

        Evaluator().eval(StaticProblem(self._problem, F=self._costs[:, None]), self._asked)
        self._algorithm.tell(infills=self._asked)
        self._asked = None
        best = float(self._costs.min())
        self._idle = 0 if best < self._best else self._idle + 1
        self._best = min(self._best, best)


def _de(seed: Seed) -> Member:
    from pymoo.algorithms.soo.nonconvex.de import DE

    def make(size: int, start: Any) -> Any:
        return DE(size, sampling=start, variant="DE/rand/1/bin", CR=0.3, F=0.5)

    return Swarm(make, seed)


def _pso(seed: Seed) -> Member:
    from pymoo.algorithms.soo.nonconvex.pso import PSO

    return Swarm(lambda size, start: PSO(size, sampling=start), seed)


MEMBERS: dict[str, Callable[[Seed], Member]] = {"cma": Cma, "de": _de, "pso": _pso}
"""Name -> what makes it."""


def population_size(name: str, dimension: int) -> int:
    """Of a first start: the library's rule for CMA-ES, a multiple of the dimension for others."""
    if name == "cma":
        return max(SMALLEST_BATCH, 4 + int(3 * np.log(dimension)))
    return max(20, 3 * dimension)
