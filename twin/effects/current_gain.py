"""The current that flowed is not what was recorded: a factor."""

from dataclasses import dataclass
from math import log
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from twin.effects.effect import Parameter

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentGain:
    """I = gain times what was recorded: a shunt or its amplifier is off."""

    gain: float = 1.0

    id: ClassVar[str] = "current_gain"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gain", unit="1", value=1.0, lower=0.3, upper=3.0, prior_std=log(1.1),
            logarithmic=True,
        ),
    )  # fmt: skip
    balance: ClassVar[str] = "current"
    equation: ClassVar[str] = r"I = g\,I_\mathrm{rec}"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = (
        "voltage drops and the charge drawn are off by one and the same factor"
    )

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:  # noqa: ARG002
        """(n,) the current in the pack."""
        return self.gain * recorded_A
