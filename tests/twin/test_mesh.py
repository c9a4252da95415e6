"""Quadrature, differentiation and conservation of the element chain."""

import casadi as ca
import numpy as np
import pytest

from twin.elimination import solve
from twin.mesh import Layer, lobatto
from twin.transport import weak_divergence


@pytest.mark.parametrize("order", [1, 2, 3, 5, 8])
def test_quadrature_is_exact_to_degree_2p_minus_1(order: int) -> None:
    x, w, _ = lobatto(order)
    for degree in range(2 * order):
        assert w @ x**degree == pytest.approx(1 / (degree + 1), rel=1e-13)


@pytest.mark.parametrize("order", [1, 2, 3, 5, 8])
def test_derivative_is_exact_to_degree_p(order: int) -> None:
    x, _, slope = lobatto(order)
    for degree in range(1, order + 1):
        assert slope @ x**degree == pytest.approx(degree * x ** (degree - 1), abs=1e-11)


@pytest.mark.parametrize("layer", [Layer((0.0, 1.0), (5,)), Layer((0.0, 0.3, 1.0), (3, 4))])
def test_integral_is_exact_to_degree_p(layer: Layer) -> None:
    for degree in range(4):
        expected = layer.x ** (degree + 1) / (degree + 1)
        assert layer.integral @ layer.x**degree == pytest.approx(expected, abs=1e-14)


def divergence(layer: Layer, nodal: np.ndarray, factor: np.ndarray) -> np.ndarray:
    u, k = ca.SX.sym("u", layer.size), ca.SX.sym("k", layer.size)
    function = ca.Function("f", [u, k], [weak_divergence(layer, k, ca.SX(2.0)) @ u])
    return function(nodal, factor).full().ravel()


def test_nothing_is_made_inside_a_layer() -> None:
    layer = Layer((0.0, 0.3, 1.0), (3, 4))
    rng = np.random.default_rng(3)
    rows = divergence(layer, rng.normal(size=layer.size), rng.uniform(0.1, 2, layer.size))
    assert abs(rows.sum()) < 1e-13 * np.abs(rows).sum()


def test_diffusion_with_a_source_converges_spectrally() -> None:
    """-u'' = pi^2 cos(pi x) on [0, 1] with no flux at the ends: u = cos(pi x)."""
    errors = []
    for order in (3, 5, 7):
        layer = Layer((0.0, 0.4, 1.0), (order, order))
        matrix = np.array(
            [2 * divergence(layer, e, np.ones(layer.size)) for e in np.eye(layer.size)]
        ).T
        source = layer.weight * np.pi**2 * np.cos(np.pi * layer.x)
        matrix[-1], source[-1] = np.eye(layer.size)[-1], -1.0
        errors.append(np.max(np.abs(np.linalg.solve(matrix, source) - np.cos(np.pi * layer.x))))
    assert errors[1] < errors[0] / 20
    assert errors[2] < errors[1] / 20


def test_mirrored_layer_is_the_same_from_the_other_side() -> None:
    layer = Layer((0.0, 0.3, 1.0), (3, 4))
    assert layer.mirrored().x == pytest.approx(1 - layer.x[::-1])
    assert layer.mirrored().weight == pytest.approx(layer.weight[::-1])


def test_elimination_solves_a_sparse_system_with_fill_in() -> None:
    rng = np.random.default_rng(5)
    dense = rng.normal(size=(12, 12)) * (rng.random((12, 12)) < 0.4) + 6 * np.eye(12)
    sparsity = ca.sparsify(ca.DM(dense)).sparsity()
    matrix, rhs = ca.SX.sym("A", sparsity), ca.SX.sym("b", 12)
    function = ca.Function("solve", [matrix, rhs], [solve(matrix, rhs)])
    b = rng.normal(size=12)
    got = function(ca.sparsify(ca.DM(dense)), b).full().ravel()
    assert got == pytest.approx(np.linalg.solve(dense, b), rel=1e-10)
