"""The least squares of a fit to one flight: what is free, and what it is worth.

Free are numbers of the pack that a pilot or the twin's files cannot know of this very pack on this
day. Coordinates q are standard deviations of the prior from its mean, as in `objective.py`. The
derivatives are differences: with a kernel that is compiled anyway they cost a simulation a number,
and the exact ones (`sensitivity.py`) would cost more time to build than all of the fit.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.calibrate.parameters import Parameter, Scale
from twin.effects import (
    AnyEffect,
    ElectrolyteTransport,
    ReactionKinetics,
    SelfHeating,
    SeriesResistance,
    SolidDiffusionNegative,
    SolidDiffusionPositive,
)
from twin.load import Load
from twin.pack import Pack
from twin.population import population
from twin.simulate import changeable

FloatArray = npt.NDArray[np.float64]

DIFFERENCE = 1e-3  # standard deviations of the prior: a thousandth of what would be noticed
LONGEST_STEP_S = 2.0  # of an averaged load
PULSE_S, PULSE_STEPS = 10.0, 50
# Of the priors. A label holds for a new pack; one that is used has lost up to a fifth.
LABEL_STD, UNKNOWN_STD = 0.15, 0.7  # of the logarithm of the capacity
ENDURANCE_S = 600.0  # at the median current: within a factor of two most multirotors fly so long
REST_SOC_STD, NO_REST_SOC_STD = 0.05, 0.2  # 40 mV a cell: another chemistry, a voltage divider
COLD_STD_K = 10.0
WIND_STD = 0.5  # of the logarithm: from still air in a frame to the wash of the propellers
LEADS_OHM_AH = 0.02  # a cell of 1 Ah: plugs, leads, tabs, and what a worn cell has gained
MOST_LEADS = 20.0  # times that


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What was known of the pack before the fit, beyond the values themselves.

    Attributes:
        soc: a rest before take-off showed the voltage without load.
        capacity: a label says it.
        temperature: measured; else it is one of the free numbers, and the air's with it.
        scale: of the current; if it is doubtful, a label says little of what the pack holds in the
            amperes of the log.
        charge: what was drawn is as the current says, but for its scale; if not, the capacity
            cannot be told.
    """

    soc: bool
    capacity: bool
    temperature: bool
    scale: bool
    charge: bool


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number of the pack that is free.

    Attributes:
        parameter: its name, prior and bounds.
        put: (pack, value) -> the pack with it.
    """

    parameter: Parameter
    put: Callable[[Pack, float], Pack]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flown:
    """A flight as it is compared: averages over short spans.

    Attributes:
        load: (n,) current.
        voltage_V: (n,) of the pack; NaN where it was not measured.
        in_air: (n,) bool, between take-off and landing.
    """

    load: Load
    voltage_V: FloatArray
    in_air: npt.NDArray[np.bool_]

    def averaged(self, most: int) -> "Flown":
        """At most about `most` samples; a gap stays one.

        300 s of flight averaged over 0.25 s (0.5 s, 1 s) change the simulated voltage of four cells
        by 0.3 mV (0.7 mV, 1.5 mV) RMS.
        """
        time_s = self.load.time_s
        if time_s.size <= most:
            return self
        width_s = float(time_s[-1] - time_s[0]) / most
        _, place = np.unique(((time_s - time_s[0]) / width_s).astype(int), return_inverse=True)
        seen = np.isfinite(self.voltage_V)
        with np.errstate(invalid="ignore"):  # spans in which nothing was measured: 0 / 0
            voltage_V = _means(np.where(seen, self.voltage_V, 0.0), place) / _means(seen, place)
        load = replace(
            self.load, time_s=_means(time_s, place), current_A=_means(self.load.current_A, place),
            longest_step_s=LONGEST_STEP_S,
        )  # fmt: skip
        return Flown(load=load, voltage_V=voltage_V, in_air=_means(self.in_air, place) > 0.5)

    @property
    def median_A(self) -> float:
        """In the air."""
        return float(np.median(self.load.current_A[self.in_air]))


def _means(values: npt.NDArray[np.float64 | np.bool_], place: npt.NDArray[np.intp]) -> FloatArray:
    return np.bincount(place, weights=values) / np.bincount(place)


def quantities(pack: Pack, flown: Flown, known: Known) -> tuple[Quantity, ...]:
    """All that is free, with what is known of it beforehand; the pack's numbers are the means."""
    capacity_C = pack.rated_C if known.capacity else flown.median_A * ENDURANCE_S
    out = [_soc(pack, known)]
    if known.charge:
        std = LABEL_STD if known.capacity and known.scale else UNKNOWN_STD
        out.append(_capacity(capacity_C, std))
    out.append(_resistance(pack, capacity_C))
    if not known.temperature:
        out.append(_temperature(pack))
    out += [_heat_transfer(e) for e in pack.effects if isinstance(e, SelfHeating)]
    return (*out, *(_factor(*factor) for factor in FACTORS))


