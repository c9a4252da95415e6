"""The twin on the stored cycles: `answer(reference, how)`, beside PyBaMM's amounts of `theirs`."""

import time
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from tests.reference.ageing import ReferenceAgeing
from tests.reference.loads import ReferenceLoad
from twin.builtin import load_cell
from twin.cell_mesh import DEFAULT_MESH
from twin.effects import AGEING, ActiveMaterialLoss, StressEnhancedDiffusion
from twin.layout import Layout
from twin.load import Load
from twin.mesh import Layer
from twin.pack import Pack
from twin.protocol import ConstantCurrent, FollowLoad, Rest, Step, StepResult, run
from twin.simulate import simulate
from twin.solution import LithiumAudit

FloatArray = npt.NDArray[np.float64]


class How(Enum):
    """What takes the load: steps of a second, or adaptive ones as a protocol takes them."""

    SAMPLED = "sampled"
    PROTOCOL = "protocol"


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What the twin says: amounts at the end by name, voltage at the samples (n,)."""

    amounts: dict[str, float]
    voltage_V: FloatArray
    audit: LithiumAudit
    steps: int
    seconds: float


LOST = {
    "SEI [mol]": "sei",
    "SEI on cracks [mol]": "sei_on_cracks",
    "plated [mol]": "plated",
    "dead [mol]": "dead",
    "trapped, negative [mol]": "trapped_negative",
    "trapped, positive [mol]": "trapped_positive",
}
"""Name in the table -> name in the audit."""


def pack_of(reference: ReferenceAgeing) -> Pack:
    """The M50 with the effects `negative` or `stress_diffusion` (README)."""
    kept = tuple(kind() for kind in AGEING if kind is not ActiveMaterialLoss)
    loss = {
        "negative": (ActiveMaterialLoss(positive_critical_Pa=np.inf),),
        "stress_diffusion": (ActiveMaterialLoss(), StressEnhancedDiffusion()),
    }[reference.effects]
    return Pack(cell=load_cell("lg_m50"), initial_soc=reference.charge, effects=(*kept, *loss))


def theirs(reference: ReferenceAgeing) -> dict[str, float]:
    """PyBaMM's at the last sample, without what is 0; LLI: all that left particles and salt."""
    out = reference.outputs
    stored = (
        out.sei_mol, out.crack_sei_mol, out.plated_mol, out.dead_mol, out.trapped_negative_mol,
        out.trapped_positive_mol,
    )  # fmt: skip
    amounts = {name: float(values[-1]) for name, values in zip(LOST, stored, strict=True)}
    amounts["LLI [mol]"] = float(out.lost_mol()[-1])
    for side, active in (("negative", out.active_negative), ("positive", out.active_positive)):
        amounts[f"LAM, {side} [1]"] = float(1 - active[-1] / active[0])
    return {name: amount for name, amount in amounts.items() if amount != 0}


def answer(reference: ReferenceAgeing, how: How) -> Answer:
    """The whole load; the seconds are without the kernel's compilation."""
    pack, whole = pack_of(reference), reference.load
    simulate(pack, Load(time_s=whole.time_s[:2], current_A=whole.current_A[:2]))
    start = time.perf_counter()
    if how is How.SAMPLED:
        load = Load(time_s=whole.time_s, current_A=whole.current_A)
        solution = simulate(pack, load).require()
        voltage_V, state, steps = solution.voltage_V, solution.end_state, solution.steps
        audit = solution.audit
    else:
        result = run(pack, as_protocol(whole)).require()
        voltage_V, state, audit = _at_samples(result.steps), result.end_state, result.audit
        steps = sum(s.steps for s in result.steps)
    seconds = time.perf_counter() - start
    return Answer(_amounts(audit, state), voltage_V, audit, steps, seconds)


def as_protocol(load: ReferenceLoad) -> tuple[Step, ...]:
    """Steps of constant current and rest where the current stays from sample to sample."""
    time_s, current_A = load.time_s, load.current_A
    stays = np.diff(current_A) == 0
    starts = np.flatnonzero(stays | np.concatenate([[True], stays[:-1]]))
    steps: list[Step] = []
    for start, stop in pairwise([*starts, stays.size]):
        part = slice(start, stop + 1)
        if not stays[start]:
            steps.append(FollowLoad(load=Load(time_s=time_s[part], current_A=current_A[part])))
        elif current_A[start] == 0:
            steps.append(Rest(duration_s=time_s[stop] - time_s[start]))
        else:
            lasting_s = time_s[stop] - time_s[start]
            steps.append(ConstantCurrent(current_A=current_A[start], duration_s=lasting_s))
    return tuple(steps)


def _at_samples(results: tuple[StepResult, ...]) -> FloatArray:
    """(n,) voltage: of an adaptive step the last, of a load all but the first."""
    parts = [results[0].voltage_V[:1]]
    parts += [r.voltage_V[1 if isinstance(r.step, FollowLoad) else -1 :] for r in results]
    return np.concatenate(parts)


def _amounts(audit: LithiumAudit, state: FloatArray) -> dict[str, float]:
    moved = {name: end - start for name, (start, end) in audit.lost_mol.items()}
    out = {name: moved[key] for name, key in LOST.items()}
    out["LLI [mol]"] = sum(moved.values())
    layout = Layout(DEFAULT_MESH, ageing=True)

    def lost(layer: Layer, key: str) -> float:
        return 1 - float(layer.weight @ state[layout.slice_of(f"left_{key}")])

    out["LAM, negative [1]"] = lost(DEFAULT_MESH.negative, "n")
    out["LAM, positive [1]"] = lost(DEFAULT_MESH.positive, "p")
    return out
