"""Physical effects, one file each."""

from twin.effects.self_heating import SelfHeating

EFFECTS = {SelfHeating.id: SelfHeating}
"""Id -> effect, for everything that can be switched on."""

__all__ = ["EFFECTS", "SelfHeating"]