def _soc(pack: Pack, known: Known) -> Quantity:
    parameter = Parameter(
        name="initial_soc", unit="", mean=min(pack.initial_soc, 1.0),
        std=REST_SOC_STD if known.soc else NO_REST_SOC_STD, lower=0.0, upper=1.0,
    )  # fmt: skip
    return Quantity(parameter, lambda p, value: replace(p, initial_soc=min(max(value, 0.0), 1.0)))


def _capacity(capacity_C: float, std: float) -> Quantity:
    parameter = Parameter(
        name="capacity_C", unit="C", mean=capacity_C, std=std, lower=capacity_C / 10,
        upper=capacity_C * 10, scale=Scale.LOG,
    )  # fmt: skip
    return Quantity(parameter, lambda p, value: replace(p, capacity_C=value))


def _resistance(pack: Pack, capacity_C: float) -> Quantity:
    std = LEADS_OHM_AH * pack.series / (capacity_C / 3600)
    parameter = Parameter(name="series_resistance_ohm", unit="Ohm", mean=0.0, std=std,
                          lower=0.0, upper=MOST_LEADS * std)  # fmt: skip
    return Quantity(parameter, lambda p, value: _with(p, SeriesResistance(resistance_ohm=value)))


def _temperature(pack: Pack) -> Quantity:
    parameter = Parameter(
        name="initial_K", unit="K", mean=pack.initial_K, std=COLD_STD_K,
        lower=pack.initial_K - 4 * COLD_STD_K, upper=pack.initial_K + 3 * COLD_STD_K,
    )  # fmt: skip
    return Quantity(parameter, lambda p, value: replace(p, initial_K=value))


def _heat_transfer(heating: SelfHeating) -> Quantity:
    mean = max(heating.heat_transfer_W_m2_K, SelfHeating.parameters[0].lower)
    parameter = Parameter(
        name="heat_transfer_W_m2_K", unit="W/(m2 K)", mean=mean, std=WIND_STD, lower=mean / 10,
        upper=mean * 10, scale=Scale.LOG,
    )  # fmt: skip

    def put(pack: Pack, value: float) -> Pack:
        others = tuple(e for e in pack.effects if not isinstance(e, SelfHeating))
        return replace(pack, effects=(replace(heating, heat_transfer_W_m2_K=value), *others))

    return Quantity(parameter, put)


Made = Callable[[float], tuple[AnyEffect, ...]]
FACTORS: tuple[tuple[str, float, float, Made], ...] = (
    (
        "reaction_kinetics", 0.7, 50.0,
        lambda f: (ReactionKinetics(negative_factor=f, positive_factor=f),),
    ),
    (
        "electrolyte_transport", 0.4, 10.0,
        lambda f: (ElectrolyteTransport(diffusivity_factor=f, conductivity_factor=f),),
    ),
    (
        "solid_diffusion", 0.7, 50.0,
        lambda f: (
            SolidDiffusionNegative(diffusivity_factor=f),
            SolidDiffusionPositive(diffusivity_factor=f),
        ),
    ),
)  # fmt: skip
"""Name, standard deviation of the logarithm, largest factor either way, and what it makes: of both
electrodes at once, for a flight does not tell them apart."""


def _factor(name: str, std: float, most: float, made: Made) -> Quantity:
    parameter = Parameter(
        name=name, unit="", mean=1.0, std=std, lower=1 / most, upper=most, scale=Scale.LOG
    )
    return Quantity(parameter, lambda p, value: replace(p, effects=(*p.effects, *made(value))))


def changed(pack: Pack, quantities: Sequence[Quantity], q: FloatArray) -> Pack:
    """`pack` with the values that the coordinates `q` (k,) stand for."""
    for quantity, coordinate in zip(quantities, q.tolist(), strict=True):
        pack = quantity.put(pack, quantity.parameter.value(coordinate))
    return pack


def _with(pack: Pack, effect: AnyEffect) -> Pack:
    return replace(pack, effects=(*pack.effects, effect))


