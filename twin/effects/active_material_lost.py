"""Active material that no longer takes part when the recording begins."""

from dataclasses import dataclass
from typing import ClassVar

from twin.cell import Cell
from twin.effects.effect import Numbers, Parameter
from twin.windows import Windows

LOST = Parameter(name="lost", unit="1", value=0.0, lower=0.0, upper=0.6, prior_std=0.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class _ActiveMaterialLost:
    """A share of the particles of one electrode is cut off, with the lithium of a full cell in it.

    What is left works at a higher rate and runs through a wider window; a full cell is as it was.

    Attributes:
        lost: that share.
    """

    lost: float = 0.0

    side: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = (LOST,)
    balance: ClassVar[str] = "active surface and lithium of one electrode at the start"
    equation: ClassVar[str] = r"a = (1-\ell)\,a_0,\quad Q = (1-\ell)\,Q_0"
    source: ClassVar[str] = (
        "Birkl et al., J. Power Sources 341, 373 (2017), doi:10.1016/j.jpowsour.2016.12.011"
    )
    signature: ClassVar[str] = (
        "features of that electrode's open-circuit curve come after less charge; more resistance"
    )

    def changed(self, numbers: Numbers, cell: Cell) -> Numbers:
        """The kernel's numbers of one cell with this effect in it."""
        left = 1.0 - self.lost
        area = f"{self.side}.specific_area_m2_m3"
        windows = Windows.of(numbers, cell).with_material(self.side, left)
        return numbers | windows.numbers() | {area: numbers[area] * left}


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveMaterialLossNegative(_ActiveMaterialLost):
    """Of the negative electrode."""

    id: ClassVar[str] = "active_material_loss_negative"
    side: ClassVar[str] = "negative"


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveMaterialLossPositive(_ActiveMaterialLost):
    """Of the positive electrode."""

    id: ClassVar[str] = "active_material_loss_positive"
    side: ClassVar[str] = "positive"
