"""The salt solution in the pores of all three layers: its salt over one step, its conductivity."""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from twin import elimination, kinetics
from twin.cell import Electrolyte
from twin.constants import FARADAY_C_mol, GAS_J_mol_K
from twin.effects.porosity_change import bruggeman
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

    def diffuse(
        self, old: Mapping[str, ca.SX], step_s: ca.SX, porosity: ca.SX | None
    ) -> tuple[ca.SX, ca.SX]:
        """Salt after a step, as `known + response @ transfer`.

        Backward Euler with the diffusivity at the start of the step. What is in pores that shrink
        stays in them. The change is solved for, so that rounding is of the change, not of what
        there is: the salt of 1000 cycles is the salt of the first. The matrix is symmetric and
        positive definite: no pivot of its elimination is near zero.

        Args:
            old: the state before the step.
            step_s: () length of the step.
            porosity: (n,) of the negative electrode during the step, if it changes.

        Returns:
            (nodes,) [mol/m3] and (nodes, n + p) [mol/m3 per A/m2]: `transfer` is the current that
            leaves the solid, mean of the step, at each node of both electrodes [A/m2 of coated
            area].
        """
        matrix, moved, made = self.balance(old, step_s, porosity)
        order = self.layout.elimination_order()
        solution = elimination.solve(matrix[order, order], ca.horzcat(moved, made)[order, :])
        solution = solution[np.argsort(order).tolist(), :]
        return old["salt"] + solution[:, 0], solution[:, 1:]

    def balance(
        self, old: Mapping[str, ca.SX], step_s: ca.SX, porosity: ca.SX | None
    ) -> tuple[ca.SX, ca.SX, ca.SX]:
        """The equations of `diffuse`: matrix @ change of salt = moved + made @ transfer.

        Returns:
            (nodes, nodes), (nodes,) and (nodes, n + p).
        """
        nodes, (n, p) = self.layout.nodes, self.layout.electrodes
        moved, matrix = ca.SX.zeros(nodes), ca.SX(nodes, nodes)
        for name, span in self.layout.layers().items():
            layer, thickness = self.layout.layer(name), self.p[f"{name}.thickness_m"]
            pores = before = self.p[f"{name}.porosity"]
            if porosity is not None and name == "negative":
                pores, before = porosity, old["porosity"]
            volume = ca.DM(layer.weight) * thickness
            diffusivity = self._effective("diffusivity", name, old["salt"], old, porosity)
            spread = step_s * weak_divergence(layer, diffusivity, thickness)
            moved[span] += volume * (before - pores) * old["salt"][span]
            moved[span] -= spread @ (old["salt"][span] - old["salt"][n])  # a level does not spread
            matrix[span, span] += ca.diag(volume * pores) + spread
        made = step_s * (1 - self.p["electrolyte.transference"]) / FARADAY_C_mol
        sources = [*range(n), *range(nodes - p, nodes)]
        return matrix, moved, made * ca.DM.eye(nodes)[:, sources]

    def conductivity_S_m(
        self, name: str, salt: ca.SX, old: Mapping[str, ca.SX], porosity: ca.SX | None
    ) -> ca.SX:
        """(n,) effective, in layer `name`, of salt (nodes,)."""
        return self._effective("conductivity", name, salt, old, porosity)

    def diffusion_V(self, temperature_K: ca.SX) -> ca.SX:
        """() potential per change of ln c, 2 R T / F (1 - t+)."""
        thermal_V = 2 * GAS_J_mol_K * temperature_K / FARADAY_C_mol
        return thermal_V * (1 - self.p["electrolyte.transference"])

    def _effective(
        self,
        quantity: str,
        name: str,
        salt: ca.SX,
        old: Mapping[str, ca.SX],
        porosity: ca.SX | None,
    ) -> ca.SX:
        """Transport property of the pores in layer `name`, at the start's temperature."""
        efficiency = self.p[f"{name}.transport_efficiency"]
        if porosity is not None and name == "negative":
            efficiency = bruggeman(porosity, self.p["negative.porosity"], efficiency)
        activation = self.p[f"electrolyte.{quantity}_activation_J_mol"]
        warm = kinetics.arrhenius(activation, old["temperature_K"], self.p["reference_K"])
        own = salt[self.layout.layers()[name]]
        if quantity == "diffusivity":
            bulk = self.electrolyte.diffusivity_m2_s(ca.fmax(own, kinetics.SALT_FLOOR_mol_m3))
        else:
            bulk = self.electrolyte.conductivity_S_m(kinetics.felt(own))
        return bulk * (efficiency * self.p[f"electrolyte.{quantity}_factor"] * warm)
