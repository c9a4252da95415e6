"""The voltage was recorded with a wrong factor."""

from dataclasses import dataclass
from math import log
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class VoltageGain:
    """What is recorded is gain times the voltage: the divider is off.

    Attributes:
        gain: recorded voltage over true one.
    """

    gain: float = 1.0

    id: ClassVar[str] = "voltage_gain"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gain", unit="1", value=1.0, lower=0.8, upper=1.25, prior_std=log(1.02),
            logarithmic=True,
        ),
    )  # fmt: skip
    balance: ClassVar[str] = "recorded voltage"
    equation: ClassVar[str] = r"V_\mathrm{rec} = g\,V"
    source: ClassVar[str] = "an instrument, not the battery"
    signature: ClassVar[str] = "off by one factor, at rest and under load alike"
