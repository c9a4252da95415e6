"""What may be calibrated: name, unit, bounds, prior and scale of each parameter of a cell.

The list is Table I of the calibration this twin is measured against: ends of the stoichiometry
windows (4), particle radii (2), conductivities of the solids (2), porosities (3), filler
fractions (2), specific surface areas (2), diffusivities (3), salt at the start, reference exchange
currents (2). They are not independent of each other:
  the windows end where the cell rests at given voltages, two equations for four numbers;
  what an electrode holds is (1 - porosity - filler) max_concentration, and both hold the capacity
    Q between the ends of their windows, so filler follows from Q, window and porosity;
  spheres of radius R have the area a = 3 (1 - porosity - filler) / R.
Free here are: of the two windows' ends when empty that in the flatter potential, the negative
window's when full, Q, the radii and porosities. The other ends, fillers and areas follow and are
reported beside them. Beyond the table: a resistance in series (tabs, leads), the open-circuit
voltage at the start of each test, and, where the tests were warm and cold, the activation energies,
and where it was measured how a cell warms, its heat capacity and how it cools, in several mounts
and tests also how each does.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import exp, log

import casadi as ca

from twin.bumps import bump_names
from twin.calibrate.reference import ReferenceTest
from twin.calibrate.resample import Sampled
from twin.cell import Cell
from twin.constants import FARADAY_C_mol
from twin.effects import SelfHeating
from twin.effects.activation_energies import NUMBERS, ACTIVATION_STD_J_mol
from twin.pack import Pack


class Scale(Enum):
    """In which a parameter is searched, and its prior is a normal distribution."""

    LINEAR = "linear"
    LOG = "logarithmic"


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One that may be calibrated.

    Attributes:
        name: as results list it.
        unit: of its value.
        mean: of the prior, in `unit`; where a search begins, and its value where it is not free.
        std: of the prior on its scale: in `unit`, or relative.
        lower: its least value.
        upper: its largest value.
        scale: of prior and search.
    """

    name: str
    unit: str
    mean: float
    std: float
    lower: float
    upper: float
    scale: Scale = Scale.LINEAR

    def value(self, coordinate: float) -> float:
        """At so many standard deviations of the prior from its mean."""
        if self.scale is Scale.LOG:
            return self.mean * exp(self.std * coordinate)
        return self.mean + self.std * coordinate

    def slope(self, coordinate: float) -> float:
        """Change of the value per coordinate."""
        return self.std * (self.value(coordinate) if self.scale is Scale.LOG else 1.0)

    def coordinate(self, value: float) -> float:
        """Inverse of `value`."""
        if self.scale is Scale.LOG:
            return log(value / self.mean) / self.std
        return (value - self.mean) / self.std

    @property
    def bounds(self) -> tuple[float, float]:
        """As coordinates."""
        return self.coordinate(self.lower), self.coordinate(self.upper)


EMPTY_ENDS = ("negative.stoichiometry_min", "positive.stoichiometry_max")
HALF_FULL = 0.5  # sqrt(x (1 - x)) at x = 1/2, where the exchange current is quoted
BUMP_V, BUMP_MOST_V = 0.01, 0.05  # height of a bump on a potential: standard deviation, most
RESISTANCE_V = 0.02  # across the resistance in series at 1C: standard deviation of its prior

# suffix -> standard deviation and largest factor either way, on the logarithmic scale
FACTORS = {
    "particle_radius_m": (log(1.5), 4.0),
    "conductivity_S_m": (log(2.0), 30.0),
    "diffusivity_m2_s": (log(2.0), 30.0),
    "exchange_current_A_m2": (log(2.5), 30.0),
}
UNITS = {
    "particle_radius_m": "m", "conductivity_S_m": "S/m", "diffusivity_m2_s": "m2/s",
    "exchange_current_A_m2": "A/m2",
}  # fmt: skip

