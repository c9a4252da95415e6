"""What numbers of a twin that are off do to its voltage, where its error is stated: `loss_ways`.

A resistance that is off follows the current. But exchange currents that are too low are one that
falls as the current grows, and diffusion one that comes late; both stay so for all of a recording,
and in gusts every sample has them. Who states one error of a twin does not say which of these it
is: the ways in which they can shape the voltage share it, none more than it usually varies.
"""

import numpy as np

from twin.mismatch.flight import Flight, FloatArray
from twin.mismatch.hypothesis import HYPOTHESES, value_of
from twin.mismatch.left import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate_all

LOSSES = (
    "electrolyte_transport", "reaction_kinetics", "series_resistance", "solid_diffusion_negative",
    "solid_diffusion_positive",
)  # fmt: skip
STEP = 0.01  # standard deviations of a prior


def loss_ways(pack: Pack, flight: Flight, most_V: float) -> FloatArray:
    """(n, k) k ways that do not depend on each other, each by one standard deviation [V].

    The principal components of what the numbers of LOSSES do, each as far as it usually varies.

    Args:
        pack: the twin.
        flight: n samples.
        most_V: of all together, rms over the samples that count; of any alone likewise.
    """
    wide = beyond_cut_offs(pack)
    as_is, *moved = (s.voltage_V for s in simulate_all([(p, flight.load) for p in _packs(wide)]))
    each_V = np.zeros((flight.time_s.size, len(moved)))
    for own_V, moved_V in zip(each_V.T, moved, strict=True):
        n = min(as_is.size, moved_V.size)
        own_V[:n] = (moved_V[:n] - as_is[:n]) / STEP
    counted_V = each_V[flight.judged]
    _, sizes, ways = np.linalg.svd(counted_V, full_matrices=False)
    rms_V = sizes / np.sqrt(max(counted_V.shape[0], 1))
    usual_V = np.minimum(rms_V, most_V)
    share = most_V / max(float(np.linalg.norm(usual_V)), most_V)
    return np.asarray(each_V @ ways.T * (share * usual_V / np.maximum(rms_V, 1e-300)))


def _packs(pack: Pack) -> list[Pack]:
    """As it is, and with each of the numbers of LOSSES a STEP off."""
    own = [(h, h.priors(pack)) for h in HYPOTHESES if h.id in LOSSES]
    return [pack] + [
        h.within(pack, [value_of(p, STEP * (p is moved)) for p in priors])
        for h, priors in own
        for moved in priors
    ]
