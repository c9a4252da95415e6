"""One implicit time step of the P2D model as a CasADi function: all balances put together.

Unknown after the step are, in each electrode, the reaction current i at every node (oxidation
positive) and the gap u between solid and electrolyte at the separator. All else follows from them:
  particles   x_surface = known - gain i                              (particle.py, exact)
  salt        c = known + response (current through the surfaces)     (electrolyte.py)
  potentials  phi_s - phi_e = u + losses (current through them)       (electrode.py, Ohm's law)
so Newton's method is left with, at every node and for each electrode as a whole,
  phi_s - phi_e = U(x_surface) + eta(i, c) + film loss,    sum of a L w i = current drawn.
Both electrodes are solved each for itself; they meet in the salt, which every iteration takes
along. The sums of lithium, salt and charge are exact for any iterate.

With hysteresis U is beside its equilibrium, by a state that follows from i in closed form.

In time: salt diffusion backward Euler; reactions run straight over the step, for which particles
are exact and heat is the exact mean of its factors' products. Diffusivities are those at the start,
conductivities those of the salt that unchanged reactions would lead to. A step of length 0 answers
a jump.
"""

from collections.abc import Mapping

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin import inventory, kinetics, newton
from twin.cell import Cell
from twin.degradation import Begun, DegradationSymbols
from twin.effects import Mechanics, OcvHysteresis, self_heating
from twin.electrode import ElectrodeSymbols
from twin.electrolyte import ElectrolyteSymbols
from twin.kinetics import SALT_FLOOR_mol_m3
from twin.layout import Layout
from twin.mesh import Mesh
from twin.parameters import (
    Symbols,
    ageing_parameters,
    cell_parameters,
    hysteresis_parameters,
    mechanics_parameters,
)
from twin.stages import Both, Ready, Side, Surface, Unknown

FloatArray = npt.NDArray[np.float64]

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
    "anode_V",
    "negative_under_least",
    "negative_under_most",
    "positive_under_least",
    "positive_under_most",
)
"""Of a step, for one cell; `surface_margin` is the least distance of a surface stoichiometry from 0
and 1, `negative_mean` the negative electrode's mean stoichiometry, `anode_V` the least over its
nodes of phi_s - phi_e less the film's loss (below 0 lithium plates), `under` the stoichiometry at a
particle's surface below the particle's mean, which stress goes with: its extremes over the nodes.
"""


