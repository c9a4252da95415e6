"""How much of the heat a cell makes is told where the heat of mixing is not counted.

    python -m benchmarks.heat_told

A discharge of 30 % from a state of charge of 0.95, isothermal, then a rest of four hours: heat as
`SelfHeating` has it, by the surfaces of the particles, over the whole, by their mean
stoichiometries. What is missing went into gradients inside the particles and came back in the
rest. Five seconds.
"""

import casadi as ca
import numpy as np

from twin.builtin import load_cell
from twin.constants import ZERO_CELSIUS_K
from twin.kernel import Backend
from twin.limits import COLUMN
from twin.pack import Pack
from twin.pack_model import pack_model

RATES = {"lg_m50": (0.5, 1.0, 1.5), "lipo_2200": (1.0, 5.0)}
SHARE, STEPS, REST_STEPS, REST_STEP_S = 0.3, 300, 1500, 10.0
JUMP = np.linspace(0.02, 1.0, 40)  # of the current, at once


def share_told(name: str, rate: float, temperature_K: float) -> float:
    """Of the heat of discharge and rest."""
    cell = load_cell(name)
    pack = Pack(cell=cell, initial_soc=0.95, initial_K=temperature_K)
    model, kinds = pack_model(pack, None, Backend.AUTO), pack.cells()
    on, jump = np.ones(STEPS), np.zeros(JUMP.size)
    step_s = np.r_[
        jump, SHARE * 3600 / rate / STEPS * on, jump, 0, np.full(REST_STEPS, REST_STEP_S)
    ]
    current_A = np.r_[JUMP, on, JUMP[::-1], np.zeros(1 + REST_STEPS)] * rate * pack.rated_C / 3600
    still = np.zeros_like(step_s)
    drive = np.column_stack([step_s, current_A, still + temperature_K, still, still])
    states, out = model.steps(model.initial_state(kinds), drive, model.parameters(kinds))
    states = states.reshape(step_s.size, -1)
    whole_W = -current_A * out[:, COLUMN["voltage_V"]]
    for side in ("negative", "positive"):
        electrode, layer = getattr(cell, side), model.cell.layout.layer(side)
        x = ca.SX.sym("x")
        enthalpy_V = electrode.ocp_V(x) - cell.reference_K * electrode.entropic_V_K(x)
        parts = (model.cell.layout.slice_of(f"{part}_{side[0]}") for part in ("modes", "reaction"))
        modes, reaction = (states[:, part] for part in parts)
        mean_V = ca.Function("of", [x], [enthalpy_V])(modes[:, : layer.size]).full()
        area_m2 = cell.area_m2 * electrode.thickness_m * electrode.specific_area_m2_m3
        whole_W -= (reaction * mean_V) @ layer.weight * area_m2
    told_W = out[:, COLUMN["heat_W"]]
    told_J, whole_J = (step_s[1:] @ (q[1:] + q[:-1]) / 2 for q in (told_W, whole_W))
    return float(told_J / whole_J)


if __name__ == "__main__":
    for name, rates in RATES.items():
        for rate in rates:
            shares = (share_told(name, rate, ZERO_CELSIUS_K + t) for t in (0.0, 25.0, 45.0))
            print(f"{name} {rate:g}C, 0/25/45 degC:", *(f"{share:.2f}" for share in shares))
