"""Where members start: on the samples, from what all have found, or somewhere new."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from twin.calibrate.search.members import COLLAPSED, Seed, population_size

FloatArray = npt.NDArray[np.float64]

WIDEST = 0.25  # standard deviation of CMA-ES that has the whole box before it
NARROWEST = 0.003
LARGEST = 16  # times the first size of a population
BASINS = 5  # the best of those found so far are what new starts look at


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """What the search knows when a member starts.

    Attributes:
        elite: (m, k) best of the points met lately, best first.
        costs: (m,) theirs.
        basins: (b, k) where members ended, best first, 1 or more; the first is the best of all.
    """

    elite: FloatArray
    costs: FloatArray
    basins: FloatArray


def spread_out(count: int, dimension: int, random: np.random.Generator) -> FloatArray:
    """(count, dimension) Latin hypercube."""
    return np.asarray(qmc.LatinHypercube(dimension, rng=random).random(count))


def from_shared(name: str, found: Found, random: np.random.Generator) -> Seed | None:
    """A start from the best points met lately; None if they have collapsed.

    CMA-ES takes the best and the spread of all; a population takes them as they are, and where they
    are fewer than it needs, normal samples of their covariance.
    """
    points, costs = found.elite, found.costs
    k = points.shape[1]
    deviation = points.std(axis=0)
    if deviation.max() < 10 * COLLAPSED:
        return None
    size = population_size(name, k)
    if name != "cma" and len(points) < size:
        more = _around(points, size - len(points), random)
        points = np.vstack([points, more])
        costs = np.append(costs, np.full(len(more), np.nan))
    spread = np.clip(deviation, deviation.max() * 1e-3, WIDEST)
    return _seed(points[:size], costs[:size], spread, size, random)


def anew(name: str, found: Found, restarts: int, random: np.random.Generator) -> Seed:
    """A start after `restarts` exhausted ones, away from where they ended.

    CMA-ES alternates between the whole box with a doubled population (Auger and Hansen, CEC 2005,
    1769) and the surroundings of the best with a step drawn at random (Hansen, GECCO 2009, 2389).
    A population grows by half: half of it covers the box, a quarter lies between the centre and the
    opposite of the basins (Rahnamayan et al., CEC 2007, 2229), a quarter around them.
    """
    k = found.basins.shape[1]
    base = population_size(name, k)
    if name == "cma":
        if restarts % 2:
            step = WIDEST * (NARROWEST / WIDEST) ** random.random()
            centre = _folded(found.basins[:1] + step * random.standard_normal((1, k)))
            return _seed(centre, np.array([np.nan]), np.full(k, step), base, random)
        size = base * min(LARGEST, 2 ** (restarts // 2))
        return _seed(random.random((1, k)), np.array([np.nan]), np.full(k, WIDEST), size, random)
    size = int(base * min(LARGEST, 1.5**restarts))
    basins = found.basins[random.integers(min(BASINS, len(found.basins)), size=size // 2)]
    opposite, near = np.array_split(basins, 2)
    opposite = 0.5 + (0.5 - opposite) * random.random(opposite.shape)
    near = _folded(near + 0.1 * random.standard_normal(near.shape))
    points = np.vstack([spread_out(size - size // 2, k, random), opposite, near])
    return _seed(points, np.full(size, np.nan), np.full(k, WIDEST), size, random)


def _seed(
    points: FloatArray, costs: FloatArray, spread: FloatArray, size: int,
    random: np.random.Generator,
) -> Seed:  # fmt: skip
    return Seed(
        points=points, costs=costs, spread=spread, size=size, random=int(random.integers(2**31))
    )


def _around(points: FloatArray, count: int, random: np.random.Generator) -> FloatArray:
    """Normal samples with the mean and covariance of `points`: sums of their deviations."""
    mean = points.mean(axis=0)
    weights = random.standard_normal((count, len(points))) / np.sqrt(len(points))
    return _folded(mean + weights @ (points - mean))


def _folded(points: FloatArray) -> FloatArray:
    """Reflected into the box."""
    inside = np.abs(points) % 2.0
    return np.where(inside > 1.0, 2.0 - inside, inside)
