"""How well recordings tell the numbers of a model: `uncertainty`.

A twin has numbers that are known within errors: what reference tests leave open of diffusion, salt
and kinetics, what a calibrated instrument may be off by (`Pack.standard_errors`). The recordings
are fitted with these as stated, so that no more effects are named than needed; but a cold pack and
slow kinetics look much alike, and how cold it was is known no better than the kinetics are, or what
they do by temperature. So in the error of a size they are free within their own errors: the normal
posterior of all together, marginal in those that are not asked for (D. J. C. MacKay, Information
Theory, Inference, and Learning Algorithms (2003), chapter 27).

An error that is stated of a twin is the same in all its recordings: several tell no more of a size
than one of them does on average.
"""

import numpy as np
import numpy.typing as npt

from twin.mismatch.fit import Fitted
from twin.mismatch.hypothesis import UNCERTAIN

FloatArray = npt.NDArray[np.float64]


def uncertainty(fitted: Fitted, scale: float) -> FloatArray:
    """(k, k) covariance of the coordinates of a model, in deviations of the prior.

    Args:
        fitted: the model.
        scale: by which variances exceed what was expected.
    """
    if fitted.problem.heavy_tailed:
        scale *= len(fitted.problem.flights)
    pack = fitted.problem.flights[0].pack
    known = pack.standard_errors.keys() - set(fitted.ids)
    uncertain = [h for h in UNCERTAIN if h.id in known and h.possible(pack)]
    if not uncertain:
        return fitted.covariance(scale)
    wider, q = fitted.problem.beside(uncertain, fitted.q)
    slopes = wider.evidence(q).slopes
    covariance = np.linalg.inv(np.eye(q.size) + slopes.T @ slopes / scale)
    flights = len(fitted.problem.flights)
    own = np.r_[: fitted.q.size - flights, q.size - flights : q.size]
    return np.asarray(covariance[np.ix_(own, own)])
