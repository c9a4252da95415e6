"""Values of the parameters -> numbers of the kernel, and the derivative of that.

What follows from the free parameters (`parameters.py`) does so through three equations, solved for
w = (positive stoichiometry when full, that of one electrode when empty, state of charge):
  U_p(w0) - U_n(x_full)           = voltage when full
  U_p(y_empty) - U_n(x_empty)     = voltage when empty, for w1, the steeper electrode's of the two
  U_p - U_n at state of charge w2 = open-circuit voltage at the start of the test
The last beside the curve by the start states of hysteresis, where the cell has it; not by the
temperature of the test, so that one off the reference begins beside that voltage by its entropy.
Full and empty are at the rest voltages that they have in the cell to start from (for most files the
cut-offs). The rest is explicit. The derivative of w is that of an implicit function.
"""

from array import array
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from twin.at_rest import OVERFULL, open_circuit_V
from twin.bumps import Bumped, bump_names
from twin.calibrate.parameters import (
    ACTIVATIONS,
    EMPTY_ENDS,
    HALF_FULL,
    MOUNT,
    START_V,
    WARMING,
    middle_diffusivity_m2_s,
)
from twin.constants import FARADAY_C_mol
from twin.effects.ocv_hysteresis import off_equilibrium_V
from twin.pack import Pack
from twin.windows import SIDES

FloatArray = npt.NDArray[np.float64]
Potential = Callable[[float], float]

EDGE = 1e-4  # of stoichiometry: no window goes closer to full or empty
START = tuple(f"{side}.start" for side in SIDES)
FILLERS = slice(2, 4)
"""Where the fillers stand among what is derived."""


class Infeasible(ValueError):
    """No cell has these values; the text says why, `by` how far from possible [V]."""

    def __init__(self, text: str, *, by: float) -> None:
        self.by = by
        super().__init__(text)


@dataclass(frozen=True, slots=True, eq=False)
class Mapped:
    """Values as the kernel takes them, for one test.

    Attributes:
        numbers: by the kernel's names.
        derived: values of `CellMap.derived`.
        by_values: (directions, values) d number / d value, see `CellMap.directions`.
        derived_by_values: (derived, values) likewise.
    """

    numbers: dict[str, float]
    derived: FloatArray
    by_values: FloatArray
    derived_by_values: FloatArray


class CellMap:
    """Of the cell of `pack` and the parameters `names`, START_V the last of them.

    MOUNT may be among them: the cooling of a test over that of all.

    Attributes:
        names: the kernel's numbers that change.
        directions: those the derivatives are for: `names` but for windows and state of charge,
            which only say where a test starts, then the two stoichiometries there.
        derived: what Table I lists and follows from the others.
    """

    def __init__(self, pack: Pack, names: tuple[str, ...]) -> None:
        self._names, self._ends_V = names, full_and_empty_V(pack)
        follows = next(name for name in EMPTY_ENDS if name not in names)
        self.derived = (
            "positive.stoichiometry_min", follows, "negative.filler", "positive.filler",
            "negative.specific_area_m2_m3", "positive.specific_area_m2_m3",
        )  # fmt: skip
        v, w = ca.SX.sym("v", len(names)), ca.SX.sym("w", 3)
        value = dict(zip(names, ca.vertsplit(v), strict=True))
        numbers, derived, start = _expressions(pack, value, w)
        self.names = tuple(numbers)
        kept = [n for n in numbers if "stoichiometry" not in n and n != "initial_soc"]
        self.directions = (*kept, *START)
        moving = ca.vertcat(*(numbers[n] for n in kept), *start)
        shown = ca.vertcat(*derived)
        g = ca.vertcat(*_equations(pack, value, w))
        by_v = -ca.solve(ca.jacobian(g, w), ca.jacobian(g, v))
        slopes = [ca.jacobian(f, v) + ca.jacobian(f, w) @ by_v for f in (moving, shown)]
        self._numbers = ca.Function("numbers", [v, w], [ca.vertcat(*numbers.values()), shown])
        self._slopes = ca.Function("slopes", [v, w], [ca.densify(s) for s in slopes])
        x = ca.SX.sym("x")
        self._ocp_V = {
            side: ca.Function("ocp", [x, v], [_potential_V(pack, side, x, value)]) for side in SIDES
        }
        self._start_V = {
            side: ca.Function("start", [x, v], [_start_V(pack, side, x, value)]) for side in SIDES
        }

    def __call__(self, values: FloatArray) -> tuple[dict[str, float], FloatArray]:
        """Kernel's numbers and what is derived; Infeasible if no window fits."""
        return self._at(values, self._solved(values))

    def mapped(self, values: FloatArray) -> Mapped:
        """The same with derivatives."""
        w = self._solved(values)
        numbers, derived = self._at(values, w)
        by_values, derived_by_values = (m.full() for m in self._slopes(values, w))
        return Mapped(numbers, derived, by_values, derived_by_values)

    def _at(self, values: FloatArray, w: FloatArray) -> tuple[dict[str, float], FloatArray]:
        numbers, derived = self._numbers(values, w)
        given = dict(zip(self.names, numbers.full().ravel().tolist(), strict=True))
        return given, derived.full().ravel()

    def rest_V(self, values: FloatArray, soc: float) -> float:
        """Voltage at the start at a state of charge; `values` without START_V."""
        whole = np.append(values, 0.0)
        x, y = self._windows(whole)
        return self._rest_V(whole, x, y)(soc)

    def _rest_V(self, values: FloatArray, x: list[float], y: list[float]) -> Potential:
        """[V] of the cell at the start, of its state of charge."""
        negative, positive = (_of_float(self._start_V[side], values) for side in SIDES)
        return lambda soc: (
            positive(y[1] + soc * (y[0] - y[1])) - negative(x[1] + soc * (x[0] - x[1]))
        )

    def _potentials(self, values: FloatArray) -> tuple[Potential, Potential]:
        """[V] of the negative and the positive electrode, of stoichiometry."""
        negative, positive = (_of_float(self._ocp_V[side], values) for side in SIDES)
        return negative, positive

    def _windows(self, values: FloatArray) -> tuple[list[float], list[float]]:
        """Stoichiometries (full, empty) of the negative and the positive electrode."""
        value = dict(zip(self._names, values.tolist(), strict=True))
        negative, positive = self._potentials(values)
        full = value["negative.stoichiometry_max"]
        limit_V = negative(full) + self._ends_V[0]
        y_full = _root(lambda s: positive(s) - limit_V, EDGE, 1 - EDGE)
        if EMPTY_ENDS[0] in value:
            empty = value[EMPTY_ENDS[0]]
            limit_V = negative(empty) + self._ends_V[1]
            y_empty = _root(lambda s: positive(s) - limit_V, EDGE, 1 - EDGE)
        else:
            y_empty = value[EMPTY_ENDS[1]]
            limit_V = positive(y_empty) - self._ends_V[1]
            empty = _root(lambda s: negative(s) - limit_V, EDGE, 1 - EDGE)
        x, y = [full, empty], [y_full, y_empty]
        if x[0] <= x[1]:
            raise Infeasible("the negative window is empty", by=x[1] - x[0])
        if y[0] >= y[1]:
            raise Infeasible("the positive window is empty", by=y[0] - y[1])

        return x, y

    def _solved(self, values: FloatArray) -> FloatArray:
        x, y = self._windows(values)
        start_V = float(values[-1])
        rest_V = self._rest_V(values, x, y)
        soc = _root(lambda s: start_V - rest_V(s), 0.0, OVERFULL)
        empty = y[1] if EMPTY_ENDS[0] in self._names else x[1]
        return np.array([y[0], empty, soc])


