"""Constant currents around the motions' means, and the damage of one at any current between."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from twin.damage.cycles import Cycled

COUNT = 4
CLOSEST = 0.05  # of the mean: closer together they tell less than their errors


def currents_A(means_A: Sequence[float]) -> tuple[float, ...]:
    """COUNT round currents, evenly spaced, the first and the last around all `means_A`.

    Two significant steps a decade would be coarse: steps are 1, 2 or 5 times a power of ten.
    """
    low, high = min(means_A), max(means_A)
    for step in _steps(CLOSEST * low):
        first = step * np.floor(low / step + 1e-9)
        if first > 0 and first + (COUNT - 1) * step >= high:
            return tuple(float(first + k * step) for k in range(COUNT))
        if first <= 0:
            break
    return tuple(np.linspace(low * (1 - CLOSEST), high * (1 + CLOSEST), COUNT).tolist())


def _steps(least: float) -> list[float]:
    """Round ones from `least` on."""
    decade = int(np.floor(np.log10(least)))
    steps = [m * 10.0**d for d in range(decade, decade + 3) for m in (1, 2, 5)]
    return [s for s in steps if s >= least]


@dataclass(frozen=True, slots=True, eq=False)
class Baselines:
    """Cycled constant currents in rising order, two or more; the first is the reference."""

    cycled: tuple[Cycled, ...]

    @property
    def reference(self) -> Cycled:
        """What everything is normalised to."""
        return self.cycled[0]

    @property
    def currents_A(self) -> tuple[float, ...]:
        """Rising."""
        return tuple(c.waveform.mean_A for c in self.cycled)

    def at(self, current_A: float, number: Callable[[Cycled], float]) -> float:
        """`number` of a constant current, between those that were cycled; else NaN."""
        return float(self._through(number)(current_A))

    def near(self, current_A: float, number: Callable[[Cycled], float]) -> float:
        """The same, beyond them straight on."""
        through = self._through(number)
        inside = min(max(current_A, self.currents_A[0]), self.currents_A[-1])
        return float(through(inside) + through.derivative()(inside) * (current_A - inside))

    def _through(self, number: Callable[[Cycled], float]) -> PchipInterpolator:
        return PchipInterpolator(
            self.currents_A, [number(c) for c in self.cycled], extrapolate=False
        )
