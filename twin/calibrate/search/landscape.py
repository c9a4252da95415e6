"""Which landscape the samples suggest, and which algorithm suits it.

Everything is computed from ranks of the costs: it does not change under any increasing function of
the cost, and a plateau of failed simulations weighs no more than its share of the samples.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import pdist, squareform
from scipy.stats import rankdata

FloatArray = npt.NDArray[np.float64]

ELITE_SHARE = 0.1  # of the samples, for the dispersion


@dataclass(frozen=True, slots=True, kw_only=True)
class Landscape:
    """Features of a landscape, each about 0 to 1.

    Attributes:
        bowl: adjusted R2 of a parabola in each coordinate: how well a separable quadratic explains
            the ranks.
        funnel: correlation of rank with the distance from the best sample (Jones and Forrest,
            Proc. ICGA 1995, 184); below 0 the landscape deceives.
        ruggedness: 1 minus the correlation of a sample's rank with that of its nearest neighbour.
        dispersion: mean distance among the best tenth over that among all (Lunacek and Whitley,
            GECCO 2006, 477); near 1 the good samples lie in separate basins.
    """

    bowl: float
    funnel: float
    ruggedness: float
    dispersion: float


def landscape(points: FloatArray, costs: FloatArray) -> Landscape:
    """Features from (n, k) samples spread over the box and their (n,) costs."""
    rank = rankdata(costs)
    if np.ptp(rank) == 0:  # a plateau tells nothing
        return Landscape(bowl=0.0, funnel=0.0, ruggedness=1.0, dispersion=1.0)
    rank = (rank - rank.mean()) / rank.std()
    distance = squareform(pdist(points))
    best = int(np.argmin(rank))
    elite = np.argsort(rank, kind="stable")[: max(4, int(ELITE_SHARE * rank.size))]
    among = float(pdist(points[elite]).mean()) / float(pdist(points).mean())
    np.fill_diagonal(distance, np.inf)
    neighbour = rank[np.argmin(distance, axis=1)]
    distance[best, best] = 0.0
    return Landscape(
        bowl=max(0.0, _explained(points, rank)),
        funnel=_correlation(distance[best], rank),
        ruggedness=1.0 - max(0.0, _correlation(neighbour, rank)),
        dispersion=min(1.0, among),
    )


def suitability(features: Landscape) -> dict[str, float]:
    """Member -> weight between 1 and 4, a first guess that the tests overrule.

    A covariance matrix learns bowls; a swarm follows a funnel; differences of a population keep
    far-apart basins alive. CMA-ES starts ahead: costs of a fit are long bent valleys. Weights are
    shares of the tests, so a wrong guess costs a factor, not the answer.
    """
    funnel = max(0.0, features.funnel)
    return {
        "cma": 2.0 + features.bowl + funnel,
        "de": 1.0 + features.dispersion + features.ruggedness * (1.0 - features.bowl),
        "pso": 1.0 + funnel * features.ruggedness,
    }


def _explained(points: FloatArray, rank: FloatArray) -> float:
    n, k = points.shape
    if n <= 2 * k + 2:
        return 0.0
    x = points - 0.5
    basis = np.hstack([np.ones((n, 1)), x, x**2])
    left: FloatArray = rank - basis @ np.linalg.lstsq(basis, rank, rcond=None)[0]
    return float(1.0 - (left @ left) / (n - 2 * k - 1) / ((rank @ rank) / (n - 1)))


def _correlation(a: FloatArray, b: FloatArray) -> float:
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / norm if norm > 0 else 0.0
