"""Every effect of the library as a truth in PyBaMM's own terms, by one size that can be made fit.

A flavour chooses among the forms that the same effect has in packs: its sign, or which of its
numbers is off. `make(pack, size, flavour)` gives the pack with the effect in it, `number(size,
flavour)` what a number of the twin's own effect then is in truth.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import exp

from proof.simulated.cell_truth import CellTruth
from proof.simulated.configured import Configured
from proof.simulated.pack_truth import PackTruth

CELL_V = 3.7  # at which a leak's current is stated
HEAT_W_m2_K = 12.0
Make = Callable[[PackTruth, float, int], PackTruth]
Number = Callable[[float, int], tuple[str, float, str]]

DIFFUSIVITY_E, CONDUCTIVITY_E = (
    "Electrolyte diffusivity [m2.s-1]",
    "Electrolyte conductivity [S.m-1]",
)
EXCHANGE = ("Negative electrode exchange-current density [A.m-2]",
            "Positive electrode exchange-current density [A.m-2]")  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """How to put it in.

    Attributes:
        id: as in the contract, or `foreign:<kind>`.
        make: the pack with it.
        number: name, value and unit of the twin's; None if it depends on more than the size.
        meaning: of the size.
        guess: a size that gives some tens of millivolts.
        least: and
        most: what is physical.
    """

    id: str
    make: Make
    meaning: str
    guess: float
    least: float
    most: float
    number: Number | None = None


def true_value_in(
    told: Configured, effect: str, size: float, flavour: int
) -> tuple[str, float, str] | None:
    """The twin's number in that pack; None also where the pack decides what the effect is."""
    heated = effect == "cold_pack" and told.heat_transfer_W_m2_K is not None
    full = effect == "initial_soc" and told.start_soc + size >= 1.0
    number = ALL[effect].number
    return None if heated or full or number is None else number(size, flavour)


def _signed(size: float, flavour: int) -> float:
    return -size if flavour % 2 else size


def _kelvin(size: float, flavour: int) -> float:
    return size if flavour % 4 == 3 else -size


def _is(name: str, unit: str, value: Callable[[float], float] = float) -> Number:
    """A number that its size tells."""
    return lambda size, flavour: (name, value(size), unit)  # noqa: ARG005


def _is_of(name: str, unit: str, value: Callable[[float], float] = float) -> Number:
    """A number that its size with its sign tells."""
    return lambda size, flavour: (name, value(_signed(size, flavour)), unit)


def in_cells(pack: PackTruth, **changed: object) -> PackTruth:
    """`pack` with other fields of all its cells."""
    return replace(pack, cells=replace(pack.cells, **changed))  # type: ignore[arg-type]


def _slowed(pack: PackTruth, names: tuple[str, ...], size: float) -> PackTruth:
    factors = tuple((name, exp(-size)) for name in names)
    return in_cells(pack, scaled=(*pack.cells.scaled, *factors))


