"""Where a cell is full and empty after it lost lithium or active material."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
from scipy.optimize import brentq

from twin.cell import Cell, Function
from twin.constants import FARADAY_C_mol
from twin.equilibrium import Inventory
from twin.one_thread import SYMBOLS

SIDES = ("negative", "positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class Windows:
    """Stoichiometry windows of both electrodes and what they share.

    Attributes:
        full: stoichiometries (negative, positive) of a full cell at rest.
        empty: of an empty one.
        holds: lithium that each electrode can hold, any unit.
        ends_V: voltage at rest when full, when empty: it stays.
        cell: whose open-circuit potentials.
    """

    full: tuple[float, float]
    empty: tuple[float, float]
    holds: tuple[float, float]
    ends_V: tuple[float, float]
    cell: Cell

    @classmethod
    def of(cls, numbers: Mapping[str, float], cell: Cell) -> "Windows":
        """Of the kernel's `numbers` of one cell."""
        low, high = (
            tuple(numbers[f"{side}.stoichiometry_{end}"] for side in SIDES)
            for end in ("min", "max")
        )
        full, empty = (high[0], low[1]), (low[0], high[1])
        return cls(
            full=full,
            empty=empty,
            holds=(_holds(numbers, "negative"), _holds(numbers, "positive")),
            ends_V=(rest_V(cell, full), rest_V(cell, empty)),
            cell=cell,
        )

    def with_lithium(self, share: float) -> "Windows":
        """`share` of the lithium is left; ValueError if no such cell can be full and empty."""
        left = share * self._lithium(self.full)
        return replace(
            self, full=self._at(left, self.ends_V[0]), empty=self._at(left, self.ends_V[1])
        )

    def with_material(self, side: str, share: float) -> "Windows":
        """`share` of the particles of one electrode is left; the full cell is as it was."""
        n, p = self.holds
        kept = replace(self, holds=(n * share, p) if side == "negative" else (n, p * share))
        return replace(kept, empty=kept._at(kept._lithium(self.full), self.ends_V[1]))

    def numbers(self) -> dict[str, float]:
        """As the kernel takes them."""
        return {
            "negative.stoichiometry_min": self.empty[0],
            "negative.stoichiometry_max": self.full[0],
            "positive.stoichiometry_min": self.full[1],
            "positive.stoichiometry_max": self.empty[1],
        }

    def _lithium(self, at: tuple[float, float]) -> float:
        return at[0] * self.holds[0] + at[1] * self.holds[1]

    def _at(self, lithium: float, voltage_V: float) -> tuple[float, float]:
        """Stoichiometries at which a cell with so much lithium rests at a voltage.

        Or the emptiest there are, where an electrode is full or empty before it falls so low.
        """
        inventory = Inventory(negative=0.0, positive=lithium, holds=self.holds)

        def above_V(x: float) -> float:
            return rest_V(self.cell, (x, inventory.positive_at(x))) - voltage_V

        low, high = inventory.bounds()
        if low >= high or above_V(high) <= 0:
            raise ValueError(
                f"no cell with {lithium / self._lithium(self.full):.2f} of its lithium rests at "
                f"{voltage_V:.2f} V"
            )
        x = low if above_V(low) >= 0 else float(brentq(above_V, low, high, xtol=1e-14))
        return x, inventory.positive_at(x)


def _holds(numbers: Mapping[str, float], side: str) -> float:
    solid = numbers[f"{side}.specific_area_m2_m3"] * numbers[f"{side}.particle_radius_m"] / 3
    return numbers[f"{side}.max_concentration_mol_m3"] * solid * numbers[f"{side}.thickness_m"]


def window_C(numbers: Mapping[str, float]) -> float:
    """Charge of one cell from empty to full, by the kernel's `numbers` of it [C]."""
    width = numbers["negative.stoichiometry_max"] - numbers["negative.stoichiometry_min"]
    return FARADAY_C_mol * numbers["area_m2"] * _holds(numbers, "negative") * width


def rest_V(cell: Cell, at: tuple[float, float]) -> float:
    """Open-circuit voltage at stoichiometries (negative, positive), at reference temperature."""
    with SYMBOLS:
        positive_V, negative_V = _potential(cell.positive.ocp_V), _potential(cell.negative.ocp_V)
    return positive_V(at[1]) - negative_V(at[0])


@lru_cache(maxsize=32)
def _potential(ocp_V: Function) -> Callable[[float], float]:
    x = ca.SX.sym("x")
    f = ca.Function("ocp", [x], [ocp_V(x)])
    return lambda value: float(f(value))
