"""One implicit time step of the P2D model as a CasADi function: all balances put together.

Unknown at each electrode node after the step: salt c, reaction current i (oxidation positive),
electrolyte potential phi_e; at an inner separator node c and phi_e. The solid potential is
explicit, phi_s = phi_e + U(x_surface(i)) + eta(i): the particles are eliminated (particle.py).

Residuals, per test function of the mesh:
  salt    eps L w (c - c_old) + h [weak divergence of D dc/dx] - h (1 - t+) a L w mean(i) / F
  charge  [weak divergence of kappa (dphi_e/dx - 2RT/F (1 - t+) dln c/dx)] - a L w i
  solid   [weak divergence of sigma dphi_s/dx] + a L w i - current at the collector
Their sums are linear in the unknowns, so any Newton iterate conserves salt and charge to rounding.
phi_e is grounded at an inner separator node, whose charge balance the others imply. Elimination
runs from both collectors to the separator; paired as salt-c, solid-i, charge-phi_e the diagonal
holds a capacity, a positive charge-transfer resistance and a conductance: no pivot is near zero.

In time: salt diffusion backward Euler; reactions run straight over the step, for which particles
are exact and heat is the exact mean of its factors' products. A step of length 0 answers a jump.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import elimination
from twin.cell import Cell
from twin.constants import FARADAY_C_mol
from twin.degradation import DegradationSymbols
from twin.effects import Mechanics, self_heating
from twin.electrode import ElectrodeSymbols
from twin.electrolyte import ElectrolyteSymbols
from twin.layout import Layout
from twin.mesh import Mesh
from twin.parameters import (
    Symbols,
    ageing_parameters,
    cell_parameters,
    mechanics_parameters,
)

FloatArray = npt.NDArray[np.float64]

CONVERGED_V = 3e-4
"""Newton stops when a correction moves no potential by more: being quadratic, what is left after it
was measured to be below 1e-6 V."""
MAX_ITERATIONS = 8

DRIVE = ("step_s", "current_A", "ambient_K", "heat_transfer_W_m2_K", "self_heating")
"""What drives a step: its length, the current of one cell at its end, and self-heating 0 or 1."""
OUTPUTS = (
    "voltage_V",
    "temperature_K",
    "heat_W",
    "correction_V",
    "salt_min_mol_m3",
    "surface_margin",
    "negative_mean",
)
"""Of a step, for one cell; `surface_margin` is the least distance of a surface stoichiometry from 0
and 1, `negative_mean` the negative electrode's mean stoichiometry."""


@dataclass(frozen=True, slots=True)
class _Unknown:
    """Newton's vector: salt and potential (nodes,), reaction in each electrode [A/m2]."""

    salt: ca.SX
    phi: ca.SX
    reaction_n: ca.SX
    reaction_p: ca.SX

    def vector(self) -> ca.SX:
        return ca.vertcat(self.salt, self.phi, self.reaction_n, self.reaction_p)


@dataclass(frozen=True, slots=True)
class _Surface:
    """Of one electrode's particles at the end of a step; all (n,).

    Attributes:
        phi_s: potential of the solid.
        total: current through the surface, side reactions included [A/m2].
        released: lithium that left for the electrolyte, mean of the step, as a current [A/m2].
        plated: metallic lithium after the step; empty without ageing.
    """

    phi_s: ca.SX
    total: ca.SX
    released: ca.SX
    plated: ca.SX