def self_heating(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Less or more of it than 12 W/m2/K; the twin is isothermal."""
    del flavour
    return in_cells(pack, heat_transfer_W_m2_K=HEAT_W_m2_K / size)


def cold_pack(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Colder, at times warmer; where heat is on, only the air or only the start may be off."""
    kelvin = _kelvin(size, flavour)
    cells: CellTruth = pack.cells
    isothermal = cells.heat_transfer_W_m2_K is None
    start = kelvin if isothermal or flavour % 3 != 1 else 0.0
    ambient = kelvin if isothermal or flavour % 3 != 0 else 0.0
    return in_cells(pack, start_K=cells.start_K + start, ambient_K=cells.ambient_K + ambient)


def electrolyte_transport(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Diffusivity and conductivity, or one of them."""
    names = ((DIFFUSIVITY_E, CONDUCTIVITY_E), (DIFFUSIVITY_E,), (CONDUCTIVITY_E,))[flavour % 3]
    return _slowed(pack, names, size)


def solid_diffusion_negative(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Slower in the particles."""
    del flavour
    return _slowed(pack, ("Negative particle diffusivity [m2.s-1]",), size)


def solid_diffusion_positive(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Slower in the particles."""
    del flavour
    return _slowed(pack, ("Positive particle diffusivity [m2.s-1]",), size)


def reaction_kinetics(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Of both electrodes, or one."""
    return _slowed(pack, (EXCHANGE, EXCHANGE[:1], EXCHANGE[1:])[flavour % 3], size)


def ocv_hysteresis(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """In both electrodes, or one, as a charge has left them."""
    return in_cells(pack, half_gap_V=((size, size), (size, 0.0), (0.0, size))[flavour % 3])


def plating_stripping(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Lithium metal on the negative particles at the start."""
    del flavour
    return in_cells(pack, plated_mol_m3=size)


def lithium_inventory_loss(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """A share of the cyclable lithium."""
    del flavour
    return in_cells(pack, lithium_left=1.0 - size)


def active_material_loss_negative(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Lost when full."""
    del flavour
    return in_cells(pack, material_left=(1.0 - size, pack.cells.material_left[1]))


def active_material_loss_positive(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Lost when full."""
    del flavour
    return in_cells(pack, material_left=(pack.cells.material_left[0], 1.0 - size))


def film_resistance(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """On the negative particles."""
    del flavour
    return in_cells(pack, film_ohm_m2=size)


def series_resistance(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Of the pack, shared by its cells."""
    del flavour
    share = size * pack.parallel / pack.series
    return in_cells(pack, contact_ohm=pack.cells.contact_ohm + share)


def weak_cell(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """One of the series holds less, starts emptier, or is badly connected."""
    if flavour % 3 == 0:
        return replace(pack, weak_area=1.0 - size)
    if flavour % 3 == 1:
        return replace(pack, weak_soc=-size)
    return replace(pack, weak_ohm=0.02 * size)


def initial_soc(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """Emptier, or fuller where there is room."""
    fuller = flavour % 2 == 1 and pack.cells.soc + size < 1.0
    return in_cells(pack, soc=pack.cells.soc + (size if fuller else -size))


def leakage(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """A resistor across the pack."""
    del flavour
    return replace(pack, leak_S=size / (CELL_V * pack.series))


def fault(name: str, *, both_signs: bool) -> Make:
    """One of `faults.py`."""

    def make(pack: PackTruth, size: float, flavour: int) -> PackTruth:
        signed = _signed(size, flavour) if both_signs else size
        return replace(pack, faults=(*pack.faults, (name, signed)))

    return make


def _effect(
    make: Make, meaning: str, sizes: tuple[float, float, float], number: Number | None = None
) -> Effect:
    guess, least, most = sizes
    return Effect(
        id=getattr(make, "__name__", ""), make=make, number=number, meaning=meaning, guess=guess,
        least=least, most=most,
    )  # fmt: skip


SLOWER = _is("diffusivity_factor", "1", lambda size: exp(-size))
LOST = _is("lost", "1")

LIBRARY: Mapping[str, Effect] = {
    e.id: e
    for e in (
        _effect(self_heating, "12 W/m2/K over the transfer to the air", (0.3, 0.003, 100.0),
                _is("heat_transfer_W_m2_K", "W/m2/K", lambda size: HEAT_W_m2_K / size)),
        _effect(cold_pack, "K", (2.0, 0.05, 35.0),
                lambda size, flavour: ("start_offset_K", _kelvin(size, flavour), "K")),
        _effect(electrolyte_transport, "-ln of the factor", (0.2, 0.005, 2.0)),
        _effect(solid_diffusion_negative, "-ln of the factor", (0.5, 0.01, 4.0), SLOWER),
        _effect(solid_diffusion_positive, "-ln of the factor", (0.3, 0.01, 4.0), SLOWER),
        _effect(reaction_kinetics, "-ln of the factor", (0.25, 0.005, 4.0)),
        _effect(ocv_hysteresis, "half the distance of the branches, V", (0.006, 2e-4, 0.1)),
        _effect(plating_stripping, "mol/m3 at the start", (800.0, 1.0, 8000.0),
                _is("initial_mol_m3", "mol/m3")),
        _effect(lithium_inventory_loss, "share of the lithium", (0.03, 5e-4, 0.35), LOST),
        _effect(active_material_loss_negative, "share of the material", (0.05, 5e-4, 0.45), LOST),
        _effect(active_material_loss_positive, "share of the material", (0.03, 5e-4, 0.45), LOST),
        _effect(film_resistance, "Ohm m2", (1.3e-3, 1e-5, 0.2), _is("negative_ohm_m2", "Ohm m2")),
        _effect(series_resistance, "Ohm of the pack", (1.4e-3, 1e-5, 0.2),
                _is("resistance_ohm", "Ohm")),
        _effect(weak_cell, "share, state of charge, or 0.02 Ohm", (0.06, 1e-3, 0.45)),
        _effect(initial_soc, "state of charge", (8e-3, 2e-4, 0.35),
                _is_of("offset", "1", lambda signed: -signed)),
        _effect(leakage, "A at 3.7 V a cell", (0.3, 5e-3, 8.0)),
        *(
            Effect(
                id=name, make=fault(name, both_signs=signs), number=number, meaning=meaning,
                guess=guess, least=least, most=most,
            )
            for name, signs, number, meaning, guess, least, most in (
                ("current_gain", True, _is_of("gain", "1", lambda signed: 1.0 / (1.0 + signed)),
                 "relative", 0.02, 1e-4, 0.5),
                ("current_offset", True, _is_of("offset_A", "A", lambda signed: -signed),
                 "A", 0.3, 5e-3, 10.0),
                ("sensor_lag", False, _is("lag_s", "s"), "s", 0.1, 2e-3, 3.0),
                ("clock_shift", True, _is_of("shift_s", "s"), "s", 0.1, 2e-3, 3.0),
                ("voltage_gain", True, _is_of("gain", "1", lambda signed: 1.0 + signed),
                 "relative", 1.6e-3, 1e-5, 0.2),
            )
        ),
    )
}  # fmt: skip
"""By the ids of the contract."""


def _double_layer(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    del flavour
    return in_cells(pack, double_layer_F_m2=size)


def _ocp_feature(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    """The positive electrode is another material in part of its range."""
    return in_cells(pack, feature_V=_signed(size, flavour))


def _unseen_consumer(pack: PackTruth, size: float, flavour: int) -> PackTruth:
    del flavour
    return replace(pack, consumer_A=size)


FOREIGN: Mapping[str, Effect] = {
    f"foreign:{kind}": Effect(
        id=f"foreign:{kind}", make=make, meaning=meaning, guess=guess, least=least, most=most
    )
    for kind, make, meaning, guess, least, most in (
        ("double_layer", _double_layer, "F/m2", 5.0, 0.05, 1000.0),
        ("ocp_feature", _ocp_feature, "V", 0.02, 5e-4, 0.3),
        ("unseen_consumer", _unseen_consumer, "A in horizontal motion", 3.0, 0.05, 25.0),
        *(
            (name, fault(name, both_signs=signs), meaning, guess, least, most)
            for name, signs, meaning, guess, least, most in (
                ("loose_connector", False, "Ohm", 3e-3, 5e-5, 0.2),
                ("resistance_of_charge", False, "Ohm", 6e-3, 5e-5, 0.2),
                ("current_limiter", False, "Ohm above 20 A", 8e-3, 5e-5, 0.3),
                ("voltage_drift", True, "V", 0.03, 1e-3, 0.5),
                ("adc_nonlinearity", True, "V", 0.03, 1e-3, 0.5),
            )
        ),
    )
}
"""Effects that the library does not have and cannot put together."""

ALL: Mapping[str, Effect] = {**LIBRARY, **FOREIGN}

PAIRS = (
    ("cold_pack", "series_resistance"),
    ("cold_pack", "initial_soc"),
    ("self_heating", "series_resistance"),
    ("self_heating", "current_gain"),
    ("initial_soc", "series_resistance"),
    ("initial_soc", "current_gain"),
    ("weak_cell", "cold_pack"),
    ("weak_cell", "current_offset"),
    ("lithium_inventory_loss", "film_resistance"),
    ("lithium_inventory_loss", "series_resistance"),
    ("active_material_loss_negative", "film_resistance"),
    ("active_material_loss_positive", "reaction_kinetics"),
    ("electrolyte_transport", "initial_soc"),
    ("solid_diffusion_negative", "series_resistance"),
    ("solid_diffusion_positive", "voltage_gain"),
    ("reaction_kinetics", "clock_shift"),
    ("sensor_lag", "series_resistance"),
    ("ocv_hysteresis", "cold_pack"),
    ("plating_stripping", "cold_pack"),
    ("leakage", "series_resistance"),
)
"""What comes together in packs, or looks alike: old and cold, a start and a sensor that are off."""
