"""`Cell`: the parameters of one cell, in the terms of BPX; numbers and functions, no equations."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import casadi as ca

BEYOND_V = 1.0
"""Who is empty too early can be compared: so far a cell goes on beyond its cut-offs."""
Function = Callable[[ca.SX], ca.SX]
"""Of stoichiometry, or of salt concentration [mol/m3], as a CasADi expression."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Electrode:
    """A porous electrode of equal spheres (BPX: negative or positive electrode).

    Attributes:
        thickness_m: of the coating.
        particle_radius_m: of the spheres.
        specific_area_m2_m3: active surface per volume of electrode, a = 3 eps_s / R.
        porosity: volume share of electrolyte.
        transport_efficiency: effective over bulk transport in the electrolyte (BPX B), eps ** 1.5
            for Bruggeman.
        conductivity_S_m: effective electronic conductivity of the solid.
        diffusivity_m2_s: of lithium in the solid, of stoichiometry, at the reference temperature.
        diffusivity_activation_J_mol: its activation energy.
        ocp_V: open-circuit potential against lithium, of stoichiometry.
        entropic_V_K: its derivative by temperature, of stoichiometry.
        max_concentration_mol_m3: lithium at stoichiometry 1.
        stoichiometry_min: negative: at 0 % charge; positive: at 100 %.
        stoichiometry_max: negative: at 100 % charge; positive: at 0 %.
        rate_constant_mol_m2_s: k in j0 = F k sqrt(c_e / c_e0 * x * (1 - x)) (BPX reaction rate).
        rate_activation_J_mol: its activation energy.
    """

    thickness_m: float
    particle_radius_m: float
    specific_area_m2_m3: float
    porosity: float
    transport_efficiency: float
    conductivity_S_m: float
    diffusivity_m2_s: Function
    diffusivity_activation_J_mol: float
    ocp_V: Function
    entropic_V_K: Function
    max_concentration_mol_m3: float
    stoichiometry_min: float
    stoichiometry_max: float
    rate_constant_mol_m2_s: float
    rate_activation_J_mol: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Separator:
    """The porous separator.

    Attributes:
        thickness_m: of the layer.
        porosity: volume share of electrolyte.
        transport_efficiency: effective over bulk transport (BPX B).
    """

    thickness_m: float
    porosity: float
    transport_efficiency: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Electrolyte:
    """A binary salt solution.

    Attributes:
        initial_concentration_mol_m3: of the salt, at rest.
        transference: of the cation, t+.
        conductivity_S_m: of concentration, bulk, at the reference temperature.
        conductivity_activation_J_mol: its activation energy.
        diffusivity_m2_s: of concentration, bulk, at the reference temperature.
        diffusivity_activation_J_mol: its activation energy.
    """

    initial_concentration_mol_m3: float
    transference: float
    conductivity_S_m: Function
    conductivity_activation_J_mol: float
    diffusivity_m2_s: Function
    diffusivity_activation_J_mol: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Hysteresis:
    """One electrode's branches of the open-circuit potential (BPX 1.x one-state form).

    Used where `effects/ocv_hysteresis.py` is switched on; elsewhere a cell follows `ocp_V` alone.

    Attributes:
        lithiation_V: OCP while lithium goes in.
        delithiation_V: OCP while lithium comes out.
        decay: decay constant of the hysteresis state while (de)lithiating, dimensionless.
    """

    lithiation_V: Function
    delithiation_V: Function
    decay: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One cell.

    Attributes:
        name: for reports.
        source: where the numbers come from.
        negative: electrode that lithium leaves on discharge.
        separator: between them.
        positive: electrode that lithium enters on discharge.
        electrolyte: fills all three.
        area_m2: total coated area (BPX electrode area times pairs in parallel).
        nominal_capacity_C: as the maker or the file states it.
        lower_cut_off_V: end of discharge.
        upper_cut_off_V: end of charge.
        reference_K: temperature of the numbers above.
        heat_capacity_J_K: of the whole cell.
        cooling_area_m2: outer surface.
        volume_m3: of the cell.
        negative_hysteresis: if the file has one.
        positive_hysteresis: if the file has one.
    """

    name: str
    source: str
    negative: Electrode
    separator: Separator
    positive: Electrode
    electrolyte: Electrolyte
    area_m2: float
    nominal_capacity_C: float
    lower_cut_off_V: float
    upper_cut_off_V: float
    reference_K: float
    heat_capacity_J_K: float
    cooling_area_m2: float
    volume_m3: float
    negative_hysteresis: Hysteresis | None = None
    positive_hysteresis: Hysteresis | None = None

    def beyond(self, lower_V: float = BEYOND_V, upper_V: float = BEYOND_V) -> "Cell":
        """One that goes on so far below its lower and above its upper cut-off; < 0: less far."""
        return replace(
            self,
            lower_cut_off_V=self.lower_cut_off_V - lower_V,
            upper_cut_off_V=self.upper_cut_off_V + upper_V,
        )

    def hysteresis(self, side: str) -> Hysteresis | None:
        """The branches of the `negative` or `positive` electrode, if the file has them."""
        return self.negative_hysteresis if side == "negative" else self.positive_hysteresis
