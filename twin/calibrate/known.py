"""What a least-squares fit with a prior tells of its parameters: `known`.

As in `answer.py`: A = J'J + P, covariance A^-1 (J' S J + P) A^-1, where S is estimated from what is
left of each part of the data, and from how many of its residuals tell as much as one.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from twin.calibrate.answer import SOME_OF_PRIOR, Answer, combinations, estimated
from twin.calibrate.parameters import Parameter
from twin.calibrate.polish import LeastSquares
from twin.correlation import correlation_time

FloatArray = npt.NDArray[np.float64]


def known(
    squares: LeastSquares, q: FloatArray, parameters: Sequence[Parameter], parts: Mapping[str, int],
    *, least: float,
) -> Answer:  # fmt: skip
    """At the least squares `q` (k,); `parts` names how many residuals come from what, in order.

    What follows them are those of the prior; what is hardly told is given its mean. `least` is the
    smallest mean square of residuals that is believed of a part, over what was expected: few of
    them may be small by chance.
    """
    residuals, slopes = squares.linearised(q)
    data = sum(parts.values())
    meat = slopes[data:].T @ slopes[data:]
    information = np.zeros_like(meat)
    correlated, first = {}, 0
    for name, size in parts.items():
        part = slice(first, first := first + size)
        own = slopes[part].T @ slopes[part]
        times = correlation_time(residuals[part])
        inflated = max(float(np.mean(residuals[part] ** 2)), least) * times
        correlated[name] = times
        meat = meat + own * inflated
        information += own / inflated
    bread = np.linalg.inv(slopes.T @ slopes)
    covariance = bread @ meat @ bread
    names, std = tuple(p.name for p in parameters), np.sqrt(np.diag(covariance))
    untold = std > SOME_OF_PRIOR
    stiff, sloppy = combinations(information, names)
    return Answer(
        estimates=estimated(parameters, np.where(untold, 0.0, q), std, np.ones(q.size), untold),
        derived=(),
        names=names,
        covariance=covariance,
        stiff=stiff,
        sloppy=sloppy,
        correlated_samples=correlated,
        held=(),
    )
