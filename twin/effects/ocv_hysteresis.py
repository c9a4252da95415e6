"""Open-circuit potentials that depend on which way lithium went: one state of memory a place.

An electrode for which the cell's BPX file has a lithiation and a delithiation branch runs between
those, at the file's decay. Any other runs between two curves beside its own, `amplitude` above
(delithiation) and below (lithiation). A file's branches are used only where this effect is switched
on: without it a cell follows its OCP alone.
"""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from twin.cell import Function, Hysteresis
from twin.effects.effect import Parameter

AMPLITUDE_V, DECAY = 0.005, 20.0  # to start a fit from: measured at no cell
TINY = 1e-200  # keeps a share of nothing from being 0 / 0


@dataclass(frozen=True, slots=True, kw_only=True)
class OcvHysteresis:
    """h' = (decay / 2) (sgn(q) - h) |q|, q = -x' the rate at which a particle's mean x falls.

    U = U_lith + (1 + h) / 2 (U_delith - U_lith): h is 1 on the delithiation branch, -1 on the
    lithiation branch. A reversal of the current leaves exp(-decay dx / 2) of the way to the other
    branch after the mean stoichiometry changed by dx. h is a state of every place across an
    electrode, and moves with the current alone: at rest it stays.

    Attributes:
        negative_amplitude_V: half the distance of the branches, where the file has none.
        positive_amplitude_V: likewise.
        negative_decay: per stoichiometry, where the file has none (BPX: OCP hysteresis decay
            constant).
        positive_decay: likewise.
        negative_start: h of a cell at its start. The default is what a charge leaves behind:
            lithiated,
        positive_start: and delithiated.
    """

    negative_amplitude_V: float = AMPLITUDE_V
    positive_amplitude_V: float = AMPLITUDE_V
    negative_decay: float = DECAY
    positive_decay: float = DECAY
    negative_start: float = -1.0
    positive_start: float = 1.0

    id: ClassVar[str] = "ocv_hysteresis"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *(
            Parameter(
                name=f"{side}_amplitude_V", unit="V", value=AMPLITUDE_V, lower=0.0, upper=0.3,
                prior_std=0.01,
            )
            for side in ("negative", "positive")
        ),
        *(
            Parameter(
                name=f"{side}_decay", unit="1", value=DECAY, lower=0.0, upper=1e4, prior_std=20.0
            )
            for side in ("negative", "positive")
        ),
        *(
            Parameter(
                name=f"{side}_start", unit="1", value=value, lower=-1.0, upper=1.0, prior_std=0.5
            )
            for side, value in (("negative", -1.0), ("positive", 1.0))
        ),
    )  # fmt: skip
    balance: ClassVar[str] = "potential of both electrodes, and its heat"
    equation: ClassVar[str] = (
        r"\dot h = \tfrac{\gamma}{2}\left(\mathrm{sgn}(q) - h\right)|q|,\ q = -\dot{\bar x},\quad "
        r"U = \tfrac{1+h}{2}U_\mathrm{delith} + \tfrac{1-h}{2}U_\mathrm{lith}"
    )
    source: ClassVar[str] = (
        "Axen et al., J. Energy Storage 48, 103985 (2022), doi:10.1016/j.est.2022.103985, in the "
        "form of PyBaMM 26.10.1.1, one_state_hysteresis_ocp.py, to which it maps the decay of BPX"
    )
    signature: ClassVar[str] = (
        "charge and discharge, however slow, lie apart by a voltage that no rest closes; after a "
        "reversal it comes with the charge that has passed, not with time"
    )


def off_equilibrium_V(
    ocp_V: Function, branches: Hysteresis | ca.SX, surface: ca.SX, h: ca.SX
) -> ca.SX:
    """(n,) added to the open-circuit potential `ocp_V` of surfaces (n,) whose memory is h.

    `branches` are those of the cell's file, or half their distance where it has none [V].
    """
    if not isinstance(branches, Hysteresis):
        return h * branches
    low, high = branches.lithiation_V(surface), branches.delithiation_V(surface)
    return (low + high) / 2 + h * (high - low) / 2 - ocp_V(surface)


def relaxed(h: ca.SX, start: ca.SX, end: ca.SX) -> ca.SX:
    """(n,) h after a step over which the reaction runs straight; exact, within -1 and 1.

    Where the reaction turns on the way, h goes to the one branch first and then to the other.

    Args:
        h: (n,) before it.
        start: (n,) decay / 2 times the stoichiometry that would leave the particles over the step
            at its first reaction current, > 0 delithiates.
        end: (n,) the same at its last. All zero for a step of no length: h stays.
    """
    first, last = ca.fabs(start), ca.fabs(end)
    turns = start * end < 0  # then each part has its share of the step, else half of it
    for way, size, other in ((start, first, last), (end, last, first)):
        share = (size + TINY) / (size + turns * other + TINY)
        h = h + (ca.sign(way) - h) * (1 - ca.exp(-size * share / 2))
    return h
