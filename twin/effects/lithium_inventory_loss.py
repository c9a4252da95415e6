"""Lithium that no longer cycles: the electrodes' stoichiometry windows have slipped."""

from dataclasses import dataclass
from typing import ClassVar

from twin.cell import Cell
from twin.effects.effect import Numbers, Parameter
from twin.windows import Windows


@dataclass(frozen=True, slots=True, kw_only=True)
class LithiumInventoryLoss:
    """A share of the cyclable lithium is gone before the recording begins.

    Full and empty are where the cell rests at the voltages it had there, with less lithium in it.

    Attributes:
        lost: that share.
    """

    lost: float = 0.0

    id: ClassVar[str] = "lithium_inventory_loss"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="lost", unit="1", value=0.0, lower=0.0, upper=0.5, prior_std=0.08),
    )
    balance: ClassVar[str] = "lithium in both electrodes at the start"
    equation: ClassVar[str] = (
        r"x Q_n + y Q_p = (1-\ell)\,(x_0 Q_n + y_0 Q_p),\quad U_p(y) - U_n(x) = V_\mathrm{full}"
    )
    source: ClassVar[str] = (
        "Birkl et al., J. Power Sources 341, 373 (2017), doi:10.1016/j.jpowsour.2016.12.011"
    )
    signature: ClassVar[str] = (
        "less capacity; the end of the discharge comes early with the negative electrode's rise, "
        "the beginning looks as before"
    )

    def changed(self, numbers: Numbers, cell: Cell) -> Numbers:
        """The kernel's numbers of one cell with this effect in it."""
        return numbers | Windows.of(numbers, cell).with_lithium(1.0 - self.lost).numbers()
