"""Probabilities of models none of which is quite true: averaged over recordings as they might be.

A calibrated twin errs by more than noise, and where it does decides between models that leave as
much: evidence grows with every sample and is sure of one of them, of another day it would be as
sure of the other. Bagged, evidence is that of recordings drawn anew from their stretches, as long
as the twin's error remembers, and a model's probability is its mean over the draws. What wins in
every stretch stays as sure as it was; what wins in one alone does not, be it a flight of minutes.

Sources: J. H. Huggins, J. W. Miller, Reproducible model selection using bagged posteriors, Bayesian
Analysis 18, 79 (2023); of stretches instead of samples H. R. Kuensch, The jackknife and the
bootstrap for general stationary observations, Ann. Stat. 17, 1217 (1989).
"""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
from scipy.special import logsumexp

FloatArray = npt.NDArray[np.float64]

DRAWS = 4000  # a probability of 5 % is known to 0.4


def bagged(logs: FloatArray, recordings: Iterable[FloatArray]) -> FloatArray:
    """(m,) logarithms of the mean probabilities of m models.

    The draws are the same each time: a verdict can be repeated.

    Args:
        logs: (m,) evidence of each, with what was believed before.
        recordings: of each, (m, b) logarithms of its likelihood in b stretches of one recording,
            at its best numbers.
    """
    own = np.hstack(list(recordings))
    b = own.shape[1]
    times = np.random.default_rng(0).multinomial(b, np.full(b, 1.0 / b), size=DRAWS)
    drawn = logs[:, None] + own @ (times.T - 1.0)
    shares = drawn - logsumexp(drawn, axis=0)
    return np.asarray(logsumexp(shares, axis=1) - np.log(shares.shape[1]))


def stretches(at_s: FloatArray, length_s: float) -> npt.NDArray[np.int64]:
    """(n,) in which each time lies, from 0, of equal stretches that are about so long.

    Where no time lies is none.
    """
    if not at_s.size:
        return np.zeros(0, dtype=np.int64)
    count = max(1, round(float(np.ptp(at_s)) / length_s))
    edges_s = np.linspace(at_s.min(), at_s.max(), count + 1)[1:-1]
    place = np.searchsorted(edges_s, at_s, side="right")
    return np.asarray(np.unique(place, return_inverse=True)[1], dtype=np.int64)
