"""Physical effects, one file each."""

from collections.abc import Iterable

from twin.effects.active_material_loss import ActiveMaterialLoss
from twin.effects.cracking import Cracking
from twin.effects.electrolyte_transport import ElectrolyteTransport
from twin.effects.film_resistance import FilmResistance
from twin.effects.mechanics import Mechanics
from twin.effects.ocv_hysteresis import OcvHysteresis
from twin.effects.plating import Plating
from twin.effects.porosity_change import PorosityChange
from twin.effects.reaction_kinetics import ReactionKinetics
from twin.effects.sei import Sei
from twin.effects.sei_on_cracks import SeiOnCracks
from twin.effects.self_heating import SelfHeating
from twin.effects.series_resistance import SeriesResistance
from twin.effects.solid_diffusion import SolidDiffusion
from twin.effects.stress_enhanced_diffusion import StressEnhancedDiffusion
from twin.effects.weak_cell import WeakCell

Ageing = Sei | SeiOnCracks | Plating | Cracking | ActiveMaterialLoss | PorosityChange
Switched = SelfHeating | StressEnhancedDiffusion | OcvHysteresis | Ageing
Measured = SeriesResistance | FilmResistance | WeakCell
Factor = ReactionKinetics | ElectrolyteTransport | SolidDiffusion
AnyEffect = Switched | Measured | Factor

AGEING: tuple[type[Ageing], ...] = (
    Sei,
    SeiOnCracks,
    Plating,
    Cracking,
    ActiveMaterialLoss,
    PorosityChange,
)
"""Those that change the cell for good; one kernel holds them all, strengths being inputs."""

EFFECTS: dict[str, type[Switched]] = {
    e.id: e for e in (SelfHeating, *AGEING, StressEnhancedDiffusion, OcvHysteresis)
}
"""Id -> effect, for all that act with the numbers they come with."""

MEASURED: dict[str, type[Measured]] = {
    e.id: e for e in (SeriesResistance, FilmResistance, WeakCell)
}
"""Id -> effect, for those that are nothing without a number of the pack at hand."""

FACTORS: tuple[type[Factor], ...] = (ReactionKinetics, ElectrolyteTransport, SolidDiffusion)
"""Those that multiply numbers of the cell, which a fit to a flight may find."""


def chosen(ids: Iterable[str], *, heat_transfer_W_m2_K: float) -> tuple[AnyEffect, ...]:
    """The effects of these ids with their defaults; KeyError for an id that is not in EFFECTS."""
    return tuple(
        SelfHeating(heat_transfer_W_m2_K=heat_transfer_W_m2_K)
        if EFFECTS[name] is SelfHeating
        else EFFECTS[name]()
        for name in ids
    )


__all__ = [
    "AGEING",
    "EFFECTS",
    "FACTORS",
    "MEASURED",
    "ActiveMaterialLoss",
    "Ageing",
    "AnyEffect",
    "Cracking",
    "ElectrolyteTransport",
    "Factor",
    "FilmResistance",
    "Measured",
    "Mechanics",
    "OcvHysteresis",
    "Plating",
    "PorosityChange",
    "ReactionKinetics",
    "Sei",
    "SeiOnCracks",
    "SelfHeating",
    "SeriesResistance",
    "SolidDiffusion",
    "StressEnhancedDiffusion",
    "WeakCell",
    "chosen",
]
