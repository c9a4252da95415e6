"""P2D and single-particle model against the Melasta SLPBA842124HV, a measured 6.55 Ah LiPo pouch.

The cell is not the built-in one; the built-in LiPo is fitted to it with as little as there is:
  its C/10 discharge, taken for the open circuit (6 mV of it are not): capacity (coated area), the
    four ends of the stoichiometry windows (the positive coating as thick as they ask for), and what
    is left is added to the positive open-circuit potential;
  its 1C discharge: one number, so that the mean error is 0, for each model its own, that a model
    may not be blamed for what a constant mends. Either a series resistance, the same at all
    temperatures, or a factor on the reaction rates of both electrodes, whose resistance falls as
    the cell warms.
2C, 5C and 9.1C are predicted. The temperature is that measured (thermocouple T2).
Recordings: SINTEF, published by the Battery Data Alliance (battery-data-format).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import casadi as ca
import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, least_squares

from benchmarks.real_cells.__main__ import SHARED
from proof.recorded import melasta
from proof.recorded.measured import NotHere, RealTest
from proof.recorded.replay import Model, errors, follow
from twin.bpx_function import Table
from twin.builtin import load_cell
from twin.cell import Cell, Electrode
from twin.constants import FARADAY_C_mol
from twin.effects import SeriesResistance
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

EMPTY_V = 3.0
ROWS = 150  # of the corrected potential


def fitted_cell(slow: RealTest) -> tuple[Cell, float]:
    """The built-in LiPo with the slow test's balance and potential; its misfit before that [V]."""
    cell = load_cell("lipo_2200")
    share = 1 - slow.drawn_C / slow.drawn_C[-1]
    sides = cell.negative, cell.positive
    u_n, u_p = (_potential(side) for side in sides)

    def windows(ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        return ends[0] + share * (ends[1] - ends[0]), ends[3] - share * (ends[3] - ends[2])

    def misfit(ends: FloatArray) -> FloatArray:
        x_n, x_p = windows(ends)
        return u_p(x_p) - u_n(x_n) - slow.voltage_V

    first = [v for s in sides for v in (s.stoichiometry_min, s.stoichiometry_max)]
    fit = least_squares(misfit, first, bounds=([0.001, 0.6, 0.02, 0.6], [0.05, 0.98, 0.5, 0.98]))
    (n_low, n_high, p_low, p_high), (x_n, x_p) = fit.x, windows(fit.x)
    rows = np.linspace(p_low, p_high, ROWS)
    wanted = np.interp(rows, x_p, slow.voltage_V + u_n(x_n))
    positive = replace(
        cell.positive,
        stoichiometry_min=float(p_low),
        stoichiometry_max=float(p_high),
        ocp_V=Corrected(cell.positive.ocp_V, Table(tuple(rows), tuple(wanted - u_p(rows)))),
    )
    negative = replace(
        cell.negative, stoichiometry_min=float(n_low), stoichiometry_max=float(n_high)
    )
    area_m2 = slow.drawn_C[-1] / _per_area_C_m2(negative)
    ratio = _per_area_C_m2(negative) / _per_area_C_m2(positive)
    positive = replace(positive, thickness_m=cell.positive.thickness_m * ratio)
    varied = replace(
        cell, negative=negative, positive=positive, area_m2=area_m2,
        nominal_capacity_C=float(slow.drawn_C[-1]), lower_cut_off_V=EMPTY_V, upper_cut_off_V=4.4,
    )  # fmt: skip
    return varied, float(np.sqrt(np.mean(fit.fun**2)))


@dataclass(frozen=True, slots=True)
class Corrected:
    """A function plus a table, whose ends go on as they are."""

    plain: Callable[[ca.SX], ca.SX]
    added: Table

    def __call__(self, x: ca.SX) -> ca.SX:
        """Element by element."""
        inside = ca.fmin(ca.fmax(x, self.added.x[0]), self.added.x[-1])
        return self.plain(x) + self.added(inside)


def _potential(side: Electrode) -> Callable[[FloatArray], FloatArray]:
    x = ca.SX.sym("x")
    function = ca.Function("U", [x], [side.ocp_V(x)])
    return lambda values: np.asarray(function(values[None, :])).ravel()


def _per_area_C_m2(side: Electrode) -> float:
    """Charge of the stoichiometry window per coated area."""
    solid = side.specific_area_m2_m3 * side.particle_radius_m / 3
    window = side.stoichiometry_max - side.stoichiometry_min
    held = FARADAY_C_mol * side.max_concentration_mol_m3
    return float(held * solid * side.thickness_m * window)


def tables(models: Mapping[str, Model]) -> str:
    """Errors of each model in each test; a reason where there is no recording."""
    try:
        tests = melasta.tests(SHARED)
    except NotHere as e:
        return f"{e}: the measured cell is left out"
    cell, misfit_V = fitted_cell(tests["C/10"])
    n, p = cell.negative, cell.positive
    lines = [
        f"windows {n.stoichiometry_min:.4f}..{n.stoichiometry_max:.4f} and "
        f"{p.stoichiometry_min:.4f}..{p.stoichiometry_max:.4f}, positive coating "
        f"{1e6 * p.thickness_m:.1f} um, {cell.area_m2:.3f} m2; C/10 before the correction "
        f"{1e3 * misfit_V:.1f} mV rms",
        "model | test | rms mV | max mV | mean mV | Ah at 3 V | measured Ah",
    ]
    for way, (make, low, high) in WAYS.items():
        for name, model in models.items():
            number = _balanced(model, partial(make, cell), tests["1C"], (low, high))
            lines.append(f"{name}: {way} {number:.3g}")
            for test_name, test in tests.items():
                answer_V = follow(model, make(cell, number), test)
                lines.append(f"{name} | {test_name} | {_row(answer_V, test)}")
    return "\n".join(lines)


def with_resistance(cell: Cell, ohm: float) -> Pack:
    """One cell and a resistance in series."""
    return Pack(cell=cell, effects=(SeriesResistance(resistance_ohm=ohm),))


def with_rates(cell: Cell, factor: float) -> Pack:
    """One cell whose reactions run `factor` times as fast."""
    negative, positive = (
        replace(side, rate_constant_mol_m2_s=factor * side.rate_constant_mol_m2_s)
        for side in (cell.negative, cell.positive)
    )
    return Pack(cell=replace(cell, negative=negative, positive=positive))


WAYS: dict[str, tuple[Callable[[Cell, float], Pack], float, float]] = {
    "series resistance [Ohm]": (with_resistance, 0.0, 0.02),
    "factor on reaction rates": (with_rates, 0.05, 2.0),
}
"""The number fitted to 1C: what it is -> what it makes of a cell, least and most."""


def _balanced(
    model: Model, make: Callable[[float], Pack], test: RealTest, bounds: tuple[float, float]
) -> float:
    """The number for which the mean error of `test` is 0."""

    def mean_V(number: float) -> float:
        answer_V = follow(model, make(number), test)
        return float(np.mean(answer_V - test.voltage_V[: answer_V.size]))

    return float(brentq(mean_V, *bounds, rtol=1e-3))


def _row(answer_V: FloatArray, test: RealTest) -> str:
    e, ah = errors(answer_V, test), test.drawn_C[[answer_V.size - 1, -1]] / 3600
    return f"{e.rms:.1f} | {e.largest:.1f} | {e.mean:+.1f} | {ah[0]:.2f} | {ah[1]:.2f}"