ACTIVATIONS = tuple(NUMBERS.values())
ACTIVATION_MOST_J_mol = 100e3
START_V = "start_V"
WARMING = ("heat_capacity_J_K", "heat_transfer_W_m2_K")
MOUNT, MOUNT_STD, MOUNT_MOST = "mount", 0.15, 3.0
"""How a cell cools in one mount, over how it does on the whole.

At rest cells of an LG M50 lose all but 1/e of their warmth in 472 to 484 s in one mount, 540 and
605 to 616 s in two others (`proof.recorded.lg_m50.cools_s`): 0.11 in the logarithm."""
OWN, TEST_STD = "cooling", 0.05
"""Likewise in each of several tests in one mount: the heat that a twin misses is not the same.

At rest cells of an LG M50 cool alike in one mount to 1 % in the logarithm (0 to 25 degC, as above),
under load their thermocouples ask for cooling from 38 to 41 W/(m2 K) in one, 24 to 26 in another.
With one number a mount 0.5C at 0 degC, not fitted, is missed by 15.5 mV, with this by 10.8."""
MIXTURE_mol_m3, MIXTURES_m2_s = 1000.0, (1.77e-10, 3.22e-10)
"""What was measured of diffusivities in carbonate mixtures with so much LiPF6, at 25 degC.

Nyman, Behm and Lindbergh (2008), doi:10.1016/j.electacta.2008.04.023, and Valoen and Reimers
(2005), doi:10.1149/1.1872737; between them Ecker et al. (2015), doi:10.1149/2.0551509jes (2.59e-10)
and Landesfeind and Gasteiger (2019), doi:10.1149/2.0571912jes (2.89e-10)."""
MIXTURES_J_mol = {
    "electrolyte.diffusivity_activation_J_mol": (17.0e3, 33.5e3),
    "electrolyte.conductivity_activation_J_mol": (13.5e3, 17.1e3),
}
"""Activation energies of the same between 0 and 25 degC: of diffusion by Landesfeind and Gasteiger
(EC:EMC 3:7) and by Valoen and Reimers, of conduction by the former and by Ecker et al. (both of
whom also lie between: 17.1 of diffusion, 14.0 of conduction)."""
LEAST_PORES = 0.7
"""Of the porosity of the cell to start from. Measured coatings have 0.25 (negative of the LG M50:
Chen et al. 2020, doi:10.1149/1945-7111/ab9050) to 0.33 (negative of a Kokam: Ecker et al.)."""
MIXTURE_FACTOR = 1.5  # beyond them either way, and from the cell to start from
MOST_TRANSFER_W_m2_K = 1000.0  # of the prior: a pack file states no more


def cell_table(
    pack: Pack, *, warm_and_cold: bool = False, warming: bool = False
) -> tuple[Parameter, ...]:
    """The parameters of the cell of `pack`, its numbers as prior means.

    `warm_and_cold` says that the tests tell how they change with temperature, `warming` how the
    cell warms.
    """
    numbers, cell = pack.cell_parameters(), pack.cell
    window = cell.negative.stoichiometry_min, cell.negative.stoichiometry_max
    middle = (window[0] + window[1]) / 2
    capacity_C = window_capacity_C(pack)
    out = [
        Parameter(name="negative.stoichiometry_max", unit="", mean=window[1], std=0.05,
                  lower=max(middle, window[1] - 0.25), upper=0.995),
        _empty_end(pack),
        Parameter(name="capacity_C", unit="C", mean=capacity_C, std=0.1, scale=Scale.LOG,
                  lower=capacity_C / 1.6, upper=capacity_C * 1.6),
    ]  # fmt: skip
    for side in ("negative", "positive"):
        for suffix, unit in UNITS.items():
            out.append(_by_factor(f"{side}.{suffix}", unit, reference(pack, side, suffix)))
    out += [_porosity(f"{layer}.porosity", numbers) for layer in ("negative", "separator")]
    out.append(_porosity("positive.porosity", numbers))
    salt = numbers["electrolyte.initial_concentration_mol_m3"]
    rate_A = capacity_C / 3600
    out += [
        _salt_diffusivity(cell),
        Parameter(name="electrolyte.initial_concentration_mol_m3", unit="mol/m3", mean=salt,
                  std=0.1, lower=0.6 * salt, upper=1.7 * salt, scale=Scale.LOG),
        Parameter(name="series_resistance_ohm", unit="ohm",
                  mean=numbers["series_resistance_ohm"], std=RESISTANCE_V / rate_A,
                  lower=0.0, upper=numbers["series_resistance_ohm"] + 5 * RESISTANCE_V / rate_A),
    ]  # fmt: skip
    if warm_and_cold:
        out += [_activation(name, numbers[name]) for name in ACTIVATIONS]
    for heating in (e for e in pack.effects if isinstance(e, SelfHeating) and warming):
        capacity_J_K = numbers["heat_capacity_J_K"]
        transfer = max(heating.heat_transfer_W_m2_K, SelfHeating.parameters[0].lower)
        out += [
            Parameter(name="heat_capacity_J_K", unit="J/K", mean=capacity_J_K, std=0.15,
                      lower=capacity_J_K / 2, upper=2 * capacity_J_K, scale=Scale.LOG),
            Parameter(name="heat_transfer_W_m2_K", unit="W/(m2 K)", mean=transfer, std=log(2.5),
                      lower=transfer / 30, upper=min(30 * transfer, MOST_TRANSFER_W_m2_K),
                      scale=Scale.LOG),
        ]  # fmt: skip
    return (*out, *bump_parameters(cell))


