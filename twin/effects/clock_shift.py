"""Current and voltage were not recorded on the same clock."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from twin.effects.effect import Parameter

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockShift:
    """The current's clock is late by so much: I(t) = I_rec(t + shift)."""

    shift_s: float = 0.0

    id: ClassVar[str] = "clock_shift"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="shift_s", unit="s", value=0.0, lower=-3.0, upper=3.0, prior_std=0.3),
    )
    balance: ClassVar[str] = "current"
    equation: ClassVar[str] = r"I(t) = I_\mathrm{rec}(t + \Delta)"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = "all answers of the voltage to gusts early or late by the same time"

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:
        """(n,) the current in the pack; beyond its ends that of the end."""
        return np.interp(time_s + self.shift_s, time_s, recorded_A)
