"""Lithium diffusion in a sphere, in its own eigenmodes.

The radial profile is a piecewise polynomial, finer towards the surface; the Galerkin form of the
diffusion equation in that space is diagonal in its eigenvectors, so each mode decays on its own and
a flux that runs straight over a step is integrated exactly. No radial unknown is left in Newton's
system: the surface stoichiometry after a step is `known - gain * flux`.

Sources: diffusion in the solid phase, Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993),
doi:10.1149/1.2221597; exponential integration, Hochbruck, Ostermann, Acta Numerica 19, 209 (2010),
doi:10.1017/S0962492910000048, phi functions of section 2.
"""

from functools import cache

import casadi as ca
import numpy as np
import numpy.typing as npt
import scipy.linalg
from numpy.polynomial import legendre

from twin.mesh import Layer, lobatto

FloatArray = npt.NDArray[np.float64]

SERIES_BELOW = 0.02  # 1 - phi loses digits as 1e-16 / z**2; five terms are exact to 1e-12 here


@cache
def sphere_modes(radial: Layer) -> tuple[FloatArray, FloatArray]:
    """Decay rates (m,) in D / R**2, slowest (0: the mean) first, and surface weights (m,).

    A mode's contribution s to the surface stoichiometry obeys
    ds/dt = -rate * D / R**2 * s - weight / R * flux / c_max, with the flux out of the sphere; the
    mean has weight 3. One mode per node of `radial` (centre at 0, surface at 1); exact integrals.
    """
    size = radial.size
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    for element, left, right in zip(
        radial.elements, radial.edges[:-1], radial.edges[1:], strict=True
    ):
        order = len(element.nodes) - 1
        x, w = legendre.leggauss(order + 2)  # exact for r**2 times the square of an element's basis
        to_legendre = np.linalg.inv(legendre.legvander(2 * lobatto(order)[0] - 1, order))
        value = legendre.legvander(x, order) @ to_legendre
        slope = np.column_stack([legendre.legval(x, legendre.legder(c)) for c in to_legendre.T])
        half = (right - left) / 2
        shell = w * (left + half * (x + 1)) ** 2
        block = np.ix_(element.nodes, element.nodes)
        mass[block] += half * value.T @ (value * shell[:, None])
        stiffness[block] += slope.T @ (slope * shell[:, None]) / half
    rate, vector = scipy.linalg.eigh(stiffness, mass)
    rate[0] = 0.0
    weight = vector[-1] ** 2
    weight[0] = 3.0
    return rate, weight


def phi_functions(z: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """exp(-z), phi1 = (1 - exp(-z)) / z and phi2 = (1 - phi1) / z, accurate down to z = 0."""
    decay = ca.exp(-z)
    small = z < SERIES_BELOW
    safe = ca.if_else(small, 1.0, z)
    phi2_series = 1 / 2 - z * (1 / 6 - z * (1 / 24 - z * (1 / 120 - z / 720)))
    phi2 = ca.if_else(small, phi2_series, (safe - 1 + decay) / safe**2)
    return decay, 1 - z * phi2, phi2


def advance(
    modes: ca.SX, flux: ca.SX, fourier: ca.SX, step_s: ca.SX, radial: Layer
) -> tuple[ca.SX, ca.SX]:
    """One step of all modes under a flux that runs straight from `flux` to an unknown end value.

    Args:
        modes: (nodes, count) contributions to the surface stoichiometry.
        flux: (nodes,) at the start, out of the sphere, as stoichiometry: j / (F c_max R) [1/s].
        fourier: (1,) or (nodes,) D h / R**2.
        step_s: h.
        radial: the mesh of the sphere.

    Returns:
        (nodes, count) modes after the step for an end flux of 0, and (1 or nodes, count) what each
        mode loses per end flux.
    """
    nodes, count = modes.shape
    rate, weight = sphere_modes(radial)
    decay, phi1, phi2 = phi_functions(ca.SX(fourier) @ ca.DM(rate).T)
    weights = ca.repmat(ca.DM(weight).T, fourier.shape[0], 1)
    gain = step_s * weights * phi2
    start = step_s * weights * (phi1 - phi2)
    if fourier.shape[0] == 1:
        decay, start = ca.repmat(decay, nodes, 1), ca.repmat(start, nodes, 1)
    known = decay * modes - start * ca.repmat(flux, 1, count)
    return known, gain
