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


def cigar(z: FloatArray) -> FloatArray:
    """A straight, narrow valley: one direction a thousand times longer than the others."""
    return np.asarray(z[:, 0] ** 2 + 1e6 * (z[:, 1:] ** 2).sum(axis=1))


def powers(z: FloatArray) -> FloatArray:
    """Ever flatter towards the optimum, in some directions more than in others."""
    return np.asarray((abs(z) ** np.linspace(2, 6, z.shape[1])).sum(axis=1))


def levy(z: FloatArray) -> FloatArray:
    """A bowl with ripples that grow outwards."""
    w = 1 + z / 4
    first, last = np.sin(np.pi * w[:, 0]) ** 2, (w[:, -1] - 1) ** 2
    ripples = (w[:, :-1] - 1) ** 2 * (1 + 10 * np.sin(np.pi * w[:, :-1] + 1) ** 2)
    return np.asarray(first + ripples.sum(axis=1) + last * (1 + np.sin(2 * np.pi * w[:, -1]) ** 2))


def styblinski(z: FloatArray) -> FloatArray:
    """Two minima in each coordinate, one of them the better."""
    x = z - 2.903534027771177
    return np.asarray((x**4 - 16 * x**2 + 5 * x).sum(axis=1) / 2 + 39.16616570377142 * z.shape[1])


def funnels(z: FloatArray) -> FloatArray:
    """Two bowls, the wider one without the optimum."""
    other = z.shape[1] + 0.7 * ((z - 4) ** 2).sum(axis=1)
    return np.asarray(np.minimum((z**2).sum(axis=1), other))


def steps(z: FloatArray) -> FloatArray:
    """An ellipsoid of plateaus."""
    return np.asarray((np.round(z) ** 2 * 10.0 ** np.linspace(0, 2, z.shape[1])).sum(axis=1))


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
    "levy, turned": Landscape(levy, 20.0, turned=True),
}
"""Name -> landscape: those the rules of the search were developed on."""
HELD_OUT = {
    "cigar, turned": Landscape(cigar, 10.0, turned=True),
    "powers, turned": Landscape(powers, 10.0, turned=True),
    "styblinski": Landscape(styblinski, 12.0),
    "two funnels, turned": Landscape(funnels, 12.0, turned=True),
    "steps, turned": Landscape(steps, 20.0, turned=True),
}
"""Those on which it is reported: nothing was chosen by them."""
