"""Parameters as a person calls them, in the units a person uses."""

from collections.abc import Sequence
from dataclasses import dataclass

from reports.quantity import significant
from twin.bumps import HEIGHT, is_bump
from twin.calibrate.answer import Estimate, Verdict
from twin.calibrate.parameters import MOUNT, OWN, START_V, of_tests

# what a parameter's name ends in -> words, unit, factor from SI
QUANTITIES = {
    "particle_radius_m": ("particle radius", "µm", 1e6),
    "conductivity_S_m": ("solid conductivity", "S/m", 1.0),
    "diffusivity_m2_s": ("solid diffusivity", "10⁻¹⁴ m²/s", 1e14),
    "exchange_current_A_m2": ("exchange current", "A/m²", 1.0),
    "porosity": ("porosity", "", 1.0),
    "filler": ("filler share", "", 1.0),
    "specific_area_m2_m3": ("specific surface area", "1/µm", 1e-6),
    "diffusivity_factor": ("diffusivity (factor)", "", 1.0),
    "initial_concentration_mol_m3": ("salt concentration", "mol/m³", 1.0),
    "capacity_C": ("capacity", "Ah", 1 / 3600),
    "series_resistance_ohm": ("resistance in series", "mΩ", 1e3),
    "heat_capacity_J_K": ("heat capacity", "J/K", 1.0),
    "heat_transfer_W_m2_K": ("heat transfer to the air", "W/(m² K)", 1.0),
    "diffusivity_activation_J_mol": ("activation energy of diffusion", "kJ/mol", 1e-3),
    "rate_activation_J_mol": ("activation energy of the reaction", "kJ/mol", 1e-3),
    "conductivity_activation_J_mol": ("activation energy of conduction", "kJ/mol", 1e-3),
}
ENDS = {
    "negative.stoichiometry_max": "stoichiometry when full",
    "negative.stoichiometry_min": "stoichiometry when empty",
    "positive.stoichiometry_min": "stoichiometry when full",
    "positive.stoichiometry_max": "stoichiometry when empty",
}
LAYERS = ("", "negative", "separator", "positive", "electrolyte")
VERDICT_COLOUR = {
    Verdict.IDENTIFIED: "#00805d",
    Verdict.PARTLY: "#b87300",
    Verdict.PRIOR: "#767676",
    Verdict.UNTOLD: "#767676",
    Verdict.AT_BOUND: "#c04d00",
}


@dataclass(frozen=True, slots=True)
class Called:
    """What a parameter is called.

    Attributes:
        text: its name in words.
        unit: in which it is shown, "" for pure numbers.
        factor: from the unit of its estimate to that.
    """

    text: str
    unit: str
    factor: float

    def value(self, value: float) -> str:
        """The number as it is printed."""
        return significant(value * self.factor, 4)


def called(name: str, unit: str = "") -> Called:
    """The parameter `name`; one that is not known here keeps its name and `unit`."""
    if is_mount(name):
        kind, _, where = name.partition(":")
        over = "on the whole" if kind == MOUNT else "in its mount"
        return Called(f"cooling in {where}, over that {over}", "", 1.0)
    if is_start(name):
        return Called(f"rest voltage before {name.partition(':')[2]}", "V", 1.0)
    where, _, what = name.rpartition(".")
    if name in ENDS:
        return Called(f"{where}: {ENDS[name]}", "", 1.0)
    if is_bump(name):
        number = what.removeprefix(HEIGHT).partition("_")[0]
        return Called(f"{where}: open-circuit potential, bump {number} from full", "mV", 1e3)
    if what not in QUANTITIES:
        return Called(name, unit, 1.0)
    words, shown, factor = QUANTITIES[what]
    return Called(f"{where}: {words}" if where else words, shown, factor)


def phrase(name: str) -> str:
    """As it stands in a sentence."""
    return called(name).text.replace(": ", " ")


def in_order(names: Sequence[str]) -> list[int]:
    """Places of those of the cell, without bumps: of all of it, then layer by layer."""
    cell = [k for k, name in enumerate(names) if not (of_tests(name) or is_bump(name))]
    return sorted(cell, key=lambda k: _layer(names[k]))


def _layer(name: str) -> int:
    where = name.rpartition(".")[0]
    return LAYERS.index(where) if where in LAYERS else len(LAYERS)


def is_start(name: str) -> bool:
    """The state at the start of a test."""
    return name.startswith(START_V)


def is_mount(name: str) -> bool:
    """How the cell cools in a mount, or in a test."""
    return name.startswith((f"{MOUNT}:", f"{OWN}:"))


def with_unit(e: Estimate) -> str:
    """Value and unit."""
    c = called(e.name, e.unit)
    return f"{c.value(e.value)} {c.unit}".strip()


def word(verdict: Verdict) -> str:
    """One or two words."""
    return verdict.name.lower().replace("_", " ")