def bump_parameters(cell: Cell) -> tuple[Parameter, ...]:
    """Heights of the bumps in `cell`; none in most cells."""
    return tuple(
        Parameter(name=name, unit="V", mean=0.0, std=BUMP_V, lower=-BUMP_MOST_V, upper=BUMP_MOST_V)
        for name in bump_names(cell)
    )


def _empty_end(pack: Pack) -> Parameter:
    """The end of the window, when empty, of the electrode whose potential is flatter there."""
    ends = pack.cell.negative.stoichiometry_min, pack.cell.positive.stoichiometry_max
    x, slopes = ca.SX.sym("x"), []
    for electrode, end in zip((pack.cell.negative, pack.cell.positive), ends, strict=True):
        slope = ca.Function("slope", [x], [ca.jacobian(electrode.ocp_V(x), x)])
        slopes.append(abs(float(slope(end))))
    flatter = int(slopes[1] < slopes[0])
    return Parameter(name=EMPTY_ENDS[flatter], unit="", mean=ends[flatter], std=0.05,
                     lower=max(1e-3, ends[flatter] - 0.25),
                     upper=min(0.995, ends[flatter] + 0.25))  # fmt: skip


def start_parameters(tests: Sequence[Sampled], pack: Pack) -> tuple[Parameter, ...]:
    """The open-circuit voltage at the start of each test, as its first samples show it."""
    lower, upper = pack.cell.lower_cut_off_V + 1e-3, pack.cell.upper_cut_off_V + 0.02
    return tuple(
        Parameter(
            name=f"{START_V}:{test.name}",
            unit="V",
            mean=(mean := min(max(test.start_V, lower + 1e-3), upper - 1e-3)),
            std=test.start_sigma_V,
            lower=max(lower, mean - 5 * test.start_sigma_V),
            upper=min(upper, mean + 5 * test.start_sigma_V),
        )
        for test in tests
    )


def mount_name(test: Sampled | ReferenceTest) -> str:
    """As its parameter has it: that of the test, if the mount is its own."""
    return f"{MOUNT}:{test.mount or test.name}"


def own_name(test: Sampled | ReferenceTest) -> str:
    """As the parameter of a test that shares its mount has it."""
    return f"{OWN}:{test.name}"


def mount_parameters(tests: Sequence[Sampled]) -> tuple[Parameter, ...]:
    """The cooling in each mount over that in all, then in each test over that in its mount.

    Of one mount alone, and of a test alone in one, it is 1: how the cell cools says it.
    """
    mounts = Counter(mount_name(t) for t in tests)
    stds = dict.fromkeys(mounts, MOUNT_STD) if len(mounts) > 1 else {}
    stds |= {own_name(t): TEST_STD for t in tests if mounts[mount_name(t)] > 1}
    return tuple(
        Parameter(name=name, unit="", mean=1.0, std=std,
                  lower=1.0 / MOUNT_MOST, upper=MOUNT_MOST, scale=Scale.LOG)
        for name, std in stds.items()
    )  # fmt: skip


