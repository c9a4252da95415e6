"""Landscapes with a known optimum at a place drawn at random: for the search and its tests."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Formula = Callable[[FloatArray], FloatArray]
"""(m, k) from the optimum in the usual units -> (m,) costs, 0 at the optimum."""


def sphere(z: FloatArray) -> FloatArray:
    """Even in all directions."""
    return np.asarray((z**2).sum(axis=1))


def ellipsoid(z: FloatArray) -> FloatArray:
    """A quadratic of condition 1e6."""
    return np.asarray((z**2 * 10.0 ** np.linspace(0, 6, z.shape[1])).sum(axis=1))


def rosenbrock(z: FloatArray) -> FloatArray:
    """A bent valley."""
    a, b = z[:, :-1] + 1, z[:, 1:] + 1
    return np.asarray((100 * (b - a**2) ** 2 + (1 - a) ** 2).sum(axis=1))


def rastrigin(z: FloatArray) -> FloatArray:
    """A bowl with a regular grid of minima."""
    return np.asarray((z**2 - 10 * np.cos(2 * np.pi * z) + 10).sum(axis=1))


def ackley(z: FloatArray) -> FloatArray:
    """A flat, rippled plane with a hole."""
    far = np.exp(-0.2 * np.sqrt((z**2).mean(axis=1)))
    near = np.exp(np.cos(2 * np.pi * z).mean(axis=1))
    return np.asarray(20 * (1 - far) + np.e - near)


def griewank(z: FloatArray) -> FloatArray:
    """A wide bowl with small ripples."""
    root = np.sqrt(np.arange(1, z.shape[1] + 1))
    return np.asarray((z**2).sum(axis=1) / 4000 - np.cos(z / root).prod(axis=1) + 1)


def schwefel(z: FloatArray) -> FloatArray:
    """Minima far apart; the second best far from the best, which lies in a corner."""
    x = z + 420.968746359982
    return np.asarray(418.98288727243374 * z.shape[1] - (x * np.sin(np.sqrt(abs(x)))).sum(axis=1))


@dataclass(frozen=True, slots=True)
class Landscape:
    """A formula over a box `width` wide; `turned` into random axes or not."""

    formula: Formula
    width: float
    turned: bool = False
    fixed: bool = False

    def at(self, dimension: int, seed: int) -> Formula:
        """(m, k) points of the unit box -> (m,) costs; optimum and axes are those of `seed`.

        The optimum is anywhere in the middle three fifths. That of a `fixed` formula stays in its
        corner, each coordinate mirrored at random.
        """
        random = np.random.default_rng([seed, dimension])
        place = random.uniform(0.2, 0.8, dimension)
        axes = np.linalg.qr(random.standard_normal((dimension, dimension)))[0]
        mirror = random.random(dimension) < 0.5

        def cost(points: FloatArray) -> FloatArray:
            if self.fixed:
                corner = (420.968746359982 + self.width / 2) / self.width
                return self.formula((np.where(mirror, 1 - points, points) - corner) * self.width)
            z = (points - place) * self.width
            return self.formula(z @ axes if self.turned else z)

        return cost


LANDSCAPES = {
    "sphere": Landscape(sphere, 10.0),
    "ellipsoid, turned": Landscape(ellipsoid, 10.0, turned=True),
    "rosenbrock": Landscape(rosenbrock, 4.0),
    "rastrigin": Landscape(rastrigin, 10.24),
    "rastrigin, turned": Landscape(rastrigin, 10.24, turned=True),
    "ackley, turned": Landscape(ackley, 64.0, turned=True),
    "griewank, turned": Landscape(griewank, 1200.0, turned=True),
    "schwefel": Landscape(schwefel, 1000.0, fixed=True),
}
"""Name -> landscape."""
