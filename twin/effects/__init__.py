"""Physical effects, one file each."""

from collections.abc import Iterable
from typing import get_args

from twin.effects.activation_energies import ActivationEnergies
from twin.effects.active_material_loss import ActiveMaterialLoss
from twin.effects.active_material_lost import ActiveMaterialLossNegative, ActiveMaterialLossPositive
from twin.effects.clock_shift import ClockShift
from twin.effects.cold_pack import ColdPack
from twin.effects.cracking import Cracking
from twin.effects.current_gain import CurrentGain
from twin.effects.current_offset import CurrentOffset
from twin.effects.electrolyte_transport import ElectrolyteTransport
from twin.effects.film_resistance import FilmResistance
from twin.effects.initial_soc import InitialSoc
from twin.effects.leakage import Leakage
from twin.effects.lithium_inventory_loss import LithiumInventoryLoss
from twin.effects.mechanics import Mechanics
from twin.effects.ocv_hysteresis import OcvHysteresis
from twin.effects.plating import Plating
from twin.effects.porosity_change import PorosityChange
from twin.effects.reaction_kinetics import ReactionKinetics
from twin.effects.sei import Sei
from twin.effects.sei_on_cracks import SeiOnCracks
from twin.effects.self_heating import SelfHeating
from twin.effects.sensor_lag import SensorLag
from twin.effects.series_resistance import SeriesResistance
from twin.effects.solid_diffusion import SolidDiffusionNegative, SolidDiffusionPositive
from twin.effects.stress_enhanced_diffusion import StressEnhancedDiffusion
from twin.effects.voltage_gain import VoltageGain
from twin.effects.weak_cell import WeakCell

Ageing = Sei | SeiOnCracks | Plating | Cracking | ActiveMaterialLoss | PorosityChange
Switched = SelfHeating | StressEnhancedDiffusion | OcvHysteresis | Ageing
OfCell = (
    ElectrolyteTransport
    | SolidDiffusionNegative
    | SolidDiffusionPositive
    | ReactionKinetics
    | ActivationEnergies
    | LithiumInventoryLoss
    | ActiveMaterialLossNegative
    | ActiveMaterialLossPositive
)
OfStart = InitialSoc | ColdPack
OfCurrent = CurrentGain | CurrentOffset | Leakage | SensorLag | ClockShift
Measured = SeriesResistance | FilmResistance | WeakCell | OfCell | OfStart | OfCurrent | VoltageGain
AnyEffect = Switched | Measured

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

OF_CELL = get_args(OfCell)
"""Those whose `changed` gives other numbers of the cell."""

OF_CURRENT = get_args(OfCurrent)
"""Those whose `flowed_A` gives the current that flowed from that which was recorded."""

MEASURED: dict[str, type[Measured]] = {e.id: e for e in get_args(Measured)}
"""Id -> effect, for those that are nothing without a number of the pack at hand."""


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
    "MEASURED",
    "OF_CELL",
    "OF_CURRENT",
    "ActivationEnergies",
    "ActiveMaterialLoss",
    "ActiveMaterialLossNegative",
    "ActiveMaterialLossPositive",
    "Ageing",
    "AnyEffect",
    "ClockShift",
    "ColdPack",
    "Cracking",
    "CurrentGain",
    "CurrentOffset",
    "ElectrolyteTransport",
    "FilmResistance",
    "InitialSoc",
    "Leakage",
    "LithiumInventoryLoss",
    "Measured",
    "Mechanics",
    "OcvHysteresis",
    "Plating",
    "PorosityChange",
    "ReactionKinetics",
    "Sei",
    "SeiOnCracks",
    "SelfHeating",
    "SensorLag",
    "SeriesResistance",
    "SolidDiffusionNegative",
    "SolidDiffusionPositive",
    "StressEnhancedDiffusion",
    "VoltageGain",
    "WeakCell",
    "chosen",
]
