"""What every physical effect says of itself."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

Numbers = dict[str, float]
"""Of one cell, by the kernel's names: `twin/parameters.py`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A number of an effect that may be set or fitted.

    Attributes:
        name: ends in its unit.
        unit: for reports.
        value: default.
        lower: physical bound.
        upper: physical bound.
        prior_std: one standard deviation of what is known beforehand, same unit; of the logarithm
            where that is what is searched.
        logarithmic: searched by its logarithm.
    """

    name: str
    unit: str
    value: float
    lower: float
    upper: float
    prior_std: float
    logarithmic: bool = False


STRENGTH = Parameter(name="strength", unit="1", value=1.0, lower=0.0, upper=10.0, prior_std=1.0)
"""Of an effect of ageing: a factor on all it does; 0 is absence."""


class Effect(Protocol):
    """A physical effect, switched on by its id in `pack.toml`.

    Attributes:
        id: stable name, e.g. `self_heating`.
        parameters: its numbers.
        balance: what it adds to which balance, in words.
        equation: LaTeX.
        source: reference.
        signature: what it leaves in a recording, in words.
    """

    @property
    def id(self) -> str: ...  # noqa: D102
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...  # noqa: D102
    @property
    def balance(self) -> str: ...  # noqa: D102
    @property
    def equation(self) -> str: ...  # noqa: D102
    @property
    def source(self) -> str: ...  # noqa: D102
    @property
    def signature(self) -> str: ...  # noqa: D102
