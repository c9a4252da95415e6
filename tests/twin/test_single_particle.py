"""Without transport the twin is a single-particle model: against one solved on its own."""

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from benchmarks.single_particle import single_particle
from tests.reference.loads import LOADS
from twin.builtin import load_cell
from twin.cell import Cell, Electrode
from twin.constants import FARADAY_C_mol, GAS_J_mol_K
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

FloatArray = npt.NDArray[np.float64]

EIGENVALUES = 2000


def eigenvalues() -> FloatArray:
    """Of diffusion in a sphere with no flux through its surface: tan k = k, k > 0."""
    n = np.arange(1, EIGENVALUES + 1)
    k = (n + 0.5) * np.pi
    for _ in range(50):
        k = n * np.pi + np.arctan(k)
    return k


def surface(side: Electrode, start: float, load: Load, flux_mol_m2_s: FloatArray) -> FloatArray:
    """(n,) exact surface stoichiometry of one sphere under an outward flux that runs straight.

    Carslaw, Jaeger, Conduction of Heat in Solids (1959), section 9.8, convolved with the flux;
    eigenvalues beyond the last have settled.
    """
    x = ca.SX.sym("x")
    diffusivity = float(ca.Function("D", [x], [side.diffusivity_m2_s(x)])(0.5))
    tau = (load.time_s - load.time_s[0]) * diffusivity / side.particle_radius_m**2
    q = flux_mol_m2_s * side.particle_radius_m / diffusivity / side.max_concentration_mol_m3
    k2 = eigenvalues() ** 2
    mean, mode, rest = start, np.zeros(EIGENVALUES), 1 / 5 - np.sum(2 / k2)
    out = [start - rest * q[0]]
    for h, q0, q1 in zip(np.diff(tau), q[:-1], q[1:], strict=True):
        decay = np.exp(-k2 * h)
        gone, slope = (1 - decay) / k2, (q1 - q0) / h
        mode = mode * decay + 2 * (q0 * gone + slope * (h - gone) / k2)
        mean -= 3 * h * (q0 + q1) / 2
        out.append(mean - mode.sum() - rest * q1)
    return np.array(out)


def voltage_V(cell: Cell, soc: float, load: Load) -> FloatArray:
    """(n,) open-circuit potentials and Butler-Volmer of one particle an electrode, at 25 degC."""
    potentials = []
    for side, sign, charge in ((cell.negative, 1.0, soc), (cell.positive, -1.0, 1.0 - soc)):
        active_m2 = side.specific_area_m2_m3 * side.thickness_m * cell.area_m2
        i = sign * load.current_A / active_m2
        low, high = side.stoichiometry_min, side.stoichiometry_max
        x = surface(side, low + charge * (high - low), load, i / FARADAY_C_mol)
        exchange = FARADAY_C_mol * side.rate_constant_mol_m2_s * np.sqrt(x * (1 - x))
        eta = 2 * GAS_J_mol_K * 298.15 / FARADAY_C_mol * np.arcsinh(i / (2 * exchange))
        s = ca.SX.sym("s")
        potential = ca.Function("U", [s], [side.ocp_V(s)])
        potentials.append(np.asarray(potential(x[None, :])).ravel() + eta)
    return potentials[1] - potentials[0]


def flight(name: str) -> Load:
    known = LOADS[name, "flight"]
    part = known.time_s <= 120.0
    return Load(time_s=known.time_s[part], current_A=known.current_A[part])


def steady(name: str) -> Load:
    current_A = 3.0 * load_cell(name).nominal_capacity_C / 3600
    return Load(time_s=np.arange(0.0, 900.5, 1.0), current_A=np.full(901, current_A))


@pytest.mark.parametrize("make", [flight, steady])
@pytest.mark.parametrize("name", ["lg_m50", "lipo_2200"])
def test_without_transport_it_is_the_exact_single_particle_model(name: str, make) -> None:
    pack, load = Pack(cell=load_cell(name), initial_soc=0.9), make(name)
    exact = voltage_V(pack.cell, 0.9, load)
    error_mV = 1e3 * (single_particle(pack, load).require().voltage_V - exact)
    full_V = simulate(pack, load).voltage_V
    full_mV = 1e3 * (full_V - exact[: full_V.size])
    assert np.abs(error_mV).max() < 0.2  # of the particles' modes, see test_particle.py
    assert np.abs(full_mV).max() > 10.0  # transport is what was taken away
