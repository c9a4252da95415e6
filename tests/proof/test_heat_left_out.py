"""The truth warms by all that flows: PyBaMM leaves out lithium that strips, and films."""

from dataclasses import replace

import numpy as np
import pytest

from twin.builtin import load_cell
from twin.effects import AnyEffect, FilmResistance, Plating, SelfHeating
from twin.load import Between, Load
from twin.pack import Pack
from twin.simulate import simulate

pytest.importorskip("pybamm", reason="PyBaMM makes the truth")
from proof.simulated.cell_truth import CellTruth
from proof.simulated.dfn import solve

TRANSFER_W_m2_K = 12.0
BARE = CellTruth(
    cell="lipo_2200", soc=0.9, start_K=300.0, ambient_K=300.0, heat_transfer_W_m2_K=TRANSFER_W_m2_K
)


@pytest.mark.parametrize(
    ("truth", "effect"),
    [
        (replace(BARE, plated_mol_m3=800.0), Plating(initial_mol_m3=800.0)),
        (replace(BARE, film_ohm_m2=3e-3), FilmResistance(negative_ohm_m2=3e-3)),
    ],
    ids=["plated lithium", "film"],
)
def test_truth_and_twin_are_as_warm(truth: CellTruth, effect: AnyEffect) -> None:
    time_s = np.arange(0.0, 200.0)
    current_A = np.interp(time_s, (0.0, 5.0), (0.0, 9.0))
    _, theirs_K = solve(truth, time_s, current_A)
    heating = SelfHeating(heat_transfer_W_m2_K=TRANSFER_W_m2_K)
    pack = Pack(cell=load_cell("lipo_2200"), initial_soc=0.9, initial_K=300.0, effects=(heating,))
    moved = replace(pack, effects=(heating, effect))
    load = Load(time_s=time_s, current_A=current_A, ambient_K=300.0, between=Between.LINEAR)
    plain, ours = (simulate(p, load).require().temperature_K for p in (pack, moved))
    assert abs(ours[-1] - plain[-1]) > 0.1  # what the effect does to the temperature
    assert np.abs(theirs_K - ours).max() < 0.02  # 0.27 and 0.23 K without that heat