class FlightProblem:
    """Measured minus simulated voltage of a flight; `polish` finds its least squares.

    Attributes:
        flown: what was measured.
        quantities: (k,) that are free.
        weights: (n,) one over the standard deviation `sigma_V` of a sample, 0 where there is none.
    """

    def __init__(
        self, pack: Pack, flown: Flown, quantities: Sequence[Quantity], sigma_V: float
    ) -> None:
        self._pack, self.flown = replace(pack, cell=pack.cell.beyond()), flown
        self.quantities = tuple(quantities)
        self._seen: dict[bytes, FloatArray] = {}
        self.weights = np.isfinite(flown.voltage_V) / sigma_V

    @property
    def series(self) -> int:
        """Cells in series."""
        return self._pack.series

    def without(self, samples: npt.NDArray[np.intp]) -> "FlightProblem":
        """The same, but that `samples` do not count."""
        other = copy(self)
        other.weights = self.weights.copy()
        other.weights[samples] = 0.0
        return other

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(k,) least and largest coordinates."""
        low, high = zip(*(p.parameter.bounds for p in self.quantities), strict=True)
        return np.array(low), np.array(high)

    def residuals_V(self, simulated_V: FloatArray) -> FloatArray:
        """(..., n) measured minus simulated; 0 where it was not measured."""
        return np.nan_to_num(self.flown.voltage_V - simulated_V, nan=0.0)

    def cost(self, q: FloatArray) -> float:
        """Half the sum of squares, prior included."""
        return float(self.costs(q[None])[0])

    def costs(self, points: FloatArray) -> FloatArray:
        """(m,) of points (m, k)."""
        residuals = self.residuals_V(self.voltages_V(points))
        rows = (self._rows(r, q) for r, q in zip(residuals, points, strict=True))
        return np.array([0.5 * float(r @ r) for r in rows])

    def linearised(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (n + k,) over their standard deviations, the prior's last; by q (n + k, k)."""
        points, steps = self.around(q)
        if (voltages := self._seen.get(q.tobytes())) is None:
            voltages = self._seen[q.tobytes()] = self.voltages_V(points)
        slopes = (voltages[1:] - voltages[0]).T / steps
        slopes[self.weights == 0] = 0.0
        rows = np.vstack([-slopes * self.weights[:, None], -np.eye(q.size)])
        return self._rows(self.residuals_V(voltages[0]), q), rows

    def pulses_ohm(self, points: FloatArray) -> FloatArray:
        """(m,) voltage lost per ampere after PULSE_S of the median current, at (m, k)."""
        current_A = self.flown.median_A
        load = Load(
            time_s=np.concatenate([[0.0], np.linspace(0.01, PULSE_S, PULSE_STEPS)]),
            current_A=np.concatenate([[0.0], np.full(PULSE_STEPS, current_A)]),
            ambient_K=self.flown.load.ambient_K,
        )
        voltages = self.voltages_V(points, load)
        return np.asarray((voltages[:, 0] - voltages[:, -1]) / current_A)

    def voltages_V(self, points: FloatArray, load: Load | None = None) -> FloatArray:
        """(m, n) simulated, at coordinates (m, k); what is not come to stands at the cut-off."""
        load = load or self.flown.load
        members = [self._numbers(q, load) for q in points]
        names = tuple(members[0])
        values = [list(member.values()) for member in members]
        simulated = population(self._pack, load, names, values).voltage_V
        return np.nan_to_num(simulated, nan=self._pack.cell.lower_cut_off_V * self._pack.series)

    def _numbers(self, q: FloatArray, load: Load) -> dict[str, float]:
        pack = changed(self._pack, self.quantities, q)
        return changeable(pack, load) | {"ambient_K": self.ambient_K(pack)}

    def ambient_K(self, pack: Pack) -> float:
        """As stated, moved with the start temperature where that is free."""
        return self.flown.load.ambient_K + pack.initial_K - self._pack.initial_K

    def around(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(1 + k, k) q and one step along each coordinate, inside the bounds; (k,) the steps."""
        _, high = self.bounds
        steps = np.where(q + DIFFERENCE <= high, DIFFERENCE, -DIFFERENCE)
        return np.vstack([q, q + np.diag(steps)]), steps

    def _rows(self, residuals_V: FloatArray, q: FloatArray) -> FloatArray:
        return np.concatenate([residuals_V * self.weights, -q])
