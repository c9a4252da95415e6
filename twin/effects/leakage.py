"""Charge leaves the cells that no sensor at the terminals sees."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from twin.effects.effect import Parameter

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Leakage:
    """The pack discharges itself past the sensor while it is in use: a soft short, a load too many.

    It acts in a recorded load, also where no current is recorded, and nowhere else: in the rests
    and charges of a protocol (`twin age`) a load past the sensor is off. A short is not; nobody can
    tell the two by a flight, and of a short the discharge between flights is left out.

    Attributes:
        current_A: past the sensor, out of the pack.
    """

    current_A: float = 0.0

    id: ClassVar[str] = "leakage"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="current_A", unit="A", value=0.0, lower=0.0, upper=20.0, prior_std=0.5),
    )
    balance: ClassVar[str] = "current of the cells"
    equation: ClassVar[str] = r"I_\mathrm{cells} = I + I_\mathrm{leak}"
    source: ClassVar[str] = "Kirchhoff's law at the terminals"
    signature: ClassVar[str] = (
        "charge disappears in proportion to time, also while no current is recorded"
    )

    def flowed_A(self, time_s: FloatArray, recorded_A: FloatArray) -> FloatArray:  # noqa: ARG002
        """(n,) the current in the pack."""
        return recorded_A + self.current_A
