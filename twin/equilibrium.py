"""Cells in series at rest: where their lithium lies, and the charge between the cut-offs.

All of them carry the same charge, from where each one is now. Charger and flight controller see the
sum of the voltages alone, so the pack is full and empty where the mean of the cells reaches a
cut-off, and a cell may be beyond it; or where an electrode of some cell is full or empty.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from twin.constants import FARADAY_C_mol

FloatArray = npt.NDArray[np.float64]

EDGE = 1e-9  # of stoichiometry: potentials are infinite at 0 and at 1

OpenCircuit = Callable[[float, float], float]
"""(stoichiometry of the negative electrode, of the positive one) -> voltage of the cell [V]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inventory:
    """Lithium in the active particles of one cell [mol].

    Attributes:
        negative: in the negative electrode.
        positive: in the positive one.
        holds: what the active material of each can take.
    """

    negative: float
    positive: float
    holds: tuple[float, float]

    def positive_at(self, x: float) -> float:
        """Stoichiometry of the positive electrode with the negative one at `x`."""
        return (self.negative + self.positive - self.holds[0] * x) / self.holds[1]

    def bounds(self) -> tuple[float, float]:
        """Least and most stoichiometry of the negative electrode: one of the two has no more."""
        total = self.negative + self.positive
        low = max(EDGE, (total - self.holds[1] * (1 - EDGE)) / self.holds[0])
        return low, min(1 - EDGE, (total - self.holds[1] * EDGE) / self.holds[0])


@dataclass(frozen=True, slots=True)
class Window:
    """Rested cells from where the pack is empty to where it is full.

    Attributes:
        negative: (kinds, 2) stoichiometries there.
        positive: (kinds, 2)
        voltage_V: (kinds, 2) of each kind.
        charge_C: between them, of one string.
    """

    negative: FloatArray
    positive: FloatArray
    voltage_V: FloatArray
    charge_C: float


def window(
    cells: Sequence[Inventory],
    shares: FloatArray,
    open_circuit_V: OpenCircuit,
    cut_offs_V: tuple[float, float],
) -> Window:
    """Of kinds of cells in series.

    Args:
        cells: each kind as it is now.
        shares: (kinds,) of the places in the series, 1 together.
        open_circuit_V: of a cell.
        cut_offs_V: lower and upper, of the mean cell.
    """
    first = cells[0]
    slope = np.array([first.holds[0] / c.holds[0] for c in cells])  # dx over dx of the first
    now = np.array([c.negative / c.holds[0] for c in cells])
    offset = now - slope * now[0]

    def at(x: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Both stoichiometries and the voltage of each kind, the first at `x`."""
        negative = slope * x + offset
        positive = np.array([c.positive_at(float(n)) for c, n in zip(cells, negative, strict=True)])
        pairs = zip(negative.tolist(), positive.tolist(), strict=True)
        return negative, positive, np.array([open_circuit_V(*pair) for pair in pairs])

    def reaches(voltage_V: float) -> float:
        def above_V(x: float) -> float:
            return float(shares @ at(x)[2]) - voltage_V

        if above_V(low) >= 0:  # an electrode is empty or full before the voltage is reached
            return low
        return high if above_V(high) <= 0 else float(brentq(above_V, low, high, xtol=1e-14))

    bounds = (np.array([c.bounds() for c in cells]).T - offset) / slope
    low, high = float(bounds[0].max()), float(bounds[1].min())
    ends = [reaches(voltage_V) for voltage_V in cut_offs_V]
    negative, positive, voltage = (np.stack(v, axis=1) for v in zip(*map(at, ends), strict=True))
    return Window(negative, positive, voltage, FARADAY_C_mol * first.holds[0] * (ends[1] - ends[0]))
