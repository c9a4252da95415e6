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
    """I = gain times what was recorded: a shunt or its amplifier is off.

    Attributes:
        gain: true current over recorded one.
    """

    gain: float = 1.0

    id: ClassVar[str] = "current_gain"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gain", unit="1", value=1.0, lower=0.3, upper=3.0, prior_std=log(1.5),
            logarithmic=True,
        ),
    )  # fmt: skip
    """A sensor read by another one's factor: the amperes per volt in the PX4 logs of nine vehicles
    are 15 to 50, a factor of 1.5 (one standard deviation) about their mean. Pilots report 1.4
    (7837 mAh charged, 5733 recorded, github.com/CubePilot/cubepilot-docs/issues/38; a scale of 375
    after 268, github.com/iNavFlight/inav/issues/11432)."""
    balance: ClassVar[str] = "current"
    equation: ClassVar[str] = r"I = g\,I_\mathrm{rec}"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = (
        "voltage drops and the charge drawn are off by one and the same factor"
    )

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:  # noqa: ARG002
        """(n,) the current in the pack."""
        return self.gain * recorded_A
