"""State of charge by the voltage at rest: of a cell, and of unlike cells in series."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from math import isfinite

import casadi as ca
from scipy.optimize import brentq

from twin.cell import Cell, Electrode, Hysteresis
from twin.effects.ocv_hysteresis import off_equilibrium_V
from twin.one_thread import SYMBOLS

OVERFULL = 1.1
"""Most of the window in one cell: a charger sees the pack, and some cells end above their share."""
PRECISE = 1e-10  # of state of charge: derivatives are taken by differences of 1e-6 and more


def open_circuit_V(cell: Cell, soc: float) -> float:
    """Open-circuit voltage at rest and reference temperature; soc of the stoichiometry window."""
    return _curve(cell)(soc)


def soc_at_rest(cell: Cell, voltage_V: float, most: float = 1.0) -> float:
    """State of charge, 0 to `most`, at which a cell rests at a voltage; the nearer end beyond."""
    most = most if isfinite(open_circuit_V(cell, most)) else 1.0
    return _root(lambda soc: open_circuit_V(cell, soc) - voltage_V, most)


def starts_V(
    cell: Cell, numbers: Mapping[str, float], temperature_K: float
) -> Callable[[float], float]:
    """Voltage [V] of state of charge: of `cell` as the kernel starts it, at rest.

    By the windows of the kernel's `numbers`, and off the curve of `open_circuit_V` by temperature,
    and by the start states of hysteresis where they have it.
    """
    warmer_K = temperature_K - numbers["reference_K"]

    def potential_V(side: str, charge: float) -> float:
        low, high = (numbers[f"{side}.stoichiometry_{end}"] for end in ("min", "max"))
        h = numbers.get(f"ocv_hysteresis.{side}_start")
        branches = None if h is None else cell.hysteresis(side)
        amplitude_V = numbers.get(f"ocv_hysteresis.{side}_amplitude_V", 0.0)
        of_side = _started(getattr(cell, side), branches)
        return of_side(low + charge * (high - low), warmer_K, h or 0.0, amplitude_V)

    return lambda soc: potential_V("positive", 1.0 - soc) - potential_V("negative", soc)


def soc_of_others(
    rests_V: Callable[[float], float], series: int, offsets: Sequence[float], mean_V: float
) -> float:
    """Charge of the equal cells of a pack that rests at `mean_V` a cell.

    Args:
        rests_V: of a cell at a state of charge.
        series: cells in series.
        offsets: state of charge of each cell that differs, minus that of the others; it is nowhere
            below empty or above OVERFULL.
        mean_V: of the pack's voltage.

    Returns:
        0 to OVERFULL, the nearer end where no such pack rests at that voltage.
    """
    equal = series - len(offsets)

    def beyond_V(soc: float) -> float:
        unlike = (min(max(soc + offset, 0.0), OVERFULL) for offset in offsets)
        return equal * rests_V(soc) + sum(rests_V(own) for own in unlike) - series * mean_V

    return _root(beyond_V, OVERFULL if isfinite(beyond_V(OVERFULL)) else 1.0)


def _root(rising: Callable[[float], float], most: float) -> float:
    """From 0 to `most`; the nearer end if there is none."""
    if rising(most) <= 0.0:
        return most
    return 0.0 if rising(0.0) >= 0.0 else float(brentq(rising, 0.0, most, xtol=PRECISE))


@lru_cache(maxsize=64)
def _curve(cell: Cell) -> Callable[[float], float]:
    """Open-circuit voltage [V] of state of charge; made once, since roots ask for it often."""
    n, p = cell.negative, cell.positive
    with SYMBOLS:
        soc = ca.SX.sym("soc")
        x = n.stoichiometry_min + soc * (n.stoichiometry_max - n.stoichiometry_min)
        y = p.stoichiometry_max - soc * (p.stoichiometry_max - p.stoichiometry_min)
        function = ca.Function("open_circuit", [soc], [p.ocp_V(y) - n.ocp_V(x)])
        del soc, x, y
    return lambda given: float(function(given))


@lru_cache(maxsize=64)
def _started(electrode: Electrode, branches: Hysteresis | None) -> Callable[..., float]:
    """Potential [V] of stoichiometry, K above the reference, h, and half the distance of branches.

    That is without effect where `branches` has them.
    """
    with SYMBOLS:
        x, warmer_K, h, amplitude_V = inputs = [ca.SX.sym(name) for name in ("x", "T", "h", "A")]
        plain_V = electrode.ocp_V(x) + warmer_K * electrode.entropic_V_K(x)
        beside_V = off_equilibrium_V(electrode.ocp_V, branches or amplitude_V, x, h)
        function = ca.Function("started", inputs, [plain_V + beside_V])
        del x, warmer_K, h, amplitude_V, inputs, plain_V, beside_V
    return lambda *given: float(function(*given))
