"""The current that flowed is not what was recorded: a constant."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from twin.effects.effect import Parameter

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentOffset:
    """I = what was recorded + offset: the sensor's zero has moved.

    Attributes:
        offset_A: true current less recorded one, discharge positive.
    """

    offset_A: float = 0.0

    id: ClassVar[str] = "current_offset"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="offset_A", unit="A", value=0.0, lower=-20.0, upper=20.0, prior_std=2.0),
    )
    """Of a Hall sensor for 100 A: 50 mV at 20 mV/A and 0.8 A of remanence at most (data sheet of
    the Allegro ACS750xCA-100). Pilots report 3 to 5 A (github.com/iNavFlight/inav/issues/11432)."""
    balance: ClassVar[str] = "current"
    equation: ClassVar[str] = r"I = I_\mathrm{rec} + \Delta"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = "the charge drawn is off in proportion to time, not to the load"

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:  # noqa: ARG002
        """(n,) the current in the pack."""
        return recorded_A + self.offset_A
