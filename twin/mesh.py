"""Legendre-Gauss-Lobatto elements across negative electrode, separator and positive electrode.

Nodes are the quadrature points of their elements (spectral elements, mass lumped), so reactions
stay local to a node and a balance summed over all nodes telescopes to its boundary terms exactly.
Order 1 is the vertex-centred finite-volume scheme. Source: Canuto, Hussaini, Quarteroni, Zang,
Spectral Methods: Fundamentals in Single Domains (Springer 2006), sections 2.3 and 3.8.
"""

from dataclasses import dataclass, field
from functools import cache

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

FloatArray = npt.NDArray[np.float64]


@cache
def lobatto(order: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes (p + 1,), weights (p + 1,) summing to 1 and derivative matrix on [0, 1]; order p."""
    coefficients = np.zeros(order + 1)
    coefficients[-1] = 1.0
    inner = legendre.legroots(legendre.legder(coefficients)).real
    x = np.concatenate([[-1.0], np.sort(inner), [1.0]])
    value = legendre.legval(x, coefficients)
    weight = 2.0 / (order * (order + 1) * value**2)
    gap = x[:, None] - x[None, :] + np.eye(order + 1)
    slope = value[:, None] / value[None, :] / gap
    np.fill_diagonal(slope, 0.0)
    np.fill_diagonal(slope, -slope.sum(axis=1))  # a constant has no slope, to rounding
    return (x + 1) / 2, weight / 2, 2 * slope


@cache
def antiderivative(order: int) -> FloatArray:
    """(p + 1, p + 1) integral over [0, node] of what is interpolated at the nodes of [0, 1]."""
    x, _, _ = lobatto(order)
    to_legendre = np.linalg.inv(legendre.legvander(2 * x - 1, order))
    rows = [legendre.legval(2 * x - 1, legendre.legint(c, lbnd=-1)) / 2 for c in to_legendre.T]
    return np.array(rows).T


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """One element: its nodes in the domain, its quadrature weights and its derivative matrix."""

    nodes: tuple[int, ...]
    weight: FloatArray
    slope: FloatArray


@dataclass(frozen=True, slots=True)
class Layer:
    """A domain of unit length, cut into elements.

    Attributes:
        edges: ends of the elements, from 0 to 1, left to right.
        orders: polynomial order of each element.
        x: (n,) nodes.
        weight: (n,) of quadrature; their sum is 1.
        integral: (n, n) integral from 0 to each node of what is given at all nodes.
    """

    edges: tuple[float, ...]
    orders: tuple[int, ...]
    elements: tuple[Element, ...] = field(init=False, repr=False, compare=False)
    x: FloatArray = field(init=False, repr=False, compare=False)
    weight: FloatArray = field(init=False, repr=False, compare=False)
    integral: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        n = sum(self.orders) + 1
        x, weight, elements, first = np.zeros(n), np.zeros(n), [], 0
        integral = np.zeros((n, n))
        for left, right, order in zip(self.edges[:-1], self.edges[1:], self.orders, strict=True):
            node, w, slope = lobatto(order)
            length = right - left
            span = slice(first, first + order + 1)
            x[span] = left + length * node
            weight[span] += length * w
            nodes = tuple(range(first, first + order + 1))
            elements.append(Element(nodes, length * w, slope / length))
            integral[span, span] += length * antiderivative(order)
            integral[first + order + 1 :, span] += length * w
            first += order
        object.__setattr__(self, "elements", tuple(elements))
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "weight", weight)
        object.__setattr__(self, "integral", integral)

    @property
    def size(self) -> int:
        """Number of nodes, both ends included."""
        return int(self.x.size)

    def mirrored(self) -> "Layer":
        """The same layer seen from the other side."""
        return Layer(tuple(1.0 - e for e in reversed(self.edges)), self.orders[::-1])


SPHERE = Layer((0.0, 0.85, 0.98, 1.0), (4, 4, 4))
"""Surface response to a step of flux right to 0.8 % from t = 1e-5 R**2 / D on and to 0.05 % from
1e-3 on (tests/twin/test_particle.py); 0.1 s is 1.5e-5 for the slowest particle here (LG M50)."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """The three layers and the sphere.

    Attributes:
        negative: from current collector to separator.
        separator: from negative to positive; order 2 or more (its middle grounds the potential).
        positive: from separator to current collector.
        sphere: of the particles, from centre to surface.
    """

    negative: Layer
    separator: Layer
    positive: Layer
    sphere: Layer = SPHERE


def electrode_mesh(edges: tuple[float, ...], orders: tuple[int, ...]) -> Mesh:
    """Electrodes cut alike at `edges`: 0 at the collector, 1 at the separator."""
    layer = Layer(edges, orders)
    return Mesh(layer, Layer((0.0, 1.0), (2,)), layer.mirrored())