def start_names(
    directions: tuple[str, ...], initial_soc: float
) -> tuple[tuple[str, ...], FloatArray]:
    """What the kernel calls each direction, and how much a unit of it moves that.

    The stoichiometry where a test starts is moved by the end of the window that weighs more.
    """
    full = initial_soc > 0.5
    weight = initial_soc if full else 1.0 - initial_soc
    ends = {
        START[0]: f"negative.stoichiometry_{'max' if full else 'min'}",
        START[1]: f"positive.stoichiometry_{'min' if full else 'max'}",
    }
    share = [weight if name in ends else 1.0 for name in directions]
    return tuple(ends.get(name, name) for name in directions), np.array(share)


def full_and_empty_V(pack: Pack) -> tuple[float, float]:
    """Rest voltages at which the windows end."""
    return open_circuit_V(pack.cell, 1.0), open_circuit_V(pack.cell, 0.0)


def _of_float(function: ca.Function, values: FloatArray) -> Potential:
    """`function(x, values)` of x, by a buffer: a call takes 1 us instead of 60, and roots many."""
    buffer: Any
    buffer, evaluate = function.buffer()
    at, given, found = array("d", [0.0]), array("d", values.tolist()), array("d", [0.0])
    buffer.set_arg(0, memoryview(at))
    buffer.set_arg(1, memoryview(given))
    buffer.set_res(0, memoryview(found))

    def potential_V(x: float, _kept: tuple[Any, ...] = (buffer, given)) -> float:
        at[0] = x
        evaluate()
        return found[0]

    return potential_V


def _potential_V(pack: Pack, side: str, x: ca.SX, value: dict[str, ca.SX]) -> ca.SX:
    """Of an electrode, its bumps being as high as `value` has them."""
    ocp_V = getattr(pack.cell, side).ocp_V
    plain_V: ca.SX = ocp_V(x)
    if isinstance(ocp_V, Bumped):
        plain_V += ocp_V.raised_V(x, [value[name] for name in ocp_V.names(side)])
    return plain_V


def _start_V(pack: Pack, side: str, x: ca.SX, value: dict[str, ca.SX]) -> ca.SX:
    """The same at the start of a test: beside it where the pack has hysteresis."""
    plain_V = _potential_V(pack, side, x, value)
    if not pack.hysteretic:
        return plain_V
    numbers, name = pack.cell_parameters(), f"ocv_hysteresis.{side}"
    branches = pack.cell.hysteresis(side) or ca.SX(numbers[f"{name}_amplitude_V"])
    h = ca.SX(numbers[f"{name}_start"])
    return plain_V + off_equilibrium_V(getattr(pack.cell, side).ocp_V, branches, x, h)


