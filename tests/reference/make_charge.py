"""Make the reference charge: `python -m tests.reference.make_charge`.

The LG M50 cell at 20 % and rest, 25 degC: 1C until 4.2 V, then 4.2 V until C/20, by PyBaMM's DFN on
two meshes, the second 1.5 times finer; their limit (Richardson) is stored, and how far the finer is
from it, which bounds the limit's own error.
"""

import sys
import warnings
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pybamm

from tests.reference.dfn import Mesh
from tests.reference.make_reference import CELLS, HERE, TOLERANCE, limit

FloatArray = npt.NDArray[np.float64]

MESHES = Mesh(layer=36, particle=108), Mesh(layer=54, particle=162)
START_SOC = 0.2
CURRENT_A, VOLTAGE_V, CUT_OFF_A = 5.0, 4.2, 0.25
PERIOD_S = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Charge:
    """One charge: voltage up to the switch, current after it (charging negative), both sampled."""

    constant_current_s: FloatArray
    voltage_V: FloatArray
    switch_s: float
    constant_voltage_s: FloatArray
    current_A: FloatArray
    end_s: float


def solve(mesh: Mesh) -> Charge:
    """On one mesh; times from the start of the charge, those of the hold from the switch."""
    model = pybamm.lithium_ion.DFN({"thermal": "isothermal"})
    values = pybamm.ParameterValues.create_from_bpx(
        str(CELLS / "lg_m50.bpx.json"), target_soc=START_SOC
    )
    submesh = dict(model.default_submesh_types)
    for layer in ("electrode", "particle"):
        for side in ("negative", "positive"):
            submesh[f"{side} {layer}"] = pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh)
    submesh["separator"] = pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh)
    points = dict.fromkeys(("x_n", "x_s", "x_p"), mesh.layer)
    points |= {"r_n": mesh.particle, "r_p": mesh.particle}
    experiment = pybamm.Experiment(
        [
            (
                f"Charge at {CURRENT_A} A until {VOLTAGE_V} V",
                f"Hold at {VOLTAGE_V} V until {CUT_OFF_A} A",
            )
        ],
        period=f"{PERIOD_S} seconds",
    )
    solver = pybamm.IDAKLUSolver(rtol=TOLERANCE, atol=TOLERANCE, options={"max_num_steps": 10**6})
    sim = pybamm.Simulation(
        model,
        parameter_values=values,
        experiment=experiment,
        var_pts=points,
        submesh_types=submesh,
        solver=solver,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyBaMM's own, about its own defaults
        steps = sim.solve(calc_esoh=False).cycles[0].steps
    constant_current, hold = steps
    t, held_s = (s["Time [s]"].entries for s in steps)
    switch_s = float(t[-1])
    return Charge(
        t,
        constant_current["Terminal voltage [V]"].entries,
        switch_s,
        held_s - switch_s,
        hold["Current [A]"].entries,
        float(held_s[-1]),
    )


def common(a: FloatArray, b: FloatArray) -> FloatArray:
    """Sample times up to where the shorter of the two ends."""
    return np.arange(0.0, min(a[-1], b[-1]), PERIOD_S)


def make() -> str:
    """Solve, write the file, return what goes into the README."""
    coarse, fine = (solve(mesh) for mesh in MESHES)
    t = common(coarse.constant_current_s, fine.constant_current_s)
    held = common(coarse.constant_voltage_s, fine.constant_voltage_s)
    voltage = [np.interp(t, c.constant_current_s, c.voltage_V) for c in (coarse, fine)]
    current = [np.interp(held, c.constant_voltage_s, c.current_A) for c in (coarse, fine)]
    switch = [np.array(c.switch_s) for c in (coarse, fine)]
    end = [np.array(c.end_s) for c in (coarse, fine)]
    best = {
        "voltage_V": limit(*voltage),
        "current_A": limit(*current),
        "switch_s": limit(*switch),
        "end_s": limit(*end),
    }
    off = {
        f"own_error_{name}": np.abs(fines - best[name]).max()
        for name, fines in (
            ("voltage_V", voltage[1]),
            ("current_A", current[1]),
            ("switch_s", switch[1]),
            ("end_s", end[1]),
        )
    }
    np.savez_compressed(
        HERE / "lg_m50-charge-isothermal.npz",
        constant_current_s=t,
        constant_voltage_s=held,
        **best,
        **off,
    )
    figures = "".join(f"{name} {float(value):.6g}\n" for name, value in off.items())
    return f"switch_s {float(best['switch_s']):.3f}, end_s {float(best['end_s']):.3f}\n{figures}"


if __name__ == "__main__":
    sys.stdout.write(f"PyBaMM {pybamm.__version__}\n{make()}")
