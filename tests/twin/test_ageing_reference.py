"""The twin's ageing beside PyBaMM's on converged meshes (tests/reference, section Ageing).

Isothermal cases only: PyBaMM leaves the heat of the film out (README there), which is 0.3 K at 2C.
The first sample is left out: the film on fresh cracks draws amperes for a millisecond, which the
twin averages over a second. Plated lithium stands in balance with exp(-F V / RT): 1 mV is 4 %.
"""

from pathlib import Path

import numpy as np
import pytest

from twin.builtin import load_cell
from twin.effects import (
    AGEING,
    ActiveMaterialLoss,
    AnyEffect,
    Cracking,
    Plating,
    Sei,
    SeiOnCracks,
    StressEnhancedDiffusion,
)
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate

FOLDER = Path(__file__).parents[1] / "reference"
EFFECTS: dict[str, tuple[AnyEffect, ...]] = {
    "all": tuple(kind() for kind in AGEING),
    "sei": (Sei(resistivity_ohm_m=0.0),),
    "film": (Sei(),),
    "plating": (Plating(),),
    "crack_sei": (Sei(resistivity_ohm_m=0.0), SeiOnCracks(), Cracking()),
    "lam": (ActiveMaterialLoss(),),
    "stress_diffusion": (StressEnhancedDiffusion(),),
}
CASES = [
    ("2C", "all"), ("2C", "sei"), ("2C", "film"), ("2C", "plating"), ("2C", "crack_sei"),
    ("2C", "lam"), ("2C", "stress_diffusion"), ("charge", "all"), ("charge", "plating"),
    ("charge", "lam"), ("flight", "all"), ("rest", "all"),
]  # fmt: skip
VOLTAGE_mV = {"stress_diffusion": 4.0}  # a diffusivity that varies is linearised over a step
TOLERANCE = {
    "sei": ("sei_mol", 1e-6),
    "sei_on_cracks": ("crack_sei_mol", 1e-5),
    "plated": ("plated_mol", 0.02),
    "dead": ("dead_mol", 0.01),
    "trapped_negative": ("trapped_negative_mol", 0.005),
    "trapped_positive": ("trapped_positive_mol", 0.005),
}
NEXT_TO_NOTHING_mol = 1e-10  # of 0.28 mol


@pytest.mark.parametrize(("load", "effects"), CASES)
def test_ageing_agrees_with_pybamm(load: str, effects: str) -> None:
    with np.load(FOLDER / f"ageing-{load}-{effects}-isothermal.npz") as file:
        stored = dict(file)
    pack = Pack(
        cell=load_cell("lg_m50"), initial_soc=float(stored["charge"]), effects=EFFECTS[effects]
    )
    current = Load(time_s=stored["time_s"], current_A=stored["current_A"])
    solution = simulate(pack, current).require()
    error_mV = 1e3 * (solution.voltage_V - stored["voltage_V"])[1:]
    assert np.sqrt(np.mean(error_mV**2)) <= VOLTAGE_mV.get(effects, 1.0)
    for name, (start, end) in solution.audit.lost_mol.items():
        key, relative = TOLERANCE[name]
        expected = float(stored[key][-1])
        assert end - start == pytest.approx(expected, rel=relative, abs=NEXT_TO_NOTHING_mol)
    assert abs(solution.audit.relative_error) < 1e-14
