"""One electrode over one step: its particles, their surface potential, ohmic losses on the way."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import kinetics, particle
from twin.bumps import Bumped
from twin.cell import Electrode, Hysteresis
from twin.constants import FARADAY_C_mol
from twin.effects import ocv_hysteresis
from twin.effects.stress_enhanced_diffusion import enhancement
from twin.mesh import Layer

FloatArray = npt.NDArray[np.float64]

END_V, END_STEEPNESS, END_BEYOND = 205.0568621937484, 6910.192179565431, 7.7e-4
"""Of `ends_V`: 1 mV at a stoichiometry of 0.001, 1 V at 0, nothing from 0.006 on (PyBaMM's)."""


NO_MORE = 40.0  # exp(-40) adds nothing to 1; where it underflows it is slow


def ends_V(surface: ca.SX) -> ca.SX:
    """(n,) added to an open-circuit potential: V ln(1 + e^-k(x + d)) near 0, minus that near 1.

    Fits stop short of the ends: this graphite's potential is flat up to x = 1, so that nothing but
    this keeps particles from filling to the brim while a voltage is held. It stays finite, and goes
    on straight beyond the end.

    Source:
        PyBaMM 26.10.1.1, lithium_ion_parameters.py, U_asymptotes: form and numbers. The end that
        is farther away adds less than 1e-1400 V there and is left out.
    """
    z = -END_STEEPNESS * (ca.fmin(surface, 1 - surface) + END_BEYOND)
    steep = END_V * (ca.fmax(z, 0) + ca.log(1 + ca.exp(-ca.fmin(ca.fabs(z), NO_MORE))))
    return ca.if_else(surface < 0.5, steep, -steep)


@dataclass(frozen=True, slots=True)
class ElectrodeSymbols:
    """An electrode with its symbols for the step.

    Attributes:
        name: `negative` or `positive`: the prefix of its parameters.
        electrode: its functions.
        layer: nodes across the coating.
        sphere: nodes along the radius of a particle.
        collector: node at the current collector, 0 or -1.
        p: parameters by name.
        stressed: diffusion is enhanced by stress.
        branches: of its open-circuit potential, if its file has them; for `off_equilibrium_V`.
    """

    name: str
    electrode: Electrode
    layer: Layer
    sphere: Layer
    collector: int
    p: Mapping[str, ca.SX]
    stressed: bool = False
    branches: Hysteresis | None = None

    def __call__(self, name: str) -> ca.SX:
        """Its own parameter `name`."""
        return self.p[f"{self.name}.{name}"]

    def area_per_node(self, left: ca.SX | float = 1.0) -> ca.SX:
        """(n,) active surface per coated area that belongs to each node; `left` of the first."""
        whole = self("specific_area_m2_m3") * self("thickness_m")
        return ca.DM(self.layer.weight) * (whole * left)

    @property
    def uniform_diffusivity(self) -> bool:
        """The diffusivity does not depend on stoichiometry: all particles share their gains."""
        return not self.stressed and not self._resolved

    @property
    def _resolved(self) -> bool:
        """It does by the cell's file, and is resolved along the radius."""
        x = ca.SX.sym("x")
        return bool(ca.depends_on(ca.SX(self.electrode.diffusivity_m2_s(x)), x))

    def diffuse(
        self, modes: ca.SX, reaction: ca.SX, temperature_K: ca.SX, step_s: ca.SX
    ) -> tuple[ca.SX, ca.SX]:
        """`particle.advance` with the reaction current [A/m2] as the flux.

        A diffusivity that depends on stoichiometry by the file is taken as it is along the radius
        (`particle.advance_uneven`). What stress makes of a constant one, in the middle of the step,
        2/7 of the way from mean to surface: there a steady profile, x' = -flux r / D, weighted by
        r**4 as its depth is, has its mean radius, so that the depth is right to second order.
        """
        holds = FARADAY_C_mol * self("max_concentration_mol_m3") * self("particle_radius_m")
        warm = kinetics.arrhenius(
            self("diffusivity_activation_J_mol"), temperature_K, self.p["reference_K"]
        )
        per_diffusivity = (
            self("diffusivity_factor") * warm * step_s / self("particle_radius_m") ** 2
        )
        flux = reaction / holds
        if self._resolved:
            known, loss = particle.advance_uneven(
                modes, flux, partial(self._diffusivity_m2_s, temperature_K=temperature_K), step_s,
                per_diffusivity, self.sphere,
            )  # fmt: skip
            return known, loss / holds
        mean = modes[:, 0]
        middle = mean + 2 / 7 * (ca.sum2(modes) - mean) - 1.5 * step_s * flux
        middle = ca.fmin(ca.fmax(middle, 0.0), 1.0)  # a step too long is told by its error, not NaN
        diffusivity = self._diffusivity_m2_s(middle, temperature_K)
        if self.uniform_diffusivity:
            diffusivity = diffusivity[0]
        known, loss = particle.advance(modes, flux, diffusivity * per_diffusivity, step_s,
                                       self.sphere)  # fmt: skip
        return known, loss / holds

    def _diffusivity_m2_s(self, x: ca.SX, temperature_K: ca.SX) -> ca.SX:
        """(n,) at stoichiometries (n,), at the reference temperature; by stress at its own."""
        plain = ca.SX(self.electrode.diffusivity_m2_s(x))
        if not self.stressed:
            return plain
        concentration = x * self("max_concentration_mol_m3")
        return plain * enhancement(concentration, temperature_K, self.elastic())

    def elastic(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Young's modulus [Pa], Poisson's ratio, partial molar volume of lithium [m3/mol]."""
        names = ("modulus_Pa", "poisson", "partial_volume_m3_mol")
        modulus, poisson, partial = (self.p[f"mechanics.{self.name}_{k}"] for k in names)
        return modulus, poisson, partial

    def open_circuit_V(self, surface: ca.SX, temperature_K: ca.SX) -> ca.SX:
        """U(x) + (T - T_ref) dU/dT(x), (n,), steep at both ends (`ends_V`)."""
        warmer_K = temperature_K - self.p["reference_K"]
        ocp_V = self.electrode.ocp_V
        plain = ocp_V(surface) + ends_V(surface)
        if isinstance(ocp_V, Bumped):
            plain += ocp_V.raised_V(surface, [self.p[name] for name in ocp_V.names(self.name)])
        return plain + warmer_K * self.electrode.entropic_V_K(surface)

    def enthalpy_V(self, surface: ca.SX, temperature_K: ca.SX) -> ca.SX:
        """U - T dU/dT, (n,): the reaction's heat per charge."""
        entropic = self.electrode.entropic_V_K(surface)
        return self.open_circuit_V(surface, temperature_K) - temperature_K * entropic

    def potential_V(
        self, surface: ca.SX, reaction: ca.SX, salt: ca.SX, temperature_K: ca.SX
    ) -> ca.SX:
        """phi_s - phi_e (n,) at a reaction current [A/m2], oxidation positive."""
        rate = self("rate_constant_mol_m2_s") * kinetics.arrhenius(
            self("rate_activation_J_mol"), temperature_K, self.p["reference_K"]
        )
        salt_initial = self.p["electrolyte.initial_concentration_mol_m3"]
        exchange = kinetics.exchange_current_A_m2(rate, salt, salt_initial, surface)
        eta = kinetics.overpotential_V(reaction, exchange, temperature_K)
        return self.open_circuit_V(surface, temperature_K) + eta

    def hysteresis(self, before: ca.SX, reactions: tuple[ca.SX, ca.SX], step_s: ca.SX) -> ca.SX:
        """(n,) between the branches after a step; `reactions` at its start and end [A/m2]."""
        holds = FARADAY_C_mol * self("max_concentration_mol_m3") * self("particle_radius_m")
        per_current = self.p[f"ocv_hysteresis.{self.name}_decay"] / 2 * step_s * 3 / holds
        start, end = (per_current * reaction for reaction in reactions)
        return ocv_hysteresis.relaxed(before, start, end)

    def off_equilibrium_V(self, surface: ca.SX, hysteresis: ca.SX) -> ca.SX:
        """(n,) that hysteresis adds to `open_circuit_V`, the BPX OCP.

        The energy of the lithium stays that of the OCP (`enthalpy_V`): the rest is heat.
        """
        branches = self.branches or self.p[f"ocv_hysteresis.{self.name}_amplitude_V"]
        ocp_V = self.electrode.ocp_V
        return ocv_hysteresis.off_equilibrium_V(ocp_V, branches, surface, hysteresis)

    def losses_ohm_m2(self, conductivity_S_m: ca.SX) -> ca.SX:
        """(n, n) potential lost in solution and solid between each node and the separator.

        In one dimension the currents follow from the reactions alone, and the potentials from the
        currents: both are integrals of polynomials, and no potential is an unknown.

        Args:
            conductivity_S_m: (n,) effective, of the electrolyte.

        Returns:
            [Ohm m2], per current that leaves the solid at each node [A/m2 of coated area].
        """
        resistance = self("thickness_m") * (1 / self("conductivity_S_m") + 1 / conductivity_S_m)
        along = ca.DM(self._to_separator) * ca.repmat(resistance.T, self.layer.size, 1)
        lost: ca.SX = along @ ca.DM(self._from_collector)
        return lost

    def solid_V(self, current_A: ca.SX) -> ca.SX:
        """(n,) what the whole current would lose in the solid between each node and separator."""
        density = self.outward * current_A / self.p["area_m2"]
        whole = density * self("thickness_m") / self("conductivity_S_m")
        return ca.DM(self._to_separator.sum(axis=1)) * whole

    def collector_V(self, current_A: ca.SX, transfer: ca.SX) -> ca.SX:
        """() potential of the solid at the collector above that at the separator.

        `transfer` (n,) is the current that leaves the solid on the way [A/m2 of coated area].
        """
        shared = self._to_separator[self.collector] @ self._from_collector
        used = ca.dot(ca.DM(shared), transfer) * self("thickness_m") / self("conductivity_S_m")
        return self.solid_V(current_A)[self.collector] - used

    @property
    def _from_collector(self) -> FloatArray:
        """(n, n) current in solution at each node, of the current that leaves the solid at each."""
        integral, weight = self.layer.integral, self.layer.weight
        return (integral if self.collector == 0 else weight - integral) / weight

    @property
    def _to_separator(self) -> FloatArray:
        """(n, n) integral from each node to the separator, over unit length."""
        integral, weight = self.layer.integral, self.layer.weight
        return weight - integral if self.collector == 0 else integral

    @property
    def key(self) -> str:
        """Suffix of its quantities in the state."""
        return self.name[0]

    @property
    def separator(self) -> int:
        """Node at the separator, -1 or 0."""
        return -1 - self.collector

    @property
    def outward(self) -> float:
        """1 where a discharge oxidises (negative electrode), -1 where it reduces."""
        return 1.0 if self.collector == 0 else -1.0
