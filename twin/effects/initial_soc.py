"""The pack does not start as full as stated."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialSoc:
    """State of charge at the start = stated + offset.

    Attributes:
        offset: positive: fuller than stated.
    """

    offset: float = 0.0

    id: ClassVar[str] = "initial_soc"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="offset", unit="1", value=0.0, lower=-1.0, upper=1.0, prior_std=0.1),
    )
    balance: ClassVar[str] = "lithium in both electrodes at the start"
    equation: ClassVar[str] = r"\mathrm{SOC}(0) = \mathrm{SOC}_0 + \Delta"
    source: ClassVar[str] = "a wrong statement"
    signature: ClassVar[str] = (
        "the open-circuit curve shifted along the charge drawn: an offset from the first sample on "
        "that follows the curve's slope"
    )
