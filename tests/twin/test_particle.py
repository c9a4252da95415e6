"""Diffusion in a sphere against its exact solutions (Crank, The Mathematics of Diffusion, 6.3)."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
import scipy.sparse

from twin.mesh import SPHERE, Layer
from twin.particle import advance, advance_uneven, phi_functions, sphere_modes


def exact_surface(tau: np.ndarray) -> np.ndarray:
    """Surface response to a unit flux from tau = 0 on: 3 tau + 1/5 - 2 sum exp(-l^2 tau) / l^2."""
    roots = [
        scipy.optimize.brentq(
            lambda x: np.sin(x) - x * np.cos(x), n * np.pi + 1e-9, (n + 0.5) * np.pi
        )
        for n in range(1, 3000)
    ]
    squares = np.array(roots) ** 2
    tail = 1 / 5 - 2 * np.sum(1 / squares)  # roots left out: all decayed at the times asked for
    series = np.exp(-np.outer(tau, squares)) @ (2 / squares)
    return 3 * tau + 1 / 5 - series - tail * np.exp(-tau * squares[-1])


def galerkin_surface(tau: np.ndarray, sphere: Layer) -> np.ndarray:
    rate, weight = sphere_modes(sphere)
    return weight[0] * tau - np.expm1(-np.outer(tau, rate[1:])) @ (weight[1:] / rate[1:])


def test_surface_follows_a_step_of_flux_as_the_exact_solution_does() -> None:
    early, late = np.logspace(-5, -3, 30), np.logspace(-3, 0, 30)
    for tau, tolerance in ((early, 8e-3), (late, 5e-4)):  # as twin/mesh.py says of SPHERE
        error = galerkin_surface(tau, SPHERE) / exact_surface(tau) - 1
        assert np.max(np.abs(error)) < tolerance


def test_finer_sphere_converges_spectrally() -> None:
    tau = np.logspace(-3, 0, 20)
    errors = []
    for order in (2, 4, 6):
        sphere = Layer((0.0, 0.85, 0.98, 1.0), (order,) * 3)
        errors.append(np.max(np.abs(galerkin_surface(tau, sphere) / exact_surface(tau) - 1)))
    assert errors[1] < errors[0] / 15
    assert errors[2] < errors[1] / 15


def test_steady_flux_ends_in_the_parabola() -> None:
    rate, weight = sphere_modes(SPHERE)
    assert np.sum(weight[1:] / rate[1:]) == pytest.approx(1 / 5, rel=1e-10)


@pytest.mark.parametrize("z", [0.0, 1e-9, 1e-4, 0.0199, 0.0201, 1.0, 50.0, 1e4])
def test_phi_functions_are_accurate_on_both_sides_of_the_switch(z: float) -> None:
    symbol = ca.SX.sym("z")
    got = [float(v) for v in ca.Function("phi", [symbol], list(phi_functions(symbol)))(z)]
    if z < 0.1:
        k = np.arange(12)
        factorial = np.cumprod(np.maximum(k, 1))
        phi1 = np.sum((-z) ** k / (factorial * (k + 1)))
        phi2 = np.sum((-z) ** k / (factorial * (k + 1) * (k + 2)))
    else:
        phi1 = -np.expm1(-z) / z
        phi2 = (1 - phi1) / z
    assert got == pytest.approx([np.exp(-z), phi1, phi2], rel=2e-12, abs=1e-300)


def surface_after(steps: int, flux_of: ca.Function) -> float:
    """Surface stoichiometry at tau = 0.1 under a flux over time, in `steps` steps."""
    size, h = SPHERE.size, 0.1 / steps
    modes, flux, end = ca.SX.sym("q", 1, size), ca.SX.sym("j"), ca.SX.sym("e")
    known, loss = advance(modes, flux, ca.SX(h), ca.SX(h), SPHERE)
    step = ca.Function("step", [modes, flux, end], [known - loss * end])
    state = np.zeros((1, size))
    for k in range(steps):
        state = step(state, flux_of(k * h), flux_of((k + 1) * h)).full()
    return float(state.sum())


def test_a_flux_that_runs_straight_is_exact_in_any_number_of_steps() -> None:
    t = ca.SX.sym("t")
    ramp = ca.Function("ramp", [t], [1 + 30 * t])
    assert surface_after(1, ramp) == pytest.approx(surface_after(64, ramp), rel=1e-11)


def test_a_curved_flux_converges_with_second_order() -> None:
    t = ca.SX.sym("t")
    wave = ca.Function("wave", [t], [ca.sin(40 * t)])
    fine = surface_after(4096, wave)
    steps = np.array([16, 32, 64, 128])
    errors = [abs(surface_after(int(n), wave) - fine) for n in steps]
    slope, _ = np.polyfit(np.log(steps), np.log(errors), 1)
    assert slope == pytest.approx(-2.0, abs=0.1)


def test_what_leaves_through_the_surface_is_what_the_sphere_loses() -> None:
    size = SPHERE.size
    modes, flux, end = ca.SX.sym("q", 1, size), ca.SX.sym("j"), ca.SX.sym("e")
    known, loss = advance(modes, flux, ca.SX(0.3), ca.SX(0.7), SPHERE)
    step = ca.Function("step", [modes, flux, end], [known - loss * end])
    after = step(np.zeros((1, size)), 2.0, 5.0).full()
    assert after[0, 0] == pytest.approx(-3 * 0.7 * (2 + 5) / 2, rel=1e-14)


def uneven(x: ca.SX) -> ca.SX:
    """Fifty times as fast empty as full, and slowest between."""
    return ca.exp(4.0 * (0.5 - x)) * (0.2 + 8.0 * (x - 0.6) ** 2)


def by_modes(steps: int, diffusivity: Callable[[ca.SX], ca.SX] | None) -> np.ndarray:
    """(2,) mean and surface at tau = 0.2 by `diffusivity`, 1 if None, under a flux that comes and
    goes; from a sphere that is full to 0.9."""
    size, h = SPHERE.size, 0.2 / steps
    modes, flux, end = ca.SX.sym("q", 1, size), ca.SX.sym("j"), ca.SX.sym("e")
    if diffusivity is None:
        known, loss = advance(modes, flux, ca.SX(h), ca.SX(h), SPHERE)
    else:
        known, loss = advance_uneven(modes, flux, diffusivity, ca.SX(h), ca.SX(h), SPHERE)
    step = ca.Function("step", [modes, flux, end], [known - loss * end])
    state = np.zeros((1, size))
    state[0, 0] = 0.9
    for k in range(steps):
        state = step(state, pulsed(k * h), pulsed((k + 1) * h)).full()
    return np.array([state[0, 0], state.sum()])


def pulsed(tau: float) -> float:
    return float(0.6 * np.sin(np.pi * tau / 0.1) ** 2)


def by_volumes(cells: int) -> np.ndarray:
    """The same by finite volumes that are thin at the surface, in time as fine as can be."""
    edges = 1 - (1 - np.linspace(0.0, 1.0, cells + 1)) ** 2
    centre, volume = (edges[1:] + edges[:-1]) / 2, np.diff(edges**3) / 3
    x = ca.SX.sym("x")
    of = ca.Function("D", [x], [uneven(x)]).map(cells)

    def slope(tau: float, state: np.ndarray) -> np.ndarray:
        d = of(state).full()[0]
        between = 2 * d[1:] * d[:-1] / (d[1:] + d[:-1]) * np.diff(state) / np.diff(centre)
        flow = np.concatenate([[0.0], edges[1:-1] ** 2 * between, [-pulsed(tau)]])
        return np.diff(flow) / volume

    done = scipy.integrate.solve_ivp(
        slope, (0.0, 0.2), np.full(cells, 0.9), method="BDF", rtol=1e-8, atol=1e-10, max_step=2e-3,
        jac_sparsity=scipy.sparse.diags([np.ones(cells)] * 3, [-1, 0, 1], (cells, cells)),
    )  # fmt: skip
    assert done.success
    last = done.y[:, -1]
    d = float(of(last).full()[0, -1])
    return np.array([3 * volume @ last, last[-1] - pulsed(0.2) / d * (1 - centre[-1])])


def test_a_diffusivity_that_changes_along_the_radius_is_resolved() -> None:
    """As by finite volumes; of second order in the step."""
    coarse, fine = by_volumes(100), by_volumes(200)
    true, converged = fine + (fine - coarse) / 3, by_modes(2560, uneven)
    assert converged == pytest.approx(true, abs=8e-4)  # of 0.38 that the surface falls
    errors = [abs(by_modes(steps, uneven)[1] - converged[1]) for steps in (40, 80, 160)]
    assert errors[0] > 3.5 * errors[1] > 3.5**2 * errors[2]
    drawn = 3 * scipy.integrate.quad(pulsed, 0.0, 0.2)[0]
    assert by_modes(160, uneven)[0] == pytest.approx(0.9 - drawn, abs=1e-4)
    assert true[0] == pytest.approx(0.9 - drawn, abs=1e-6)


def test_a_diffusivity_that_is_the_same_everywhere_couples_nothing() -> None:
    alike = by_modes(20, lambda x: 0 * x + 1.0)
    assert alike == pytest.approx(by_modes(20, None), abs=1e-12)


def test_long_steps_of_an_uneven_diffusivity_do_not_grow() -> None:
    size = SPHERE.size
    modes, h = ca.SX.sym("q", 1, size), ca.SX(10.0)
    known, _ = advance_uneven(modes, ca.SX(0.0), uneven, h, h, SPHERE)
    step = ca.Function("step", [modes], [known])
    state = np.full((1, size), 0.02)
    state[0, 0] = 0.5
    for _ in range(50):
        state = step(state).full()
    assert np.abs(state[0, 1:]).max() < 1e-6
    assert state[0, 0] == pytest.approx(0.5, abs=1e-12)
