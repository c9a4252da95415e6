"""600 s of flight at 10 Hz with all ageing, beside PyBaMM: `python -m benchmarks.whole_flight`.

The LG M50, stress-enhanced diffusion off on both sides. PyBaMM on two graded meshes and their limit
(second order); isothermal takes it 3 minutes, a lumped temperature 20 (`... lumped`). Its heat
leaves out the film (tests/reference/README.md), so the twin's temperature is compared without.
"""

import sys
import warnings
from importlib import resources

import numpy as np

from tests.reference.ageing_dfn import AgeingAnswer, solve_ageing
from tests.reference.dfn import Mesh
from tests.reference.loads import LOADS
from twin.builtin import load_cell
from twin.effects import AGEING, AnyEffect, Sei, SelfHeating
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution

MESHES = {
    "isothermal": (Mesh(layer=16, particle=20), Mesh(layer=36, particle=45)),
    "lumped": (Mesh(layer=12, particle=16), Mesh(layer=16, particle=20)),
}
TOLERANCE = (1e-6, 1e-8)
NAMES = {
    "sei": "sei_mol", "sei_on_cracks": "crack_sei_mol", "plated": "plated_mol", "dead": "dead_mol",
    "trapped_negative": "trapped_negative_mol",
}  # fmt: skip
ALL: tuple[AnyEffect, ...] = tuple(kind() for kind in AGEING)
NO_FILM = tuple(Sei(resistivity_ohm_m=0.0) if isinstance(e, Sei) else e for e in ALL)


def answer(thermal: str, mesh: Mesh) -> AgeingAnswer:
    """PyBaMM's."""
    flight = LOADS["lg_m50", "flight"]
    with (
        warnings.catch_warnings(),
        resources.as_file(resources.files("twin") / "cells" / "lg_m50.bpx.json") as file,
    ):
        warnings.simplefilter("ignore")
        return solve_ageing(
            file, flight.time_s, flight.current_A, charge=1.0, effects="all", thermal=thermal,
            mesh=mesh, tolerance=TOLERANCE,
        )  # fmt: skip


def ours(effects: tuple[AnyEffect, ...]) -> Solution:
    """The twin's."""
    flight = LOADS["lg_m50", "flight"]
    load = Load(time_s=flight.time_s, current_A=flight.current_A)
    return simulate(Pack(cell=load_cell("lg_m50"), effects=effects), load).require()


def main(thermal: str) -> None:
    """Print the differences."""
    coarse, fine = (answer(thermal, mesh) for mesh in MESHES[thermal])
    ratio = (MESHES[thermal][1].layer / MESHES[thermal][0].layer) ** 2
    limit = {
        name: fine.outputs[name] + (fine.outputs[name] - coarse.outputs[name]) / (ratio - 1)
        for name in fine.outputs
    }
    heat = () if thermal == "isothermal" else (SelfHeating(heat_transfer_W_m2_K=10.0),)
    twin = ours((*ALL, *heat))
    for name, volts in (("limit", limit["voltage_V"]), ("finest mesh", fine.outputs["voltage_V"])):
        error_mV = 1e3 * (twin.voltage_V - volts)[1:]
        print(f"{name}: {np.sqrt(np.mean(error_mV**2)):.2f} mV rms, {np.abs(error_mV).max():.1f}")
    if heat:
        for label, effects in (("", ALL), (" without the film's heat", NO_FILM)):
            apart_K = ours((*effects, *heat)).temperature_K - limit["temperature_K"]
            print(f"temperature{label}: {np.abs(apart_K).max():.3f} K apart at most")
    for name, theirs in NAMES.items():
        start, end = twin.audit.lost_mol[name]
        grown = float(limit[theirs][-1] - limit[theirs][0])
        print(f"{name}: {100 * ((end - start) / grown - 1):+.3f} %")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "isothermal")
