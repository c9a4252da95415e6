"""What the tests of a calibration asked of the cell, and where a recording asks for more.

By how much a twin errs is known of its tests alone. A flight that draws more for longer, or begins
far colder, may be missed by more than a calibration states; by how much, nobody has measured.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.constants import ZERO_CELSIUS_K
from twin.load import Load

WINDOWS_S = (10.0, 600.0)
"""A pulse and a flight: what a current loses at once is told by the one, what gradients of salt and
lithium lose, and heat, by the other."""
MORE, BEYOND_K = 1.25, 8.0
"""Times the current, and beyond the temperatures, from which it is said. Over 8 K a rate with an
activation energy of 35 kJ/mol, as those of the built-in LG M50's graphite, changes by 1.5."""


@dataclass(frozen=True, slots=True)
class Asked:
    """Of one cell.

    Attributes:
        most_A: largest mean current over each of WINDOWS_S, discharge positive.
        coldest_K: surroundings in which a test began.
        warmest_K: likewise.
    """

    most_A: tuple[float, ...]
    coldest_K: float
    warmest_K: float


def asked_by(loads: Sequence[Load]) -> Asked:
    """By tests of one cell, at least one."""
    return Asked(
        most_A=tuple(max(most_A(load, window_s) for load in loads) for window_s in WINDOWS_S),
        coldest_K=min(load.ambient_K for load in loads),
        warmest_K=max(load.ambient_K for load in loads),
    )


def asked_from(written: Mapping[str, Any]) -> Asked:
    """As a fit file has it; KeyError, TypeError or ValueError if it is not that."""
    most = tuple(float(value) for value in written["most_A"])
    if len(most) != len(WINDOWS_S):
        raise ValueError(f"{len(most)} currents of {len(WINDOWS_S)}")
    ends_K = (float(written[name]) for name in ("coldest_K", "warmest_K"))
    return Asked(most, *ends_K)


def most_A(load: Load, window_s: float) -> float:
    """Largest mean of the current over so long [A]; nothing flows before and after the load."""
    t, drawn_C = load.time_s, load.drawn_C()
    ends = np.interp(t + window_s, t, drawn_C)
    return float(np.max(ends - drawn_C, initial=0.0)) / window_s


def beyond(asked: Asked, load: Load, *, parallel: int, initial_K: float) -> str:
    """What a pack asks beyond the tests of its cell, in a sentence; "" if nothing.

    Args:
        asked: by the tests.
        load: of the pack.
        parallel: cells side by side.
        initial_K: how warm it is at the start.
    """
    parts = []
    for window_s, tested_A in zip(WINDOWS_S, asked.most_A, strict=True):
        if (own_A := most_A(load, window_s) / parallel) > MORE * tested_A:
            parts.append(f"{own_A:.3g} A a cell over {window_s:g} s (tests: {tested_A:.3g} A)")
    if not asked.coldest_K - BEYOND_K <= initial_K <= asked.warmest_K + BEYOND_K:
        low, high = (k - ZERO_CELSIUS_K for k in (asked.coldest_K, asked.warmest_K))
        tests = f"{low:.0f}" if round(low) == round(high) else f"{low:.0f} to {high:.0f}"
        parts.append(f"a start at {initial_K - ZERO_CELSIUS_K:.0f} °C (tests: {tests} °C)")
    if not parts:
        return ""
    return (
        f"Beyond the tests that the cell was calibrated to: {', '.join(parts)}. By how much the "
        "twin errs there, nobody has measured: it may be more than the calibration states."
    )
