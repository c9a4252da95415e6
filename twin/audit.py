"""Where the lithium of a cell, or of a pack of unlike cells, went between two states."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from twin.constants import FARADAY_C_mol
from twin.solution import LithiumAudit
from twin.step import StepModel

FloatArray = npt.NDArray[np.float64]


def audit(
    model: StepModel,
    values: Mapping[str, float],
    states: tuple[FloatArray, FloatArray],
    charge_C: float,
) -> LithiumAudit:
    """Lithium of one cell in its first and last state, `charge_C` drawn between them."""
    start, end = (model.lithium_mol(s, values) for s in states)
    total = sum(start.values()), sum(end.values())
    taken = {k: end[k] - start[k] for k in ("positive", "trapped_positive") if k in end}
    moved = {name: np.array([start[name], end[name]]) for name in start}
    return LithiumAudit(
        negative_mol=moved.pop("negative"),
        positive_mol=moved.pop("positive"),
        electrolyte_mol=moved.pop("electrolyte"),
        lost_mol=moved,
        relative_error=(total[1] - total[0]) / total[0],
        charge_error_C=charge_C - FARADAY_C_mol * sum(taken.values()),
    )


def mean_audit(audits: Sequence[LithiumAudit], counts: Sequence[int]) -> LithiumAudit:
    """Amounts of the mean cell, errors of the worst: each kind of cell must balance by itself.

    Args:
        audits: of each kind.
        counts: how many cells are of each.
    """

    def mean(amounts: Sequence[FloatArray]) -> FloatArray:
        return np.asarray(np.average(amounts, axis=0, weights=counts))

    return LithiumAudit(
        negative_mol=mean([a.negative_mol for a in audits]),
        positive_mol=mean([a.positive_mol for a in audits]),
        electrolyte_mol=mean([a.electrolyte_mol for a in audits]),
        lost_mol={k: mean([a.lost_mol[k] for a in audits]) for k in audits[0].lost_mol},
        relative_error=max((a.relative_error for a in audits), key=abs),
        charge_error_C=max((a.charge_error_C for a in audits), key=abs),
    )
