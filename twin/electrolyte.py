"""The salt solution in the pores of all three layers: its two balances over one step."""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from twin import kinetics
from twin.cell import Electrolyte
from twin.constants import FARADAY_C_mol, GAS_J_mol_K
from twin.effects.porosity_change import BRUGGEMAN
from twin.layout import Layout
from twin.transport import weak_divergence


@dataclass(frozen=True, slots=True)
class ElectrolyteSymbols:
    """The electrolyte with its symbols for the step.

    Doyle, Fuller, Newman (1993), doi:10.1149/1.2221597: concentrated binary solution, thermodynamic
    factor 1; effective transport properties by BPX's transport efficiency of the layer.
    """

    electrolyte: Electrolyte
    layout: Layout
    p: Mapping[str, ca.SX]

    def balances(
        self,
        salt: ca.SX,
        phi: ca.SX,
        old: Mapping[str, ca.SX],
        step_s: ca.SX,
        porosity: ca.SX | None = None,
    ) -> tuple[ca.SX, ca.SX]:
        """Residuals (nodes,) of salt and of charge, without the electrodes' reactions.

        Args:
            salt: (nodes,) concentration after the step [mol/m3].
            phi: (nodes,) potential after the step [V].
            old: the state before the step.
            step_s: () length of the step; salt diffusion is backward Euler.
            porosity: (n,) of the negative electrode during the step, if it changes; the salt that
                was in its pores stays in them.

        Returns:
            Salt [mol/m2] and charge [A/m2], per coated area and test function.
        """
        salt_row, charge_row = (ca.SX.zeros(self.layout.nodes) for _ in range(2))
        temperature_K = old["temperature_K"]
        kelvin_V = 2 * GAS_J_mol_K * temperature_K / FARADAY_C_mol
        per_gradient = kelvin_V * (1 - self.p["electrolyte.transference"])
        for name, span in self.layout.layers().items():
            layer, thickness = self.layout.layer(name), self.p[f"{name}.thickness_m"]
            efficiency = self.p[f"{name}.transport_efficiency"]
            pores = before = self.p[f"{name}.porosity"]
            if porosity is not None and name == "negative":
                efficiency = efficiency * (porosity / pores) ** BRUGGEMAN
                pores, before = porosity, old["porosity"]
            c = ca.fmax(salt[span], kinetics.SALT_FLOOR_mol_m3)
            diffusivity = efficiency * self._warm(
                "diffusivity", self.electrolyte.diffusivity_m2_s(c), temperature_K
            )
            conductivity = efficiency * self._warm(
                "conductivity", self.electrolyte.conductivity_S_m(c), temperature_K
            )
            held = pores * salt[span] - before * old["salt"][span]
            spread = weak_divergence(layer, salt[span], diffusivity, thickness)
            salt_row[span] += ca.DM(layer.weight) * thickness * held + step_s * spread
            charge_row[span] += weak_divergence(layer, phi[span], conductivity, thickness)
            charge_row[span] -= weak_divergence(
                layer, salt[span], conductivity * per_gradient / c, thickness
            )
        return salt_row, charge_row

    def pores_m(self, porosity: ca.SX) -> ca.SX:
        """(nodes,) volume of electrolyte per coated area at each node; `porosity` (n,) negative."""
        out = ca.SX.zeros(self.layout.nodes)
        for name, span in self.layout.layers().items():
            share = porosity if name == "negative" else self.p[f"{name}.porosity"]
            out[span] += (
                ca.DM(self.layout.layer(name).weight) * self.p[f"{name}.thickness_m"] * share
            )
        return out

    def _warm(self, name: str, at_reference: ca.SX, temperature_K: ca.SX) -> ca.SX:
        activation = self.p[f"electrolyte.{name}_activation_J_mol"]
        factor = kinetics.arrhenius(activation, temperature_K, self.p["reference_K"])
        return at_reference * (self.p[f"electrolyte.{name}_factor"] * factor)
