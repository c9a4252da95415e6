"""What ages the negative electrode's surface and both active materials, over one step.

Amounts are per volume of electrode; currents per active surface, oxidation positive. Every part of
a step that leaves the particles is counted where it ends up, so the sum of lithium does not change:
films and plated lithium by their own amounts, lithium in lost material as trapped.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import casadi as ca

from twin.constants import FARADAY_C_mol
from twin.effects import active_material_loss, cracking, mechanics, plating, porosity_change, sei
from twin.electrode import ElectrodeSymbols
from twin.kinetics import arrhenius
from twin.layout import Layout


@dataclass(frozen=True, slots=True)
class Begun:
    """What a step knows of the negative electrode before its equations are solved; all (n,).

    Attributes:
        film: SEI after the step [mol/m3].
        crack_film: SEI on cracks after the step [mol/m3].
        current_A_m2: that goes into both films.
        resistance_ohm_m2: of the outer film.
        decay_1_s: of plated to dead lithium.
        porosity: of the electrode.
    """

    film: ca.SX
    crack_film: ca.SX
    current_A_m2: ca.SX
    resistance_ohm_m2: ca.SX
    decay_1_s: ca.SX
    porosity: ca.SX

    def packed(self) -> ca.SX:
        """(n, fields) to hand on."""
        table: ca.SX = ca.horzcat(*(getattr(self, f.name) for f in fields(self)))
        return table

    @staticmethod
    def unpacked(table: ca.SX) -> "Begun":
        """What `packed` gave."""
        return Begun(*ca.horzsplit(table))


@dataclass(frozen=True, slots=True)
class DegradationSymbols:
    """The ageing of a cell with its symbols for the step."""

    layout: Layout
    negative: ElectrodeSymbols
    positive: ElectrodeSymbols
    p: Mapping[str, ca.SX]

    def surface_1_m(self, old: Mapping[str, ca.SX]) -> ca.SX:
        """(n,) active surface per volume of the negative electrode, losses taken off."""
        return self.negative("specific_area_m2_m3") * old["left_n"]

    @staticmethod
    def first_films(p: Mapping[str, Any]) -> tuple[Any, Any]:
        """Outer film and film on cracks at the start of life [mol/m3]; numbers or symbols."""
        whole_m3_m3 = p["negative.specific_area_m2_m3"] * p["sei.initial_thickness_m"]
        outer = whole_m3_m3 / p["sei.molar_volume_m3_mol"]
        return outer, outer * p["sei_on_cracks.initial_share"]

    def begin(self, old: Mapping[str, ca.SX], step_s: ca.SX) -> Begun:
        """Films and porosity of the step, from the state at its start."""
        p, area = self.p, self.surface_1_m(old)
        warm = arrhenius(p["sei.activation_J_mol"], old["temperature_K"], ca.SX(sei.MEASURED_K))
        permeability = (
            p["sei.solvent_concentration_mol_m3"] * p["sei.solvent_diffusivity_m2_s"] * warm
        )
        volume = p["sei.molar_volume_m3_mol"]
        rough = cracking.roughness(
            old["crack_m"], p["cracking.density_1_m2"], p["cracking.width_m"]
        )
        film, film_rate = sei.grown(
            old["film"], area, permeability * p["sei.strength"], volume, step_s
        )
        crack_film, crack_rate = sei.grown(
            old["crack_film"],
            area * (rough - 1),
            permeability * p["sei_on_cracks.strength"],
            volume,
            step_s,
        )
        thickness_m = old["film"] * volume / area
        resistance = p["sei.strength"] * p["sei.resistivity_ohm_m"] * thickness_m
        decay = p["plating.decay_1_s"] * p["sei.initial_thickness_m"] / thickness_m
        return Begun(
            film=film,
            crack_film=crack_film,
            current_A_m2=-FARADAY_C_mol * (film_rate + crack_rate) / area,
            resistance_ohm_m2=resistance,
            decay_1_s=decay * p["plating.strength"],
            porosity=porosity_change.remaining(
                self.negative("porosity"), p["porosity_change.strength"] * self._filled(old)
            ),
        )

    def _filled(self, old: Mapping[str, ca.SX]) -> ca.SX:
        """(n,) share of the electrode's volume that films and lithium have taken."""
        p = self.p
        first = self.first_films(self.p)
        film = old["film"] - first[0] + old["crack_film"] - first[1]
        lithium = old["plated"] + old["dead"]
        share: ca.SX = (
            p["sei.molar_volume_m3_mol"] * film + p["plating.molar_volume_m3_mol"] * lithium
        )
        return share

    def strip(
        self, begun: Begun, old: Mapping[str, ca.SX], potential_V: ca.SX, salt: ca.SX, step_s: ca.SX
    ) -> tuple[ca.SX, ca.SX]:
        """Plated lithium after the step (n,), and the current that strips it (n,) [A/m2]."""
        area = self.surface_1_m(old)
        k = self.p["plating.rate_constant_m_s"] * self.p["plating.strength"]
        rates = plating.rates(k * area, salt, potential_V, old["temperature_K"])
        after, rate = plating.plated(old["plated"], *rates, begun.decay_1_s, step_s)
        return after, FARADAY_C_mol * rate / area

    def end(
        self,
        begun: Begun,
        old: Mapping[str, ca.SX],
        ends: tuple[ca.SX, ca.SX],
        plated: ca.SX,
        step_s: ca.SX,
    ) -> dict[str, ca.SX]:
        """The ageing part of the next state, but for the currents; `ends` are the modes there."""
        p, modes = self.p, dict(zip("np", ends, strict=True))
        tension = {
            key: (self._tension_Pa(side, old[f"modes_{key}"]), self._tension_Pa(side, modes[key]))
            for key, side in (("n", self.negative), ("p", self.positive))
        }
        rate, exponent = p["cracking.paris_rate"], p["cracking.paris_exponent"]
        speed = [cracking.growth_m_s(t, old["crack_m"], rate, exponent) for t in tension["n"]]
        grown_m = p["cracking.strength"] * step_s * (speed[0] + speed[1]) / 2
        out = {
            "film": begun.film,
            "crack_film": begun.crack_film,
            "plated": plated,
            "dead": old["dead"] + step_s * begun.decay_1_s * plated,
            "crack_m": ca.fmin(old["crack_m"] + grown_m, self.negative("particle_radius_m")),
            "porosity": begun.porosity,
        }
        for key, side in (("n", self.negative), ("p", self.positive)):
            lost = self._lost(side, tension[key]) * step_s
            lost = ca.fmax(ca.fmin(lost, old[f"left_{key}"] - active_material_loss.LEAST_LEFT), 0.0)
            out[f"left_{key}"] = old[f"left_{key}"] - lost
            out[f"trapped_{key}"] = old[f"trapped_{key}"] + lost * modes[key][:, 0]
        return out

    def _tension_Pa(self, side: ElectrodeSymbols, modes: ca.SX) -> ca.SX:
        below_mean = side("max_concentration_mol_m3") * (modes[:, 0] - ca.sum2(modes))
        return mechanics.tangential_stress_Pa(below_mean, *side.elastic())

    def _lost(self, side: ElectrodeSymbols, tension: tuple[ca.SX, ca.SX]) -> ca.SX:
        """(n,) share of the first active material that is lost per time, mean of both ends."""
        rate = self.p["active_material_loss.rate_1_s"] * self.p["active_material_loss.strength"]
        critical = self.p[f"active_material_loss.{side.name}_critical_Pa"]
        fraction = side("specific_area_m2_m3") * side("particle_radius_m") / 3
        losses = [active_material_loss.loss_1_s(t, critical, rate) for t in tension]
        mean: ca.SX = (losses[0] + losses[1]) / (2 * fraction)
        return mean
