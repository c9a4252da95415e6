"""The numbers by which motions are compared: modes and reactions, of a flight in part or whole."""

from collections.abc import Callable, Mapping
from enum import Enum

from twin.damage.cycles import Cycled
from twin.damage.loss import Loss


class Part(Enum):
    """Of what is done with a pack."""

    WHOLE = "a flight and the charge after it"
    FLIGHT = "the flight alone"


MEASURES: Mapping[str, Callable[[Loss], float]] = {
    "lithium": lambda loss: loss.inventory_C,
    "negative": lambda loss: loss.negative,
    "positive": lambda loss: loss.positive,
    "sei": lambda loss: loss.sei_C,
    "sei_on_cracks": lambda loss: loss.sei_on_cracks_C,
    "plating": lambda loss: loss.dead_C,
    "total": lambda loss: loss.reactions_C,
}
"""Modes of degradation: lithium lost for good [C], share of either active material; reactions:
charge lost for good to SEI, SEI on cracks, plating, and to all three [C]."""

NEXT_TO_NOTHING = 0.01  # of the same loss over flight and charge: a ratio of it says nothing


def number(measure: str, part: Part) -> Callable[[Cycled], float]:
    """Of what was cycled, per flight."""
    of = MEASURES[measure]
    return lambda c: of(c.whole if part is Part.WHOLE else c.in_flight)
