"""One implicit time step of the P2D model as a CasADi function: all balances put together.

Unknown at each electrode node after the step: salt c, reaction current i (oxidation positive) and
electrolyte potential phi_e; at an inner separator node c and phi_e. The solid potential is explicit,
phi_s = phi_e + U(x_surface(i)) + eta(i), because the particles are eliminated (particle.py).

Residuals, per test function of the mesh, in this order at a node:
  salt      eps L w (c - c_old) + h * [weak divergence of D dc/dx] - h (1 - t+) a L w mean(i) / F
  solid     [weak divergence of sigma dphi_s/dx] + a L w i - current at the collector
  electrolyte charge  [weak divergence of kappa (dphi_e/dx - 2RT/F (1 - t+) dln c/dx)] - a L w i
Salt and charge are linear in the unknowns up to factors under a divergence, so any Newton iterate
conserves both to rounding. phi_e is grounded at an inner separator node, whose charge balance is the
one that the others imply. Elimination runs from both collectors to the separator; with the rows
above the diagonal holds a capacity, a positive charge-transfer resistance or a conductance, so no
pivot is near zero. Time: salt diffusion backward Euler, heat trapezoidal in
its factors, particles
exact for a reaction that runs straight over the step; a step of length 0 answers a current jump.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import elimination, kinetics, particle, transport
from twin.cell import Cell, Electrode
from twin.constants import FARADAY_C_mol, GAS_J_mol_K
from twin.effects import self_heating
from twin.mesh import Layer, Mesh
from twin.parameters import Symbols, cell_parameters

CONVERGED_V = 3e-4
"""Newton stops when a correction moves no potential by more: being quadratic, what is left after it
was measured to be below 1e-6 V."""
MAX_ITERATIONS = 8

OUTPUTS = (
    "voltage_V",
    "temperature_K",
    "heat_W",
    "correction_V",
    "salt_min_mol_m3",
    "surface_margin",
    "negative_mean",
)
"""Of a step; `surface_margin` is the least distance of a surface stoichiometry from 0 and 1,
`negative_mean` the negative electrode's mean stoichiometry."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the quantities lie in the state and in Newton's vector.

    State: modes of the negative and positive particles (nodes x modes), salt (nodes left to right),
    electrolyte potential, reaction current negative, positive, enthalpy potential of both, voltage,
    temperature.
    """

    mesh: Mesh

    @property
    def electrodes(self) -> tuple[int, int]:
        """Nodes in the negative and positive electrode."""
        return self.mesh.negative.size, self.mesh.positive.size

    @property
    def nodes(self) -> int:
        """Nodes of the electrolyte; a node between two layers counts once."""
        return self.mesh.negative.size + self.mesh.separator.size + self.mesh.positive.size - 2

    def layers(self) -> dict[str, slice]:
        """Name -> nodes of the electrolyte in it; a node between two layers is in both."""
        n, p = self.electrodes
        return {
            "negative": slice(0, n),
            "separator": slice(n - 1, self.nodes - p + 1),
            "positive": slice(self.nodes - p, self.nodes),
        }

    def sizes(self) -> dict[str, int]:
        """Name -> length in the state, in order."""
        n, p = self.electrodes
        m = self.mesh.sphere.size
        return {
            "modes_n": n * m, "modes_p": p * m, "salt": self.nodes, "phi": self.nodes,
            "reaction_n": n, "reaction_p": p, "enthalpy_V": n + p, "voltage_V": 1,
            "temperature_K": 1,
        }  # fmt: skip

    def split(self, state: ca.SX) -> dict[str, ca.SX]:
        """The parts of a state vector by name; modes as (nodes, modes)."""
        ends = np.cumsum([0, *self.sizes().values()])
        parts = dict(zip(self.sizes(), ca.vertsplit(state, ends.tolist()), strict=True))
        for key, nodes in zip(("modes_n", "modes_p"), self.electrodes, strict=True):
            parts[key] = ca.reshape(parts[key], nodes, self.mesh.sphere.size)
        return parts

    def slice_of(self, name: str) -> slice:
        """Where `name` lies in the state."""
        sizes = self.sizes()
        start = sum(list(sizes.values())[: list(sizes).index(name)])
        return slice(start, start + sizes[name])

    def elimination_order(self) -> list[int]:
        """Positions in [salt, phi, reaction_n, reaction_p] in the order they are eliminated."""
        n, p = self.electrodes
        total = self.nodes
        salt, phi, i_n, i_p = 0, total, 2 * total, 2 * total + n
        left = [k for x in range(n) for k in (salt + x, i_n + x, phi + x)]
        right = [
            k
            for x in reversed(range(p))
            for k in (salt + total - p + x, i_p + x, phi + total - p + x)
        ]
        inner = range(n, total - p)
        return left + right + [k for x in inner for k in (salt + x, phi + x)]

    @property
    def grounded(self) -> int:
        """Inner separator node at which phi_e is 0: the last one eliminated."""
        return self.nodes - self.electrodes[1] - 1


@dataclass(frozen=True, slots=True)
class _Side:
    """One electrode with its symbols for the step."""

    electrode: Electrode
    layer: Layer
    radial: Layer
    name: str
    p: Mapping[str, ca.SX]

    def __call__(self, name: str) -> ca.SX:
        return self.p[f"{self.name}.{name}"]

    def area_per_node(self) -> ca.SX:
        """(n,) active surface per coated area that belongs to each node."""
        return ca.DM(self.layer.weight) * (self("specific_area_m2_m3") * self("thickness_m"))

    @property
    def uniform_diffusivity(self) -> bool:
        """The diffusivity does not depend on stoichiometry: all particles share their gains."""
        x = ca.SX.sym("x")
        return not ca.depends_on(ca.SX(self.electrode.diffusivity_m2_s(x)), x)

    def diffuse(
        self, modes: ca.SX, reaction: ca.SX, temperature_K: ca.SX, step_s: ca.SX
    ) -> tuple[ca.SX, ca.SX, ca.SX]:
        """`particle.advance` in stoichiometry per A/m2.

        A diffusivity that depends on stoichiometry is taken half way between surface and mean at
        the start of the step: exact where it is constant, second order in the profile's depth.
        """
        middle = (modes[:, 0] + ca.sum2(modes)) / 2
        scale = self("diffusivity_factor") * kinetics.arrhenius(
            self("diffusivity_activation_J_mol"), temperature_K, self.p["reference_K"]
        )
        diffusivity = ca.SX(self.electrode.diffusivity_m2_s(middle))
        if self.uniform_diffusivity:
            diffusivity = diffusivity[0]
        fourier = diffusivity * scale * step_s / self("particle_radius_m") ** 2
        per_A_m2 = 1 / (
            FARADAY_C_mol * self("max_concentration_mol_m3") * self("particle_radius_m")
        )
        known, gain, total = particle.advance(
            modes, reaction * per_A_m2, fourier, step_s, self.radial
        )
        return known, gain * per_A_m2, total * per_A_m2

    def potential(
        self, surface: ca.SX, reaction: ca.SX, salt: ca.SX, temperature_K: ca.SX
    ) -> ca.SX:
        """phi_s - phi_e (n,): open circuit plus overpotential."""
        rate = self("rate_constant_mol_m2_s") * kinetics.arrhenius(
            self("rate_activation_J_mol"), temperature_K, self.p["reference_K"]
        )
        exchange = kinetics.exchange_current_A_m2(
            rate, salt, self.p["electrolyte.initial_concentration_mol_m3"], surface
        )
        ocp = kinetics.open_circuit_V(self.electrode, surface, temperature_K, self.p["reference_K"])
        return ocp + kinetics.overpotential_V(reaction, exchange, temperature_K)


def _bounded(salt: ca.SX) -> ca.SX:
    return ca.fmax(salt, kinetics.SALT_FLOOR_mol_m3)


@dataclass(frozen=True, slots=True)
class _Unknown:
    """Newton's vector by name."""

    salt: ca.SX
    phi: ca.SX
    reaction_n: ca.SX
    reaction_p: ca.SX

    def vector(self) -> ca.SX:
        return ca.vertcat(self.salt, self.phi, self.reaction_n, self.reaction_p)