def of_tests(name: str) -> bool:
    """A parameter belongs to one test, or to one mount, not to the cell."""
    return name.startswith((f"{MOUNT}:", f"{OWN}:", f"{START_V}:"))


def window_capacity_C(pack: Pack) -> float:
    """Charge of one cell between the ends of its windows (mean of both electrodes)."""
    numbers, total = pack.cell_parameters(), 0.0
    for side in ("negative", "positive"):
        low, high = (numbers[f"{side}.stoichiometry_{end}"] for end in ("min", "max"))
        solid = numbers[f"{side}.specific_area_m2_m3"] * numbers[f"{side}.particle_radius_m"] / 3
        holds = FARADAY_C_mol * numbers[f"{side}.max_concentration_mol_m3"] * solid
        total += holds * numbers["area_m2"] * numbers[f"{side}.thickness_m"] * (high - low)
    return total / 2


def reference(pack: Pack, side: str, suffix: str) -> float:
    """The number of the cell to start from.

    The diffusivity is that of the middle of the window: where it is a function of stoichiometry,
    all of it is scaled. The exchange current is that of half-filled particles in electrolyte as
    mixed.
    """
    if suffix == "diffusivity_m2_s":
        return middle_diffusivity_m2_s(pack, side)
    if suffix == "exchange_current_A_m2":
        rate = pack.cell_parameters()[f"{side}.rate_constant_mol_m2_s"]
        return HALF_FULL * FARADAY_C_mol * rate
    return pack.cell_parameters()[f"{side}.{suffix}"]


def middle_diffusivity_m2_s(pack: Pack, side: str) -> float:
    """Of the solid of the cell to start from, in the middle of its window."""
    electrode = pack.cell.negative if side == "negative" else pack.cell.positive
    middle = (electrode.stoichiometry_min + electrode.stoichiometry_max) / 2
    return float(ca.evalf(electrode.diffusivity_m2_s(ca.SX(middle))))


def _by_factor(name: str, unit: str, mean: float) -> Parameter:
    std, most = FACTORS[name.split(".")[1]]
    return Parameter(name=name, unit=unit, mean=mean, std=std, lower=mean / most,
                     upper=mean * most, scale=Scale.LOG)  # fmt: skip


def _salt_diffusivity(cell: Cell) -> Parameter:
    """Not what no electrolyte has: a cell at its limit would be short of salt before its time."""
    own_m2_s = float(ca.evalf(cell.electrolyte.diffusivity_m2_s(ca.SX(MIXTURE_mol_m3))))
    least, most = (measured / own_m2_s for measured in MIXTURES_m2_s)
    return Parameter(name="electrolyte.diffusivity_factor", unit="", mean=1.0, std=log(1.4),
                     lower=min(least, 1.0) / MIXTURE_FACTOR, upper=max(most, 1.0) * MIXTURE_FACTOR,
                     scale=Scale.LOG)  # fmt: skip


def _activation(name: str, mean: float) -> Parameter:
    """Of the salt not what no electrolyte has, as its diffusivity."""
    lower, upper = 0.0, max(ACTIVATION_MOST_J_mol, 1.5 * mean)
    if name in MIXTURES_J_mol:
        least, most = MIXTURES_J_mol[name]
        lower, upper = min(least, mean) / MIXTURE_FACTOR, max(most, mean) * MIXTURE_FACTOR
    return Parameter(name=name, unit="J/mol", mean=mean, std=ACTIVATION_STD_J_mol,
                     lower=lower, upper=upper)  # fmt: skip


def _porosity(name: str, numbers: dict[str, float]) -> Parameter:
    mean = numbers[name]
    return Parameter(name=name, unit="", mean=mean, std=0.04, lower=LEAST_PORES * mean,
                     upper=min(0.5 * (1 + mean), 1.6 * mean))  # fmt: skip
