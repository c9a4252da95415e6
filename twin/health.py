"""What a pack has lost: capacity, lithium, active material; and what resistance it has gained.

All of it follows from the state of the cell at that moment, nothing from the load it lives under.
"""

from dataclasses import dataclass, fields

import casadi as ca
import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from twin.adaptive import Stepper
from twin.audit import audit
from twin.constants import FARADAY_C_mol
from twin.kernel import Backend
from twin.mesh import Mesh
from twin.pack import Pack, PackError
from twin.protocol import TOLERANCE_V
from twin.simulate import DEFAULT_MESH

FloatArray = npt.NDArray[np.float64]

PULSE_S = 10
EDGE = 1e-9  # of stoichiometry: potentials are infinite at 0 and at 1


@dataclass(frozen=True, slots=True, kw_only=True)
class LostLithium:
    """Lithium that left the particles, by where it is now, as charge of the pack [C]."""

    sei_C: float
    sei_on_cracks_C: float
    plated_C: float
    dead_C: float
    trapped_C: float

    @property
    def total_C(self) -> float:
        """All of it; plated lithium may yet return."""
        return float(sum(getattr(self, f.name) for f in fields(self)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Health:
    """A pack at a moment, beside the same pack when new.

    Attributes:
        capacity_C: charge between the cut-off voltages of the cells in equilibrium, at the
            reference temperature: the stoichiometries follow from the lithium and the active
            material there are, so no discharge is simulated and no rate enters.
        lithium_loss: share of the lithium in the particles that is no longer in active particles.
        negative_loss: share of the active material that is lost.
        positive_loss: likewise.
        lost: the same lithium by mechanism.
        resistance_ohm: voltage drop over current, at once on a 1C discharge of the rested pack at
            half of the capacity it has, at the reference temperature; NaN if it cannot bear that.
        resistance_10s_ohm: the same after 10 s.
        lithium_error: relative, of all lithium since the start of life; 0 but for rounding.
        salt_change: relative, of the lithium in the electrolyte since the start of life. Its anions
            take part in nothing, so it shows the error of the steps in time.
        charge_error_C: drawn from one cell minus what its positive electrode took up, since then.
    """

    capacity_C: float
    lithium_loss: float
    negative_loss: float
    positive_loss: float
    lost: LostLithium
    resistance_ohm: float
    resistance_10s_ohm: float
    lithium_error: float
    salt_change: float
    charge_error_C: float


@dataclass(frozen=True, slots=True)
class _Window:
    """Stoichiometries of the rested cell at its cut-offs, and the charge between them [C]."""

    negative: tuple[float, float]
    positive: tuple[float, float]
    charge_C: float


class Examiner:
    """Examines states of one pack (on one mesh); built once, since it holds functions.

    PackError for a pack of unlike cells: each of them has a health of its own.
    """

    def __init__(
        self, pack: Pack, *, mesh: Mesh = DEFAULT_MESH, backend: Backend = Backend.AUTO
    ) -> None:
        self._pack = pack
        self._stepper = Stepper(pack, pack.cell.reference_K, TOLERANCE_V, mesh, backend)
        if len(self._stepper.kinds) > 1:
            raise PackError("a pack of unlike cells is not examined as one: leave out weak_cell")
        self._model, self._values = self._stepper.model.cell, self._stepper.kinds[0].values
        x, y = ca.SX.sym("x"), ca.SX.sym("y")
        open_V = pack.cell.positive.ocp_V(y) - pack.cell.negative.ocp_V(x)
        self._open_circuit_V = ca.Function("open_circuit", [x, y], [open_V])
        self.new = self._stepper.model.initial_state(self._stepper.kinds)
        """(states,) of a cell at the start of life."""

    def examine(self, state: FloatArray, net_charge_C: float) -> Health:
        """The pack in `state`, `net_charge_C` having been drawn from it since it was new."""
        before, now = (self._model.lithium_mol(s, self._values) for s in (self.new, state))
        balance = audit(
            self._model, self._values, (self.new, state), net_charge_C / self._pack.parallel
        )
        cyclable = [m["negative"] + m["positive"] for m in (before, now)]
        window = self._window(state)
        at_once, after_10_s = self._resistances(state, window)
        gone = {k: self._as_charge(now[k] - before[k]) for k in now if k not in ALIVE}
        return Health(
            capacity_C=window.charge_C * self._pack.parallel,
            lithium_loss=1 - cyclable[1] / cyclable[0],
            negative_loss=1 - self._left("negative", state),
            positive_loss=1 - self._left("positive", state),
            lost=LostLithium(
                sei_C=gone.get("sei", 0.0),
                sei_on_cracks_C=gone.get("sei_on_cracks", 0.0),
                plated_C=gone.get("plated", 0.0),
                dead_C=gone.get("dead", 0.0),
                trapped_C=sum(gone.get(f"trapped_{s}", 0.0) for s in ("negative", "positive")),
            ),
            resistance_ohm=at_once,
            resistance_10s_ohm=after_10_s,
            lithium_error=balance.relative_error,
            salt_change=now["electrolyte"] / before["electrolyte"] - 1,
            charge_error_C=balance.charge_error_C,
        )

    def _as_charge(self, mol: float) -> float:
        return FARADAY_C_mol * mol * self._pack.parallel

    def _left(self, side: str, state: FloatArray) -> float:
        """Share of an electrode's active material that still takes part."""
        if not self._pack.ages:
            return 1.0
        weight = self._model.layout.layer(side).weight
        return float(weight @ state[self._model.layout.slice_of(f"left_{side[0]}")])

    def _sites_mol(self, state: FloatArray) -> tuple[float, float]:
        """Lithium that the active material of one cell can hold, negative and positive."""
        lithium = self._model.lithium_mol(self._filled(state, (1.0, 1.0)), self._values)
        return lithium["negative"], lithium["positive"]

    def _filled(self, state: FloatArray, stoichiometry: tuple[float, float]) -> FloatArray:
        """`state` with every particle uniform, negative and positive."""
        layout, out = self._model.layout, state.copy()
        for side, x in zip(("negative", "positive"), stoichiometry, strict=True):
            modes = out[layout.slice_of(f"modes_{side[0]}")]  # a view: the means come first
            modes[:] = 0.0
            modes[: layout.layer(side).size] = x
        return out

    def _window(self, state: FloatArray) -> _Window:
        """Where the lithium in the particles lies at the two cut-offs, every particle rested."""
        lithium = self._model.lithium_mol(state, self._values)
        inventory = lithium["negative"] + lithium["positive"]
        holds = self._sites_mol(state)

        def positive(x: float) -> float:
            return (inventory - holds[0] * x) / holds[1]

        low = max(EDGE, (inventory - holds[1] * (1 - EDGE)) / holds[0])
        high = min(1 - EDGE, (inventory - holds[1] * EDGE) / holds[0])

        def reaches(voltage_V: float) -> float:
            def above_V(x: float) -> float:
                return float(self._open_circuit_V(x, positive(x))) - voltage_V

            if above_V(low) >= 0:  # an electrode is empty or full before the voltage is reached
                return low
            return high if above_V(high) <= 0 else float(brentq(above_V, low, high, xtol=1e-14))

        ends = reaches(self._pack.cell.lower_cut_off_V), reaches(self._pack.cell.upper_cut_off_V)
        return _Window(
            negative=ends,
            positive=(positive(ends[0]), positive(ends[1])),
            charge_C=FARADAY_C_mol * holds[0] * (ends[1] - ends[0]),
        )

    def _resistances(self, state: FloatArray, window: _Window) -> tuple[float, float]:
        """At once and after PULSE_S, of the pack [ohm]."""
        rate_A = self._pack.scale * self._pack.cell.nominal_capacity_C / 3600
        rest = self._stepper.jump(self._rested(state, window), 0.0, 0.0)
        point = self._stepper.jump(rest.state, 0.0, rate_A)
        drops = [rest.voltage_V - point.voltage_V]
        for _ in range(PULSE_S):
            point = self._stepper.move(point.state, 1.0, rate_A)
        drops.append(rest.voltage_V - point.voltage_V)
        scale = self._pack.series / self._pack.parallel / rate_A
        return drops[0] * scale, drops[1] * scale

    def _rested(self, state: FloatArray, window: _Window) -> FloatArray:
        """A cell that aged as `state` did, without gradients, in the middle of its capacity."""
        layout, pack = self._model.layout, self._pack
        new = self._model.initial_state(0.5, pack.cell.reference_K, self._values)
        out = self._filled(new, (sum(window.negative) / 2, sum(window.positive) / 2))
        for name in layout.ageing_sizes():
            if name not in CURRENTS:
                out[layout.slice_of(name)] = state[layout.slice_of(name)]
        content, uniform = (
            self._model.lithium_mol(s, self._values)["electrolyte"] for s in (state, out)
        )
        out[layout.slice_of("salt")] *= content / uniform
        return out


CURRENTS = ("total_n", "strip_n")
"""Of what ageing adds to the state: zero at rest; all else lasts."""
ALIVE = ("negative", "positive", "electrolyte")
"""Where lithium may be that is not lost."""
