"""`Cost` of a stretch of a load, and of stretches drawn one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.damage.loss import NOTHING, Ledger, Loss
from twin.load import Load
from twin.pack import Pack
from twin.simulate import simulate
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What a stretch cost.

    Attributes:
        loss: in it.
        drawn_C: likewise.
        energy_J: likewise.
        duration_s: of it, as far as it was simulated.
        mean_K: of the pack.
        mean_soc: of the cells.
    """

    loss: Loss
    drawn_C: float
    energy_J: float
    duration_s: float
    mean_K: float
    mean_soc: float


def drawn(
    pack: Pack, ledger: Ledger, loads: Sequence[Load], state: FloatArray
) -> tuple[list[Cost], Status]:
    """Of each of `loads`, from `state` on, until one cannot be drawn to its end."""
    costs, status = [], Status.DONE
    for load in loads:
        cost, solution = cost_of(pack, ledger, load, state)
        costs.append(cost)
        state, status = solution.end_state, solution.status
        if status is not Status.DONE:
            break
    return costs, status


def cost_of(pack: Pack, ledger: Ledger, load: Load, state: FloatArray) -> tuple[Cost, Solution]:
    """Of one load from `state` on."""
    before = ledger.loss(state)
    solution = simulate(pack, load, state=state)
    known = bool(solution.time_s.size)
    cost = Cost(
        loss=ledger.loss(solution.end_state) - before,
        drawn_C=solution.charge_C,
        energy_J=solution.energy_J,
        duration_s=solution.stopped_s - float(load.time_s[0]),
        mean_K=float(solution.temperature_K.mean()) if known else np.nan,
        mean_soc=float(solution.soc.mean()) if known else np.nan,
    )
    return cost, solution


def total(costs: Sequence[Cost]) -> Cost:
    """Of stretches together."""
    seconds = np.array([c.duration_s for c in costs])
    whole_s = float(seconds.sum())
    weight = seconds / whole_s if whole_s > 0 else np.full(seconds.size, np.nan)
    loss = NOTHING
    for c in costs:
        loss += c.loss
    return Cost(
        loss=loss,
        drawn_C=sum(c.drawn_C for c in costs),
        energy_J=sum(c.energy_J for c in costs),
        duration_s=whole_s,
        mean_K=float(weight @ [c.mean_K for c in costs]),
        mean_soc=float(weight @ [c.mean_soc for c in costs]),
    )
