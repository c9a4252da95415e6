"""What the LiPo cell can deliver, by PyBaMM: `python -m tests.reference.capability`."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pybamm

from tests.reference.dfn import Mesh, simulation

FILE = Path(__file__).parents[2] / "twin" / "cells" / "lipo_2200.bpx.json"
FINE = Mesh(layer=24, particle=48)
CAPACITY_AH = 2.2
PEAK_A = 35 * CAPACITY_AH


def run(steps: list[tuple[float, float]], thermal: str) -> list[pybamm.Solution]:
    """One solution for each (current [A], duration [s]), ended early by a cut-off."""
    sim = simulation(FILE, "[input]", mesh=FINE, thermal=thermal, tolerance=1e-7, cut_offs=True)
    sim.build(inputs={"Current function [A]": 0.0})
    out: list[pybamm.Solution] = []
    for current_A, duration_s in steps:
        out.append(
            sim.solver.step(
                out[-1] if out else None,
                sim.built_model,
                duration_s,
                t_eval=np.array([0.0, duration_s]),
                t_interp=np.linspace(0.0, duration_s, 301),
                inputs={"Current function [A]": current_A},
                save=False,
            )
        )
    return out


def figures(solution: pybamm.Solution) -> tuple[np.ndarray, np.ndarray, float, float, float]:
    """Seconds since the step began, voltage, last temperature [C], least and most salt."""
    salt = solution["Electrolyte concentration [mol.m-3]"].entries
    warm = solution["Volume-averaged cell temperature [K]"].entries[-1] - 273.15
    voltage = solution["Terminal voltage [V]"].entries
    return solution.t - solution.t[0], voltage, float(warm), float(salt.min()), float(salt.max())


def main() -> None:
    """Constant currents from full, then 35C peaks."""
    write = sys.stdout.write
    for thermal in ("lumped", "isothermal"):
        for rate in (1, 5, 10, 15):
            current = rate * CAPACITY_AH
            t, v, warm, low, high = figures(run([(current, 3700 * 1.1 / rate)], thermal)[0])
            write(
                f"{thermal} {rate}C: {current * t[-1] / 3600:.3f} Ah to {v[-1]:.2f} V, mean "
                f"{np.trapezoid(v, t) / t[-1]:.3f} V, {warm:.1f} C, salt {low:.0f}..{high:.0f}\n"
            )
    half_s = 0.5 * CAPACITY_AH * 3600 / CAPACITY_AH
    for label, before in (
        ("rested at half charge", [(CAPACITY_AH, half_s), (0.0, 1200.0)]),
        ("after 180 s of 10C", [(10 * CAPACITY_AH, 180.0)]),
        ("full", []),
    ):
        peak_s = 60.0 if not before else 5.0
        *_, peak = run([*before, (PEAK_A, peak_s)], "lumped")
        t, v, warm, low, high = figures(peak)
        volts = ", ".join(f"{s} s {np.interp(s, t, v):.3f} V" for s in (0, 1, 3, peak_s))
        write(f"35C, {label}: {volts}; {warm:.1f} C, salt {low:.0f}..{high:.0f}\n")
    *_, small, large = run(
        [(CAPACITY_AH, half_s), (0.0, 1200.0), (CAPACITY_AH, 10.0), (11 * CAPACITY_AH, 10.0)],
        "lumped",
    )
    before_V = figures(small)[1][-1]
    t, v, *_ = figures(large)
    for s in (0.1, 1, 10):
        ohm = (before_V - np.interp(s, t, v)) / (10 * CAPACITY_AH)
        write(f"resistance, half charge, 1C to 11C, {s} s: {1e3 * ohm:.2f} mOhm\n")


if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyBaMM's own, about its own defaults
        main()