class StepModel:
    """The equations of a cell on a mesh; `step()` is the kernel."""

    def __init__(
        self, cell: Cell, mesh: Mesh, *, ageing: bool = False, stressed: bool = False
    ) -> None:
        self.layout = Layout(mesh, ageing=ageing)
        names = cell_parameters(cell)
        names |= mechanics_parameters(Mechanics()) if stressed else {}
        names |= ageing_parameters() if ageing else {}
        self.p = Symbols(tuple(names))
        self.negative = ElectrodeSymbols(
            "negative", cell.negative, mesh.negative, mesh.sphere, 0, self.p, stressed
        )
        self.positive = ElectrodeSymbols(
            "positive", cell.positive, mesh.positive, mesh.sphere, -1, self.p, stressed
        )
        self.electrolyte = ElectrolyteSymbols(cell.electrolyte, self.layout, self.p)
        self.ageing = (
            DegradationSymbols(self.layout, self.negative, self.positive, self.p)
            if ageing
            else None
        )

    @property
    def electrodes(self) -> tuple[tuple[str, ElectrodeSymbols], ...]:
        """Suffix in the state's names, and the electrode."""
        return ("n", self.negative), ("p", self.positive)

    def initial_state(
        self, soc: float, temperature_K: float, values: Mapping[str, float]
    ) -> FloatArray:
        """A rested cell: uniform at `soc` of the stoichiometry window, no current."""
        layout, state = self.layout, np.zeros(self.layout.size)
        for (key, side), charge in zip(self.electrodes, (soc, 1.0 - soc), strict=True):
            low, high = (values[f"{side.name}.stoichiometry_{end}"] for end in ("min", "max"))
            modes = state[layout.slice_of(f"modes_{key}")]
            modes[: side.layer.size] = low + charge * (high - low)
        state[layout.slice_of("salt")] = values["electrolyte.initial_concentration_mol_m3"]
        state[layout.slice_of("temperature_K")] = temperature_K
        if self.ageing:
            film, crack_film = self.ageing.first_films(values)
            first = {"film": film, "crack_film": crack_film, "left_n": 1.0, "left_p": 1.0}
            first |= {"crack_m": values["cracking.initial_length_m"]}
            first |= {"porosity": values["negative.porosity"]}
            for name, value in first.items():
                state[layout.slice_of(name)] = value
        return state

    def lithium_mol(self, state: FloatArray, values: Mapping[str, float]) -> dict[str, float]:
        """Where the lithium of one cell is [mol]."""
        area, layout = values["area_m2"], self.layout

        def total(name: str, of: str) -> float:
            span = layout.slice_of(name)
            nodes = layout.layer(of).size
            return float(
                area * values[f"{of}.thickness_m"] * (layout.layer(of).weight @ state[span][:nodes])
            )

        out = {}
        for key, side in self.electrodes:
            own = {k.partition(".")[2]: v for k, v in values.items() if k.startswith(side.name)}
            solid = own["specific_area_m2_m3"] * own["particle_radius_m"] / 3
            mean = state[layout.slice_of(f"modes_{key}")][: side.layer.size]
            left = state[layout.slice_of(f"left_{key}")] if self.ageing else 1.0
            held = own["max_concentration_mol_m3"] * solid * area * own["thickness_m"]
            out[side.name] = float(held * (side.layer.weight @ (mean * left)))
            if self.ageing:
                trapped = state[layout.slice_of(f"trapped_{key}")]
                out[f"trapped_{side.name}"] = float(held * (side.layer.weight @ trapped))
        salt, dissolved = state[layout.slice_of("salt")], 0.0
        for name, span in layout.layers().items():
            porosity = np.array(values[f"{name}.porosity"])
            if self.ageing and name == "negative":
                porosity = state[layout.slice_of("porosity")]
            weight = layout.layer(name).weight * values[f"{name}.thickness_m"]
            dissolved += float(area * weight @ (porosity * salt[span]))
        out["electrolyte"] = dissolved
        if self.ageing:
            names = {"film": "sei", "crack_film": "sei_on_cracks"} | {
                k: k for k in ("plated", "dead")
            }
            out |= {said: total(name, "negative") for name, said in names.items()}
        return out

    def step(self) -> ca.Function:
        """The kernel: (state, drive, p) -> (next state, OUTPUTS); drive as in DRIVE."""
        prepare, newton, finish = self._prepare(), self._newton(), self._finish()
        state = ca.MX.sym("state", self.layout.size)
        drive = ca.MX.sym("drive", len(DRIVE))
        p = ca.MX.sym("p", len(self.p))
        guess, *prepared = prepare(state, drive, p)
        refine = self._refine(newton)
        z, correction = newton(guess, *prepared[:4], state, drive, p)
        for _ in range(MAX_ITERATIONS - 1):
            z, correction = refine(
                correction > CONVERGED_V, correction, z, *prepared[:4], state, drive, p
            )
        following, out = finish(z, *prepared[4:], state, drive, p)
        out = ca.vertcat(out[:3], correction, out[3:])
        names = ["state", "drive", "p"], ["next", "out"]
        return ca.Function("step", [state, drive, p], [following, out], *names)

    def _prepare(self) -> ca.Function:
        """(state, drive, p) -> guess, surfaces at no end flux and their gains, modes and losses."""
        state, drive = ca.SX.sym("state", self.layout.size), ca.SX.sym("drive", len(DRIVE))
        old = self.layout.split(state)
        area = self.p["area_m2"]
        drawn_A = area * ca.dot(self._area("n", old), self._old_total("n", old))
        guess, surfaces, gains, kept, losses = [old["salt"], old["phi"]], [], [], [], []
        for key, side in self.electrodes:
            modes, reaction = old[f"modes_{key}"], old[f"reaction_{key}"]
            known, loss = side.diffuse(modes, reaction, old["temperature_K"], drive[0])
            surfaces.append(ca.sum2(known))
            gains.append(ca.repmat(ca.sum2(loss), side.layer.size // loss.shape[0], 1))
            kept.append(known)
            losses.append(loss)
            change = side.outward * (drive[1] - drawn_A)
            guess.append(reaction + change / (area * ca.sum1(self._area(key, old))))
        outputs = [ca.vertcat(*guess), *surfaces, *gains, *kept, *losses]
        return ca.Function("prepare", [state, drive, self.p.vector], outputs)

    def _newton(self) -> ca.Function:
        """(z, surfaces, gains, state, drive, p) -> z corrected, largest change of a potential."""
        layout = self.layout
        sizes = layout.electrodes
        z = _Unknown(*(ca.SX.sym("z", n) for n in (layout.nodes, layout.nodes, *sizes)))
        surfaces, gains = ([ca.SX.sym("x", n) for n in sizes] for _ in range(2))
        state, drive = ca.SX.sym("state", layout.size), ca.SX.sym("drive", len(DRIVE))
        old = layout.split(state)
        at_surface = [
            surfaces[0] - gains[0] * z.reaction_n,
            surfaces[1] - gains[1] * z.reaction_p,
        ]
        surface = self._surfaces(z, at_surface, old, drive[0])
        phi_s = [s.phi_s for s in surface]
        order = layout.elimination_order()
        residual = self._residual(z, surface, old, drive)[order]
        jacobian = ca.jacobian(residual, z.vector())[:, order]
        solution = elimination.solve(jacobian, -residual)
        correction = solution[np.argsort(order).tolist()]
        solid_change = ca.jtimes(ca.vertcat(*phi_s), z.vector(), correction)
        phi_change = correction[layout.nodes : 2 * layout.nodes]
        largest_V = ca.norm_inf(ca.vertcat(phi_change, solid_change))
        inputs = [z.vector(), *surfaces, *gains, state, drive, self.p.vector]
        return ca.Function("newton", inputs, [z.vector() + correction, largest_V])

    def _refine(self, newton: ca.Function) -> ca.Function:
        """(wanted, correction, z, ...) -> one more iteration if wanted, else as it is."""
        inputs = [ca.MX.sym("correction_V"), *newton.mx_in()]
        more = ca.Function("more", inputs, list(newton(*inputs[1:])))
        enough = ca.Function("enough", inputs, [inputs[1], inputs[0]])
        return ca.Function.if_else("refine", more, enough)

    def _area(self, key: str, old: Mapping[str, ca.SX]) -> ca.SX:
        """Active surface of each node of an electrode per coated area (n,)."""
        side = self.negative if key == "n" else self.positive
        return side.area_per_node(old[f"left_{key}"] if self.ageing else 1.0)

    def _old_total(self, key: str, old: Mapping[str, ca.SX]) -> ca.SX:
        """Current through the surface at the start of the step (n,) [A/m2]."""
        return old["total_n"] if self.ageing and key == "n" else old[f"reaction_{key}"]

    def _surfaces(
        self, z: _Unknown, at_surface: list[ca.SX], old: Mapping[str, ca.SX], step_s: ca.SX
    ) -> tuple[_Surface, _Surface]:
        """What happens at the particles of both electrodes at the end of the step."""
        out = []
        for (key, side), x, reaction in zip(
            self.electrodes, at_surface, (z.reaction_n, z.reaction_p), strict=True
        ):
            span = self.layout.layers()[side.name]
            over = side.potential_V(x, reaction, z.salt[span], old["temperature_K"])
            intercalated = (reaction + old[f"reaction_{key}"]) / 2
            if self.ageing and key == "n":
                begun = self.ageing.begin(old, step_s)
                plated, strip = self.ageing.strip(begun, old, over, z.salt[span], step_s)
                beside = strip + begun.current_A_m2
                total = reaction + beside
                drop = total * (begun.resistance_ohm_m2 + side("film_ohm_m2"))
                out.append(
                    _Surface(z.phi[span] + over + drop, total, intercalated + beside, plated)
                )
            else:
                drop = reaction * side("film_ohm_m2")
                out.append(_Surface(z.phi[span] + over + drop, reaction, intercalated, ca.SX()))
        return out[0], out[1]

    def _residual(
        self,
        z: _Unknown,
        surfaces: tuple[_Surface, _Surface],
        old: Mapping[str, ca.SX],
        drive: ca.SX,
    ) -> ca.SX:
        """All balances, in the order of `_Unknown.vector`."""
        step_s, current_A = drive[0], drive[1]
        porosity = self.ageing.begin(old, step_s).porosity if self.ageing else None
        salt, charge = self.electrolyte.balances(z.salt, z.phi, old, step_s, porosity)
        t_plus = self.p["electrolyte.transference"]
        solid = []
        for (key, side), surface in zip(self.electrodes, surfaces, strict=True):
            span, area = self.layout.layers()[side.name], self._area(key, old)
            carried = t_plus * (surface.total + self._old_total(key, old)) / 2
            salt[span] -= step_s / FARADAY_C_mol * area * (surface.released - carried)
            charge[span] -= area * surface.total
            solid.append(side.solid_charge(surface.phi_s, area * surface.total, current_A))
        charge[self.layout.grounded] = z.phi[self.layout.grounded]
        return ca.vertcat(salt, charge, *solid)

    def _finish(self) -> ca.Function:
        """(z, modes, losses, state, drive, p) -> next state, OUTPUTS but for the correction."""
        layout, m = self.layout, self.layout.mesh.sphere.size
        z = _Unknown(*(ca.SX.sym("z", n) for n in (layout.nodes, layout.nodes, *layout.electrodes)))
        state, drive = ca.SX.sym("state", layout.size), ca.SX.sym("drive", len(DRIVE))
        old = layout.split(state)
        kept, losses, modes = [], [], []
        for (_, side), reaction in zip(self.electrodes, (z.reaction_n, z.reaction_p), strict=True):
            rows = 1 if side.uniform_diffusivity else side.layer.size
            kept.append(ca.SX.sym("kept", side.layer.size, m))
            losses.append(ca.SX.sym("loss", rows, m))
            lost = ca.repmat(losses[-1], side.layer.size // rows, 1)
            modes.append(kept[-1] - lost * ca.repmat(reaction, 1, m))
        surfaces = [ca.sum2(q) for q in modes]
        ends = self._surfaces(z, surfaces, old, drive[0])
        voltage = ends[1].phi_s[-1] - ends[0].phi_s[0] - self.p["series_resistance_ohm"] * drive[1]
        enthalpy, heat, temperature = self._heat(z, surfaces, voltage, old, drive)
        following = ca.vertcat(
            *(ca.vec(q) for q in modes), z.vector(), enthalpy, voltage, temperature
        )
        if self.ageing:  # what Newton left of the nonlinear side reactions goes where it belongs
            area = self.p["area_m2"] * self._area("n", old)
            missing_A = drive[1] - ca.dot(area, ends[0].total)
            whole = replace(ends[0], total=ends[0].total + missing_A / ca.sum1(area))
            ends = (whole, ends[1])
            row = self._residual(z, ends, old, drive)[: layout.nodes]
            pores = self.electrolyte.pores_m(self.ageing.begin(old, drive[0]).porosity)
            following[layout.slice_of("salt")] -= row / pores
            following = self._aged(following, ends[0], modes, old, drive[0])
        x = ca.vertcat(*surfaces)
        mean = ca.dot(ca.DM(self.negative.layer.weight), modes[0][:, 0])
        outputs = ca.vertcat(
            voltage, temperature, heat, ca.mmin(z.salt), ca.mmin(ca.fmin(x, 1 - x)), mean
        )
        inputs = [z.vector(), *kept, *losses, state, drive, self.p.vector]
        return ca.Function("finish", inputs, [following, outputs])

    def _aged(
        self,
        following: ca.SX,
        negative: _Surface,
        modes: list[ca.SX],
        old: Mapping[str, ca.SX],
        step_s: ca.SX,
    ) -> ca.SX:
        """The next state with its ageing part; lost surface leaves a node's current as it was."""
        assert self.ageing is not None
        begun = self.ageing.begin(old, step_s)
        parts = dict(zip(("n", "p"), modes, strict=True))
        aged = self.ageing.end(begun, old, parts, negative.plated, step_s)
        aged["total_n"] = negative.total * old["left_n"] / aged["left_n"]
        for key in ("n", "p"):
            span = self.layout.slice_of(f"reaction_{key}")
            following[span] *= old[f"left_{key}"] / aged[f"left_{key}"]
        return ca.vertcat(following, *(aged[name] for name in self.layout.ageing_sizes()))

    def _heat(
        self, z: _Unknown, surfaces: list[ca.SX], voltage: ca.SX, old: Mapping[str, ca.SX],
        drive: ca.SX,
    ) -> tuple[ca.SX, ca.SX, ca.SX]:  # fmt: skip
        """Enthalpy potential at all electrode nodes, heat and temperature after the step."""
        step_s, current_A, ambient_K, transfer_W_m2_K, heating = ca.vertsplit(drive)
        temperature = old["temperature_K"]
        enthalpy = ca.vertcat(
            *(
                side.enthalpy_V(surface, temperature)
                for (_, side), surface in zip(self.electrodes, surfaces, strict=True)
            )
        )
        areas = self.p["area_m2"] * ca.vertcat(*(self._area(k, old) for k, _ in self.electrodes))
        before_A = areas * ca.vertcat(old["reaction_n"], old["reaction_p"])
        after_A = areas * ca.vertcat(z.reaction_n, z.reaction_p)
        n = self.negative.layer.size
        drawn_A = ca.dot(areas[:n], self._old_total("n", old))
        mean_W = self_heating.mean_released_W(
            (before_A, after_A), (old["enthalpy_V"], enthalpy), (drawn_A, current_A),
            (old["voltage_V"], voltage),
        )  # fmt: skip
        cooling_W_K = transfer_W_m2_K * self.p["cooling_area_m2"]
        warmer_K = self_heating.rise_K(
            temperature - ambient_K, mean_W, cooling_W_K, self.p["heat_capacity_J_K"], step_s
        )
        heat = self_heating.released_W(after_A, enthalpy, current_A, voltage)
        return enthalpy, heat, temperature + heating * warmer_K