class StepModel:
    """The equations of a cell on a mesh; `step()` is the kernel.

    Inputs of the kernel: state, drive = [step length s, current at its end A, ambient K,
    heat transfer W/m2/K, self-heating 0 or 1], parameters (parameters.py). Outputs: next state,
    OUTPUTS. Current and heat are those of one cell.
    """

    def __init__(self, cell: Cell, mesh: Mesh) -> None:
        self.cell, self.layout = cell, Layout(mesh)
        self.p = Symbols(tuple(cell_parameters(cell)))
        self.negative = _Side(cell.negative, mesh.negative, mesh.sphere, "negative", self.p)
        self.positive = _Side(cell.positive, mesh.positive, mesh.sphere, "positive", self.p)

    def initial_state(
        self, soc: float, temperature_K: float, values: Mapping[str, float]
    ) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """A rested cell: uniform at `soc` of the stoichiometry window, no current."""
        state = np.zeros(sum(self.layout.sizes().values()))
        low, high = (values[f"negative.stoichiometry_{end}"] for end in ("min", "max"))
        full, empty = (values[f"positive.stoichiometry_{end}"] for end in ("min", "max"))
        n, p = self.layout.electrodes
        state[self.layout.slice_of("modes_n")][:n] = low + soc * (high - low)
        state[self.layout.slice_of("modes_p")][:p] = empty + soc * (full - empty)
        state[self.layout.slice_of("salt")] = values["electrolyte.initial_concentration_mol_m3"]
        state[self.layout.slice_of("temperature_K")] = temperature_K
        return state

    def lithium_mol(
        self, state: npt.NDArray[np.float64], values: Mapping[str, float]
    ) -> tuple[float, float, float]:
        """Lithium in the negative and positive electrode and in the electrolyte of one cell [mol]."""
        layout, area = self.layout, values["area_m2"]
        solids = []
        for side, key in ((self.negative, "n"), (self.positive, "p")):
            mean = state[layout.slice_of(f"modes_{key}")][: side.layer.size]
            solid_m = (
                values[f"{side.name}.specific_area_m2_m3"]
                / 3
                * (values[f"{side.name}.particle_radius_m"] * values[f"{side.name}.thickness_m"])
            )
            content = values[f"{side.name}.max_concentration_mol_m3"] * side.layer.weight @ mean
            solids.append(float(area * solid_m * content))
        salt = state[layout.slice_of("salt")]
        electrolyte = 0.0
        for name, span in layout.layers().items():
            pores_m = values[f"{name}.porosity"] * values[f"{name}.thickness_m"]
            weight = getattr(layout.mesh, name).weight
            electrolyte += float(area * pores_m * weight @ salt[span])
        return solids[0], solids[1], electrolyte

    # -- the parts of a step -------------------------------------------------------------------

    def _residual(self, z: _Unknown, known: dict[str, ca.SX], solid: tuple[ca.SX, ca.SX]) -> ca.SX:
        """All balances, in the order of `_Unknown.vector`."""
        p, layout = self.p, self.layout
        total = layout.nodes
        spans = layout.layers()
        temperature, step_s = known["temperature_K"], known["step_s"]
        salt_row, charge_row = ca.SX.zeros(total), ca.SX.zeros(total)
        t_plus = p["electrolyte.transference"]
        thermal = 2 * GAS_J_mol_K * temperature / FARADAY_C_mol * (1 - t_plus)
        for name, span in spans.items():
            layer: Layer = getattr(layout.mesh, name)
            thickness, porosity = p[f"{name}.thickness_m"], p[f"{name}.porosity"]
            efficiency = p[f"{name}.transport_efficiency"]
            salt = z.salt[span]
            diffusivity = efficiency * self._electrolyte("diffusivity", salt, temperature)
            conductivity = efficiency * self._electrolyte("conductivity", salt, temperature)
            held = ca.DM(layer.weight) * (porosity * thickness) * (salt - known["salt"][span])
            spread = transport.weak_divergence(layer, salt, diffusivity, thickness)
            salt_row[span] += held + step_s * spread
            charge_row[span] += transport.weak_divergence(
                layer, z.phi[span], conductivity, thickness
            ) - transport.weak_divergence(
                layer, salt, conductivity * thermal / _bounded(salt), thickness
            )
        solid_rows = []
        for side, phi_s, reaction, old, span, collector in (
            (self.negative, solid[0], z.reaction_n, known["reaction_n"], spans["negative"], 0),
            (self.positive, solid[1], z.reaction_p, known["reaction_p"], spans["positive"], -1),
        ):
            area = side.area_per_node()
            salt_row[span] -= step_s * (1 - t_plus) / FARADAY_C_mol * area * (reaction + old) / 2
            charge_row[span] -= area * reaction
            sigma = ca.repmat(side("conductivity_S_m"), side.layer.size, 1)
            row = transport.weak_divergence(side.layer, phi_s, sigma, side("thickness_m"))
            row += area * reaction
            density = known["current_A"] / p["area_m2"]
            row[collector] += -density if collector == 0 else density
            solid_rows.append(row)
        charge_row[layout.grounded] = z.phi[layout.grounded]
        return ca.vertcat(salt_row, charge_row, *solid_rows)

    def _electrolyte(self, name: str, salt: ca.SX, temperature_K: ca.SX) -> ca.SX:
        """Bulk conductivity or diffusivity (n,) at temperature."""
        function = getattr(self.cell.electrolyte, f"{name}_{'S_m' if name[0] == 'c' else 'm2_s'}")
        factor = self.p[f"electrolyte.{name}_factor"] * kinetics.arrhenius(
            self.p[f"electrolyte.{name}_activation_J_mol"], temperature_K, self.p["reference_K"]
        )
        return function(_bounded(salt)) * factor

    def _solid(self, z: _Unknown, known: dict[str, ca.SX]) -> tuple[ca.SX, ca.SX]:
        """phi_s at the nodes of both electrodes."""
        n_n, n_p = self.layout.electrodes
        total, temperature = self.layout.nodes, known["temperature_K"]
        out = []
        for side, reaction, span, key in (
            (self.negative, z.reaction_n, slice(0, n_n), "n"),
            (self.positive, z.reaction_p, slice(total - n_p, total), "p"),
        ):
            surface = known[f"surface_{key}"] - known[f"gain_{key}"] * reaction
            out.append(z.phi[span] + side.potential(surface, reaction, z.salt[span], temperature))
        return out[0], out[1]

    def _known_symbols(self) -> dict[str, ca.SX]:
        n, p = self.layout.electrodes
        sizes = {
            "surface_n": n, "surface_p": p, "gain_n": n, "gain_p": p, "salt": self.layout.nodes,
            "reaction_n": n, "reaction_p": p, "temperature_K": 1, "step_s": 1, "current_A": 1,
        }  # fmt: skip
        return {name: ca.SX.sym(name, size) for name, size in sizes.items()}

    def _newton(self) -> ca.Function:
        """(z, known, p) -> (z + correction, size of the correction [V])."""
        n, p = self.layout.electrodes
        total = self.layout.nodes
        known = self._known_symbols()
        z = _Unknown(
            ca.SX.sym("c", total), ca.SX.sym("phi", total), ca.SX.sym("in", n), ca.SX.sym("ip", p)
        )
        vector = z.vector()
        solid = self._solid(z, known)
        residual = self._residual(z, known, solid)
        order = self.layout.elimination_order()
        jacobian = ca.jacobian(residual, vector)[order, order]
        solution = elimination.solve(jacobian, -residual[order])
        correction = solution[np.argsort(order).tolist()]
        solid_change = ca.jtimes(ca.vertcat(*solid), vector, correction)
        size = ca.norm_inf(ca.vertcat(correction[total : 2 * total], solid_change))
        names = ["z", *known, "p"]
        return ca.Function(
            "newton",
            [vector, *known.values(), self.p.vector],
            [vector + correction, size],
            names,
            ["next", "correction_V"],
        )

    def _prepare(self) -> ca.Function:
        """(state, drive, p) -> first guess z, known quantities, modes at zero end flux, gains."""
        state = ca.SX.sym("state", sum(self.layout.sizes().values()))
        drive = ca.SX.sym("drive", 5)
        step_s, current = drive[0], drive[1]
        old = self.layout.split(state)
        temperature = old["temperature_K"]
        outputs: dict[str, ca.SX] = {}
        guesses = []
        drawn = self.p["area_m2"] * ca.dot(self.negative.area_per_node(), old["reaction_n"])
        for side, key, sign in ((self.negative, "n", 1.0), (self.positive, "p", -1.0)):
            modes, reaction = old[f"modes_{key}"], old[f"reaction_{key}"]
            known, gain, total = side.diffuse(modes, reaction, temperature, step_s)
            outputs[f"surface_{key}"] = ca.sum2(known)
            outputs[f"gain_{key}"] = ca.repmat(total, side.layer.size // total.shape[0], 1)
            outputs[f"kept_{key}"] = known
            outputs[f"loss_{key}"] = gain
            change = sign * (current - drawn) / (ca.sum1(side.area_per_node()) * self.p["area_m2"])
            guesses.append(reaction + change)
        outputs["guess"] = ca.vertcat(old["salt"], old["phi"], *guesses)
        return ca.Function(
            "prepare",
            [state, drive, self.p.vector],
            list(outputs.values()),
            ["state", "drive", "p"],
            list(outputs),
        )

    def _finish(self) -> ca.Function:
        """(z, kept and lost modes, state, drive, p) -> next state, OUTPUTS without correction."""
        layout, m = self.layout, self.layout.mesh.sphere.size
        n, p = layout.electrodes
        total = layout.nodes
        vector = ca.SX.sym("z", 2 * total + n + p)
        salt, phi, i_n, i_p = ca.vertsplit(
            vector, [0, total, 2 * total, 2 * total + n, 2 * total + n + p]
        )
        z = _Unknown(salt, phi, i_n, i_p)
        state = ca.SX.sym("state", sum(layout.sizes().values()))
        old, drive = layout.split(state), ca.SX.sym("drive", 5)
        step_s, current, ambient_K, transfer, heating = ca.vertsplit(drive)
        inputs, modes, surfaces = [vector, state, drive, self.p.vector], [], []
        names = ["z", "state", "drive", "p"]
        for side, key, reaction in ((self.negative, "n", i_n), (self.positive, "p", i_p)):
            shared = side.uniform_diffusivity
            kept = ca.SX.sym(f"kept_{key}", side.layer.size, m)
            loss = ca.SX.sym(f"loss_{key}", 1 if shared else side.layer.size, m)
            lost = ca.repmat(loss, side.layer.size, 1) if shared else loss
            modes.append(kept - lost * ca.repmat(reaction, 1, m))
            surfaces.append(ca.sum2(modes[-1]))
            inputs += [kept, loss]
            names += [f"kept_{key}", f"loss_{key}"]
        temperature = old["temperature_K"]
        sides = (self.negative, self.positive)
        known = {"temperature_K": temperature}
        for key, surface, size in (("n", surfaces[0], n), ("p", surfaces[1], p)):
            known |= {f"surface_{key}": surface, f"gain_{key}": ca.SX.zeros(size)}
        solid_n, solid_p = self._solid(z, known)
        voltage = solid_p[-1] - solid_n[0]
        areas = self.p["area_m2"] * ca.vertcat(*(side.area_per_node() for side in sides))
        reaction_A = areas * ca.vertcat(i_n, i_p)
        ocp = [
            kinetics.open_circuit_V(s.electrode, x, temperature, self.p["reference_K"])
            for s, x in zip(sides, surfaces, strict=True)
        ]
        enthalpy = ca.vertcat(*ocp) - temperature * ca.vertcat(
            *(s.electrode.entropic_V_K(x) for s, x in zip(sides, surfaces, strict=True))
        )
        before_A = areas * ca.vertcat(old["reaction_n"], old["reaction_p"])
        drawn_A = ca.sum1(before_A[:n])
        heat = self_heating.released_W(reaction_A, enthalpy, current, voltage)
        mean_heat = self_heating.mean_released_W(
            (before_A, reaction_A), (old["enthalpy_V"], enthalpy),
            (drawn_A, current), (old["voltage_V"], voltage),
        )  # fmt: skip
        warmer = self_heating.temperature_after(
            temperature, mean_heat, transfer * self.p["cooling_area_m2"],
            self.p["heat_capacity_J_K"], ambient_K, step_s,
        )  # fmt: skip
        next_temperature = temperature + heating * (warmer - temperature)
        following = ca.vertcat(
            *(ca.vec(x) for x in modes), salt, phi, i_n, i_p, enthalpy, voltage, next_temperature
        )
        x = ca.vertcat(*surfaces)
        mean_n = ca.dot(ca.DM(self.negative.layer.weight), modes[0][:, 0])
        outputs = [
            voltage, next_temperature, heat, ca.mmin(salt), ca.mmin(ca.fmin(x, 1 - x)), mean_n
        ]  # fmt: skip
        return ca.Function(
            "finish", inputs, [following, ca.vertcat(*outputs)], names, ["next", "out"]
        )

    def step(self) -> ca.Function:
        """The kernel: (state, drive, p) -> (next state, OUTPUTS)."""
        prepare, newton, finish = self._prepare(), self._newton(), self._finish()
        state = ca.MX.sym("state", prepare.size1_in(0))
        drive = ca.MX.sym("drive", 5)
        p = ca.MX.sym("p", len(self.p))
        prepared = prepare(state=state, drive=drive, p=p)
        old = self._split_mx(state)
        known = {k: prepared[k] for k in ("surface_n", "surface_p", "gain_n", "gain_p")}
        known |= {k: old[k] for k in ("salt", "reaction_n", "reaction_p", "temperature_K")}
        known |= {"step_s": drive[0], "current_A": drive[1]}
        refine = self._refine(newton)
        fixed = (*(known[name] for name in newton.name_in()[1:-1]), p)
        z, correction = newton(prepared["guess"], *fixed)
        for _ in range(MAX_ITERATIONS - 1):
            z, correction = refine(correction > CONVERGED_V, correction, z, *fixed)
        kept = {k: prepared[k] for k in ("kept_n", "loss_n", "kept_p", "loss_p")}
        done = finish(z=z, state=state, drive=drive, p=p, **kept)
        out = ca.vertcat(done["out"][:3], correction, done["out"][3:])
        return ca.Function(
            "step", [state, drive, p], [done["next"], out], ["state", "drive", "p"], ["next", "out"]
        )

    def _refine(self, newton: ca.Function) -> ca.Function:
        """(wanted, correction, z, ...) -> one more iteration if wanted, else z as it is."""
        inputs = [ca.MX.sym("correction_V"), *newton.mx_in()]
        more = ca.Function("more", inputs, newton(*inputs[1:]))
        enough = ca.Function("enough", inputs, [inputs[1], inputs[0]])
        return ca.Function.if_else("refine", more, enough)

    def _split_mx(self, state: ca.MX) -> dict[str, ca.MX]:
        ends = np.cumsum([0, *self.layout.sizes().values()])
        parts = ca.vertsplit(state, ends.tolist())
        return dict(zip(self.layout.sizes(), parts, strict=True))