class StepModel:
    """The equations of a cell on a mesh; `step()` puts them together."""

    def __init__(
        self, cell: Cell, mesh: Mesh, *, ageing: bool = False, stressed: bool = False,
        hysteretic: bool = False,
    ) -> None:  # fmt: skip
        self.layout = Layout(mesh, ageing=ageing, hysteretic=hysteretic)
        names = cell_parameters(cell)
        names |= mechanics_parameters(Mechanics()) if stressed else {}
        names |= hysteresis_parameters(cell, OcvHysteresis()) if hysteretic else {}
        names |= ageing_parameters() if ageing else {}
        self.p = Symbols(tuple(names))
        self.negative = ElectrodeSymbols(
            "negative", cell.negative, mesh.negative, mesh.sphere, 0, self.p, stressed,
            cell.negative_hysteresis,
        )  # fmt: skip
        self.positive = ElectrodeSymbols(
            "positive", cell.positive, mesh.positive, mesh.sphere, -1, self.p, stressed,
            cell.positive_hysteresis,
        )  # fmt: skip
        self.electrolyte = ElectrolyteSymbols(cell.electrolyte, self.layout, self.p)
        self.ageing = (
            DegradationSymbols(self.layout, self.negative, self.positive, self.p)
            if ageing
            else None
        )
        self.state = ca.SX.sym("state", self.layout.size)
        self.drive = ca.SX.sym("drive", len(DRIVE))
        self.old = self.layout.split(self.state)

    @property
    def electrodes(self) -> tuple[ElectrodeSymbols, ElectrodeSymbols]:
        """Negative and positive."""
        return self.negative, self.positive

    def initial_state(
        self, soc: float, temperature_K: float, values: Mapping[str, float]
    ) -> FloatArray:
        """A rested cell: uniform at `soc` of the stoichiometry window, no current."""
        return inventory.initial_state(self.layout, soc, temperature_K, values)

    def lithium_mol(self, state: FloatArray, values: Mapping[str, float]) -> dict[str, float]:
        """Where the lithium of one cell is [mol]."""
        return inventory.Lithium(self.layout, values).mol(state)

    def step(self) -> ca.Function:
        """(state, drive, p) -> (next state, OUTPUTS); drive as in DRIVE."""
        return newton.joined(*self.parts())

    def parts(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        """Of a step: what is before, in, and after an iteration of Newton's method."""
        ready = self.prepared()
        given = [self.state, self.drive, self.p.vector]
        prepare = ca.Function("prepare", given, [self._guess(ready).vector(), *ready.all()])
        z, known = self.unknown(), ready.alike()
        inputs = [z.vector(), *known.all(), *given]
        correct = ca.Function("correct", inputs, list(newton.corrected(self, z, known)))
        answers = ca.SX.sym("answers", sum(self.layout.electrodes))
        finish = ca.Function(
            "finish", [inputs[0], answers, *inputs[1:]], list(self.finished(z, answers, known))
        )
        return prepare, correct, finish

    def unknown(self) -> Unknown:
        """Fresh symbols."""
        n, p = (ca.SX.sym("i", side.layer.size) for side in self.electrodes)
        return Unknown((n, p), ca.SX.sym("gap", 2), ca.SX.sym("salt", self.layout.nodes))

    def prepared(self) -> Ready:
        """`Ready` as expressions of state, drive and parameters."""
        begun = self.begun()
        porosity = begun.porosity if begun else None
        salt, response = self.electrolyte.diffuse(self.old, self.drive[0], porosity)
        before = response @ self.transfer(self.old_totals())
        return self.ready(begun, salt + before, (salt + before / 2, response / 2))

    def begun(self) -> Begun | None:
        """Ageing over the step as far as it follows from the start alone."""
        return self.ageing.begin(self.old, self.drive[0]) if self.ageing else None

    def ready(self, begun: Begun | None, expected: ca.SX, salt: Both) -> Ready:
        """`Ready`; `expected` is the salt that unchanged reactions lead to, `salt` two of it."""
        old, conductivity, sides = self.old, self.electrolyte.conductivity_S_m, []
        porosity = begun.porosity if begun else None
        for side, start in zip(self.electrodes, self.start_currents(begun), strict=True):
            kept, lost = side.diffuse(
                old[f"modes_{side.key}"], start, old["temperature_K"], self.drive[0]
            )
            gain = ca.repmat(ca.sum2(lost), side.layer.size // lost.shape[0], 1)
            losses = side.losses_ohm_m2(conductivity(side.name, expected, old, porosity))
            sides.append(Side(kept, lost, ca.sum2(kept), gain, losses))
        weight = ca.DM(self.layout.layer("separator").weight)
        between = ca.dot(weight, 1 / conductivity("separator", expected, old, None))
        return Ready(
            (sides[0], sides[1]),
            between * self.p["separator.thickness_m"],
            *salt,
            begun.packed() if begun else ca.SX.zeros(1),
        )

    def start_currents(self, begun: Begun | None) -> Both:
        """Intercalation when the step starts [A/m2]: what side reactions leave of the current."""
        old = self.old
        if not begun:
            return old["reaction_n"], old["reaction_p"]
        return old["total_n"] - old["strip_n"] - begun.current_A_m2, old["reaction_p"]

    def old_totals(self) -> Both:
        """Currents through the surfaces at the start of the step [A/m2]."""
        return self.old["total_n" if self.ageing else "reaction_n"], self.old["reaction_p"]

    def _expected_totals(self) -> Both:
        """A first guess of them at its end: reactions answer the current as in the last step."""
        old, (negative, positive) = self.old, self.old_totals()
        more_A = self._missing(self.negative, negative) * self.p["area_m2"]
        return negative + more_A * old["answer_n"], positive + more_A * old["answer_p"]

    def _guess(self, ready: Ready) -> Unknown:
        totals, old = self._expected_totals(), self.old
        beside = self.old_totals()[0] - old["reaction_n"]
        salt = ready.salt + ready.response @ self.transfer(totals)
        return Unknown((totals[0] - beside, totals[1]), old["gap_V"], salt)

    def _area(self, side: ElectrodeSymbols) -> ca.SX:
        """Active surface of each node of an electrode per coated area (n,)."""
        return side.area_per_node(self.old[f"left_{side.key}"] if self.ageing else 1.0)

    def transfer(self, totals: Both) -> ca.SX:
        """(n + p,) current that leaves the solid at each node [A/m2 of coated area]."""
        return ca.vertcat(*map(self.transfer_of, self.electrodes, totals))

    def transfer_of(self, side: ElectrodeSymbols, total: ca.SX) -> ca.SX:
        """(n,) the same of one electrode."""
        return self._area(side) * total

    def _missing(self, side: ElectrodeSymbols, total: ca.SX) -> ca.SX:
        """() current drawn less what leaves the solid [A/m2 of coated area]."""
        drawn = side.outward * self.drive[1] / self.p["area_m2"]
        return drawn - ca.sum1(self.transfer_of(side, total))

    def surfaces(self, z: Unknown, ready: Ready) -> tuple[Surface, Surface]:
        """What happens at the particles of both electrodes at the end of the step."""
        out, temperature = [], self.old["temperature_K"]
        for side, own, reaction in zip(self.electrodes, ready.sides, z.reactions, strict=True):
            salt = z.salt[self.layout.layers()[side.name]]
            x = own.surface - own.gain * reaction
            over = side.potential_V(x, reaction, salt, temperature)
            if self.layout.hysteretic:
                over += side.off_equilibrium_V(x, self._hysteresis(side, reaction, ready))
            total, film, strip, plated = reaction, side("film_ohm_m2"), ca.SX(0), ca.SX()
            if self.ageing and side is self.negative:
                begun = Begun.unpacked(ready.begun)
                plated, strip = self.ageing.strip(begun, self.old, over, salt, self.drive[0])
                total = reaction + strip + begun.current_A_m2
                film = film + begun.resistance_ohm_m2
            out.append(Surface(over, over + total * film, total, strip, plated))
        return out[0], out[1]

    def _hysteresis(self, side: ElectrodeSymbols, reaction: ca.SX, ready: Ready) -> ca.SX:
        """(n,) of an electrode after the step, `reaction` flowing at its end."""
        begun = Begun.unpacked(ready.begun) if self.ageing else None
        start = self.start_currents(begun)[0 if side is self.negative else 1]
        before = self.old[f"hysteresis_{side.key}"]
        return side.hysteresis(before, (start, reaction), self.drive[0])

    def misses(
        self, z: Unknown, ready: Ready, surfaces: tuple[Surface, Surface]
    ) -> list[tuple[ca.SX, ca.SX]]:
        """What Newton's method makes zero.

        Of each electrode: phi_s - phi_e less what the surface needs (n,) [V], and the current that
        is missing () [A/m2 of coated area].
        """
        out = []
        for k, (side, own, surface) in enumerate(
            zip(self.electrodes, ready.sides, surfaces, strict=True)
        ):
            log_salt = kinetics.log_salt(z.salt[self.layout.layers()[side.name]])
            there = z.gap_V[k] + side.solid_V(self.drive[1])
            there -= own.losses_ohm_m2 @ self.transfer_of(side, surface.total)
            there -= self.diffusion_V() * (log_salt - log_salt[side.separator])
            out.append((there - surface.needed_V, self._missing(side, surface.total)))
        return out

    def diffusion_V(self) -> ca.SX:
        """() potential in the electrolyte per change of ln c."""
        return self.electrolyte.diffusion_V(self.old["temperature_K"])

    def floored(self, side: ElectrodeSymbols, salt: ca.SX) -> ca.SX:
        """(n,) salt in an electrode, no less than what `kinetics.log_salt` is straight below."""
        own: ca.SX = ca.fmax(salt[self.layout.layers()[side.name]], SALT_FLOOR_mol_m3)
        return own

    def finished(self, z: Unknown, answers: ca.SX, ready: Ready) -> Both:
        """Next state, OUTPUTS but for the correction."""
        surfaces = self.surfaces(z, ready)
        totals, reactions = (surfaces[0].total, surfaces[1].total), z.reactions
        if self.ageing:  # what Newton left of nonlinear side reactions goes into the particles
            extra = self._missing(self.negative, totals[0]) / ca.sum1(self._area(self.negative))
            totals, reactions = (totals[0] + extra, totals[1]), (reactions[0] + extra, reactions[1])
        modes = self._modes(reactions, surfaces[0], ready)
        salt = ready.salt + ready.response @ self.transfer(totals)
        ends = ca.sum2(modes[0]), ca.sum2(modes[1])
        voltage = self._voltage_V(Unknown(reactions, z.gap_V, salt), totals, ready)
        begun = Begun.unpacked(ready.begun) if self.ageing else None
        enthalpy, heat, temperature = self._heat(
            (self.start_currents(begun), reactions), ends, voltage
        )
        parts = [*(ca.vec(q) for q in modes), salt, *reactions, z.gap_V, answers, enthalpy]
        parts += [voltage, temperature]
        if self.layout.hysteretic:
            both = zip(self.electrodes, reactions, strict=True)
            parts += [self._hysteresis(*own, ready) for own in both]
        following = ca.vertcat(*parts)
        if begun:
            following = self._aged(following, begun, (surfaces[0], totals[0]), modes)
        told = self._told(modes, ends, surfaces[0].bare_V)
        return following, ca.vertcat(voltage, temperature, heat, ca.mmin(salt), told)

    def _told(self, modes: Both, ends: Both, anode_V: ca.SX) -> ca.SX:
        """OUTPUTS from `surface_margin` on, of the particles' modes, surfaces and potentials."""
        x = ca.vertcat(*ends)
        mean = ca.dot(ca.DM(self.negative.layer.weight), modes[0][:, 0])
        under = [own[:, 0] - end for own, end in zip(modes, ends, strict=True)]
        extremes = [of(u) for u in under for of in (ca.mmin, ca.mmax)]
        return ca.vertcat(ca.mmin(ca.fmin(x, 1 - x)), mean, ca.mmin(anode_V), *extremes)

    def _modes(self, reactions: Both, negative: Surface, ready: Ready) -> Both:
        """Of the particles after the step."""
        out = []
        for side, own, reaction in zip(self.electrodes, ready.sides, reactions, strict=True):
            n, m = own.modes.shape
            lost = ca.repmat(own.lost, n // own.lost.shape[0], 1)
            modes = own.modes - lost * ca.repmat(reaction, 1, m)
            if self.ageing and side is self.negative:
                # the strip current is a mean, the total runs straight: half its change is left over
                modes[:, 0] += lost[:, 0] * (negative.strip - self.old["strip_n"])
            out.append(modes)
        return out[0], out[1]

    def _voltage_V(self, end: Unknown, totals: Both, ready: Ready) -> ca.SX:
        """At the terminals of the cell."""
        current_A = self.drive[1]
        gaps = [
            gap + side.collector_V(current_A, self.transfer_of(side, total))
            for side, gap, total in zip(
                self.electrodes, ca.vertsplit(end.gap_V), totals, strict=True
            )
        ]
        layers = (end.salt[self.layout.layers()[side.name]] for side in self.electrodes)
        left, right = (
            kinetics.log_salt(own)[side.separator]
            for own, side in zip(layers, self.electrodes, strict=True)
        )
        across = self.diffusion_V() * (right - left)
        across -= ready.separator_ohm_m2 * current_A / self.p["area_m2"]
        return gaps[1] - gaps[0] + across - self.p["series_resistance_ohm"] * current_A

    def _aged(
        self, following: ca.SX, begun: Begun, negative: tuple[Surface, ca.SX], modes: Both
    ) -> ca.SX:
        """The next state with its ageing part; lost surface leaves a node's current as it was."""
        assert self.ageing is not None
        old, (surface, total) = self.old, negative
        aged = self.ageing.end(begun, old, modes, surface.plated, self.drive[0])
        ratio = old["left_n"] / aged["left_n"]
        aged |= {"total_n": total * ratio, "strip_n": surface.strip * ratio}
        for key in ("n", "p"):
            span = self.layout.slice_of(f"reaction_{key}")
            following[span] *= old[f"left_{key}"] / aged[f"left_{key}"]
        return ca.vertcat(following, *(aged[name] for name in self.layout.ageing_sizes()))

    def _heat(
        self, reactions: tuple[Both, Both], surfaces: Both, voltage: ca.SX
    ) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Enthalpy potential at all electrode nodes, heat and temperature after the step.

        `reactions` at its start and end, `surfaces` (stoichiometry) and voltage at its end.
        """
        step_s, current_A, ambient_K, transfer_W_m2_K, heating = ca.vertsplit(self.drive)
        old = self.old
        temperature, area = old["temperature_K"], self.p["area_m2"]
        enthalpy = ca.vertcat(
            *(
                side.enthalpy_V(surface, temperature)
                for side, surface in zip(self.electrodes, surfaces, strict=True)
            )
        )
        before_A, after_A = (area * self.transfer(both) for both in reactions)
        n = self.negative.layer.size
        drawn_A = area * ca.sum1(self.transfer(self.old_totals())[:n])
        outside_ohm = self.p["outside_ohm"]
        inside = voltage + outside_ohm * current_A  # at the end of what warms the cell
        mean_W = self_heating.mean_released_W(
            (before_A, after_A), (old["enthalpy_V"], enthalpy), (drawn_A, current_A),
            (old["voltage_V"] + outside_ohm * drawn_A, inside),
        )  # fmt: skip
        warmer_K = self_heating.rise_K(
            temperature - ambient_K, mean_W, transfer_W_m2_K * self.p["cooling_area_m2"],
            self.p["heat_capacity_J_K"], step_s,
        )  # fmt: skip
        heat = self_heating.released_W(after_A, enthalpy, current_A, inside)
        return enthalpy, heat, temperature + heating * warmer_K
