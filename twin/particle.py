"""Lithium diffusion in a sphere, in its own eigenmodes.

The radial profile is a piecewise polynomial, finer towards the surface; the Galerkin form of the
diffusion equation in that space is diagonal in its eigenvectors, so each mode decays on its own and
a flux that runs straight over a step is integrated exactly. No radial unknown is left in Newton's
system: the surface stoichiometry after a step is `known - gain * flux`.

Sources: diffusion in the solid phase, Doyle, Fuller, Newman, J. Electrochem. Soc. 140, 1526 (1993),
doi:10.1149/1.2221597; exponential integration, Hochbruck, Ostermann, Acta Numerica 19, 209 (2010),
doi:10.1017/S0962492910000048, phi functions of section 2.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, reduce

import casadi as ca
import numpy as np
import numpy.typing as npt
import scipy.linalg
from numpy.polynomial import legendre

from twin.mesh import Layer, lobatto

FloatArray = npt.NDArray[np.float64]

EXACT = 2  # points of a quadrature beyond the order: r**2 times the square of an element's basis
COUPLED = 0  # where a diffusivity varies: by EXACT a flight is 0.006 mV nearer, half as much code
COVERED = 0.6  # of the largest diffusivity along a radius, by what the modes decay at least
SERIES_BELOW = 0.02  # 1 - phi loses digits as 1e-16 / z**2; five terms are exact to 1e-12 here


@cache
def sphere_modes(radial: Layer) -> tuple[FloatArray, FloatArray]:
    """Decay rates (m,) in D / R**2, slowest (0: the mean) first, and surface weights (m,).

    A mode's contribution s to the surface stoichiometry obeys
    ds/dt = -rate * D / R**2 * s - weight / R * flux / c_max, with the flux out of the sphere; the
    mean has weight 3. One mode per node of `radial` (centre at 0, surface at 1); exact integrals.
    """
    rate, vector = _eigen(radial)
    weight = vector[-1] ** 2
    rate[0], weight[0] = 0.0, 3.0
    return rate, weight


@dataclass(frozen=True, slots=True, eq=False)
class _Element:
    """One of `radial`: its `nodes`, their polynomials (q, nodes) and slopes by its own coordinate.

    `half` is half of its width, `shell` (q,) the weights of the quadrature times r**2.
    """

    nodes: Sequence[int]
    value: FloatArray
    slope: FloatArray
    half: float
    shell: FloatArray


def _elements(radial: Layer, beyond: int) -> Iterator[_Element]:
    for element, left, right in zip(
        radial.elements, radial.edges[:-1], radial.edges[1:], strict=True
    ):
        order = len(element.nodes) - 1
        x, w = legendre.leggauss(order + beyond)
        to_legendre = np.linalg.inv(legendre.legvander(2 * lobatto(order)[0] - 1, order))
        half = (right - left) / 2
        yield _Element(
            nodes=list(element.nodes),
            value=legendre.legvander(x, order) @ to_legendre,
            slope=np.column_stack([legendre.legval(x, legendre.legder(c)) for c in to_legendre.T]),
            half=half,
            shell=w * (left + half * (x + 1)) ** 2,
        )


def _eigen(radial: Layer) -> tuple[FloatArray, FloatArray]:
    """Decay rates (m,) and, in columns, values at the nodes (m, m)."""
    size = radial.size
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    for e in _elements(radial, EXACT):
        block = np.ix_(e.nodes, e.nodes)
        mass[block] += e.half * e.value.T @ (e.value * e.shell[:, None])
        stiffness[block] += e.slope.T @ (e.slope * e.shell[:, None]) / e.half
    rate, vector = scipy.linalg.eigh(stiffness, mass)
    return rate, vector


@dataclass(frozen=True, slots=True, eq=False)
class Inside:
    """Modes along the radius, each by its contribution to the surface.

    Attributes:
        value: (q, m) stoichiometry at the places of a quadrature, per stoichiometry at the surface.
        slope: (q, m) of it by r / R.
        back: (q, m) what a product of a diffusivity and a slope there adds to each mode's decay.
    """

    value: FloatArray
    slope: FloatArray
    back: FloatArray


@cache
def inside(radial: Layer) -> Inside:
    """Of `sphere_modes`: slope.T @ back has their decay rates, but for the quadrature."""
    _, vector = _eigen(radial)
    parts = list(_elements(radial, COUPLED))
    value = np.vstack([p.value @ vector[p.nodes] for p in parts])
    slope = np.vstack([p.slope @ vector[p.nodes] / p.half for p in parts])
    shell = np.concatenate([p.half * p.shell for p in parts])
    surface = vector[-1]
    return Inside(value / surface, slope / surface, shell[:, None] * slope * surface)


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


def advance_uneven(  # noqa: PLR0913
    modes: ca.SX, flux: ca.SX, diffusivity: Callable[[ca.SX], ca.SX], step_s: ca.SX,
    per_diffusivity: ca.SX, radial: Layer,
) -> tuple[ca.SX, ca.SX]:  # fmt: skip
    """`advance` where the diffusivity changes along the radius, with the stoichiometry there.

    The modes decay by one diffusivity a particle, exactly; what others along its radius add couples
    them, and is taken as in the middle of the step, to second order. That one is the diffusivity
    under the surface, but COVERED of the largest at least: twice as large ones make the coupling,
    taken explicitly, grow in long steps. An exponential midpoint rule: Hochbruck, Ostermann (2010),
    section 2.

    Args:
        modes: as in `advance`.
        flux: as there [1/s].
        diffusivity: of stoichiometries (k,) -> (k,) [m2/s].
        step_s: h.
        per_diffusivity: h / R**2 [s/m2], with what warmth makes of it.
        radial: the mesh of the sphere.

    Returns:
        (nodes, count) each, as in `advance`.
    """
    count = modes.shape[1]
    at_start = _along(modes, diffusivity, radial)
    one = ca.fmax(at_start.diffusivity[:, -1], COVERED * _largest(at_start.diffusivity))
    whole, half = (ca.SX(one * per_diffusivity * share) for share in (1.0, 0.5))
    rate, weight = sphere_modes(radial)
    decay, phi1, _ = phi_functions(half @ ca.DM(rate).T)
    drawn = ca.repmat(flux, 1, count) * ca.repmat(ca.DM(weight).T, flux.shape[0], 1) * step_s
    coupled = at_start.coupled(one, radial) * per_diffusivity
    middle = _along(decay * modes + phi1 * (coupled - drawn) / 2, diffusivity, radial)
    known, gain = advance(modes, flux, whole, step_s, radial)
    coupled = middle.coupled(one, radial) * per_diffusivity
    return known + phi1 * (1 + decay) / 2 * coupled, gain  # phi1 of the whole step, by its half


@dataclass(frozen=True, slots=True, eq=False)
class _Along:
    """The radius at the places of `inside`: (nodes, q) diffusivity, and slope by r / R."""

    diffusivity: ca.SX
    slope: ca.SX

    def coupled(self, one: ca.SX, radial: Layer) -> ca.SX:
        """(nodes, m) by which modes change per R**2 / D of time, beside their decay by `one`."""
        beyond = self.diffusivity - ca.repmat(one, 1, self.slope.shape[1])
        return -(beyond * self.slope) @ ca.DM(inside(radial).back)


def _along(modes: ca.SX, diffusivity: Callable[[ca.SX], ca.SX], radial: Layer) -> _Along:
    own = inside(radial)
    x = ca.fmin(ca.fmax(modes @ ca.DM(own.value).T, 0.0), 1.0)
    return _Along(ca.reshape(diffusivity(ca.vec(x)), *x.shape), modes @ ca.DM(own.slope).T)


def _largest(of: ca.SX) -> ca.SX:
    """(nodes,) of each row."""
    return reduce(ca.fmax, ca.horzsplit(of))
