"""The pack, or the air around it, is colder or warmer than stated."""

from dataclasses import dataclass
from typing import ClassVar

from twin.effects.effect import Parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class ColdPack:
    """Offsets of the temperature at the start and of the air; every rate follows by Arrhenius.

    Attributes:
        start_offset_K: negative: colder than stated.
        ambient_offset_K: likewise, of the air.
    """

    start_offset_K: float = 0.0
    ambient_offset_K: float = 0.0

    id: ClassVar[str] = "cold_pack"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=f"{which}_offset_K", unit="K", value=0.0, lower=-60.0, upper=40.0, prior_std=15.0
        )
        for which in ("start", "ambient")
    )
    balance: ClassVar[str] = "temperature at the start and outside"
    equation: ClassVar[str] = (
        r"T(0) = T_0 + \Delta_0,\quad "
        r"T_\mathrm{amb} \leftarrow T_\mathrm{amb} + \Delta_\mathrm{amb}"
    )
    source: ClassVar[str] = "a wrong statement; Arrhenius factors as in the cell's file"
    signature: ClassVar[str] = (
        "all resistances larger (colder) from the first second, kinetics and solids the most; with "
        "self-heating it fades during the flight"
    )