def _root(falling: Callable[[float], float], low: float, high: float) -> float:
    """Where a falling function vanishes; Infeasible if not between `low` and `high`."""
    at_low, at_high = falling(low), falling(high)
    if at_low < 0 or at_high > 0:
        raise Infeasible("no stoichiometry has that potential", by=max(-at_low, at_high))
    return float(brentq(falling, low, high, xtol=1e-13, rtol=1e-13))


def _windows(value: dict[str, ca.SX], w: ca.SX) -> dict[str, tuple[ca.SX, ca.SX]]:
    """Least and largest stoichiometry of both electrodes."""
    x_empty, y_empty = (value.get(name, w[1]) for name in EMPTY_ENDS)
    return {
        "negative": (x_empty, value["negative.stoichiometry_max"]),
        "positive": (w[0], y_empty),
    }


def _equations(pack: Pack, value: dict[str, ca.SX], w: ca.SX) -> list[ca.SX]:
    windows, soc = _windows(value, w), w[2]
    (x_empty, x_full), (full, empty) = windows["negative"], windows["positive"]
    full_V, empty_V = full_and_empty_V(pack)

    def cell_V(of: Callable[..., ca.SX], *at: ca.SX) -> ca.SX:
        negative_V, positive_V = (
            of(pack, side, s, value) for side, s in zip(SIDES, at, strict=True)
        )
        return positive_V - negative_V

    start = x_empty + soc * (x_full - x_empty), empty + soc * (full - empty)
    return [
        cell_V(_potential_V, x_full, full) - full_V,
        cell_V(_potential_V, x_empty, empty) - empty_V,
        cell_V(_start_V, *start) - value[START_V],
    ]


def _expressions(
    pack: Pack, value: dict[str, ca.SX], w: ca.SX
) -> tuple[dict[str, ca.SX], list[ca.SX], list[ca.SX]]:
    """The kernel's numbers, what is derived, and the stoichiometries at the start."""
    base = pack.cell_parameters()
    windows, soc = _windows(value, w), w[2]
    numbers: dict[str, ca.SX] = {}
    fillers = []
    for side in SIDES:
        own, solid = _electrode(pack, side, value, windows[side])
        numbers |= own
        fillers.append(1 - value[f"{side}.porosity"] - solid)
    numbers |= _pores("separator", value, base)
    more = (*ACTIVATIONS, *WARMING, *bump_names(pack.cell))
    for name in (
        "electrolyte.initial_concentration_mol_m3", "electrolyte.diffusivity_factor",
        "series_resistance_ohm", *(name for name in more if name in value),
    ):  # fmt: skip
        numbers[name] = value[name]
    if MOUNT in value:
        numbers[WARMING[1]] *= value[MOUNT]
    numbers["initial_soc"] = soc
    areas = [numbers[f"{side}.specific_area_m2_m3"] for side in SIDES]
    (x_empty, x_full), (full, empty) = windows["negative"], windows["positive"]
    start = [x_empty + soc * (x_full - x_empty), empty + soc * (full - empty)]
    return numbers, [full, w[1], *fillers, *areas], start


def _electrode(
    pack: Pack, side: str, value: dict[str, ca.SX], window: tuple[ca.SX, ca.SX]
) -> tuple[dict[str, ca.SX], ca.SX]:
    """Its numbers, and the volume share of active material."""
    base, radius = pack.cell_parameters(), value[f"{side}.particle_radius_m"]
    volume_m3 = base["area_m2"] * base[f"{side}.thickness_m"]
    most_C = FARADAY_C_mol * base[f"{side}.max_concentration_mol_m3"] * volume_m3
    solid = value["capacity_C"] / ((window[1] - window[0]) * most_C)
    exchange = value[f"{side}.exchange_current_A_m2"]
    diffusivity = value[f"{side}.diffusivity_m2_s"] / middle_diffusivity_m2_s(pack, side)
    own = {
        "stoichiometry_min": window[0],
        "stoichiometry_max": window[1],
        "particle_radius_m": radius,
        "specific_area_m2_m3": 3 * solid / radius,
        "conductivity_S_m": value[f"{side}.conductivity_S_m"],
        "rate_constant_mol_m2_s": exchange / (HALF_FULL * FARADAY_C_mol),
        "diffusivity_factor": diffusivity,
    }
    numbers = {f"{side}.{name}": number for name, number in own.items()}
    return numbers | _pores(side, value, base), solid


def _pores(layer: str, value: dict[str, ca.SX], base: dict[str, float]) -> dict[str, ca.SX]:
    """Porosity, and transport efficiency by the exponent of the cell to start from."""
    exponent = np.log(base[f"{layer}.transport_efficiency"]) / np.log(base[f"{layer}.porosity"])
    porosity = value[f"{layer}.porosity"]
    efficiency = porosity ** float(exponent)
    return {f"{layer}.porosity": porosity, f"{layer}.transport_efficiency": efficiency}
