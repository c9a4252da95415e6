"""What a pack has lost: capacity, lithium, active material; and what resistance it has gained.

All of it follows from the state of the cells at that moment, nothing from the load they live under.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import numpy.typing as npt

from twin.adaptive import Point, Stepper
from twin.audit import audit
from twin.constants import FARADAY_C_mol
from twin.equilibrium import Inventory, Window, window
from twin.kernel import Backend
from twin.limits import COLUMN
from twin.one_thread import SYMBOLS
from twin.pack import CellKind, Pack
from twin.protocol import TOLERANCE_V
from twin.solution import LithiumAudit
from twin.step import OUTPUTS

FloatArray = npt.NDArray[np.float64]

PULSE_S = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class LostLithium:
    """Lithium that left the particles, by where it is now, as charge of the pack [C]."""

    sei_C: float
    sei_on_cracks_C: float
    plated_C: float
    dead_C: float
    trapped_C: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Health:
    """A pack at a moment, beside the same pack when new.

    Attributes:
        capacity_C: charge between the cut-off voltages of the cells in equilibrium, at the
            reference temperature: the stoichiometries follow from the lithium and the active
            material there are, so no discharge is simulated and no rate enters. Unlike cells carry
            the same charge from where each one is; the cut-offs are those of their mean, or an
            electrode of one of them is full or empty before (`twin.equilibrium`).
        lithium_loss: share of the lithium in the particles that is no longer in active particles.
        negative_loss: share of the active material that is lost.
        positive_loss: likewise.
        lost: the same lithium by mechanism, of the mean cell where they are unlike.
        resistance_ohm: voltage drop over current, at once on a 1C discharge of the rested pack at
            half of the capacity it has, at the reference temperature; NaN if it cannot bear that.
        resistance_10s_ohm: the same after 10 s.
        lithium_error: relative, of all lithium since the start of life; 0 but for rounding. This
            and the next two are those of the kind of cell that is worst off.
        salt_change: relative, of the lithium in the electrolyte since the start of life. Its anions
            take part in nothing, so it shows the error of the steps in time.
        charge_error_C: drawn from one cell minus what its positive electrode took up, since then.
        cells: each kind of cell, in the order of `Pack.cells`; none where all are alike.
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
    cells: tuple["CellHealth", ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CellHealth:
    """One kind of cell in a pack of unlike ones.

    Attributes:
        health: of one place in the series by itself: its capacity is that between its own
            cut-offs, its resistance that of the place at half of the capacity of the pack.
        full_V: at rest where the pack is full; above the upper cut-off it is overcharged.
        empty_V: at rest where the pack is empty; below the lower cut-off it is discharged too far.
    """

    health: Health
    full_V: float
    empty_V: float


@dataclass(frozen=True, slots=True)
class _Kept:
    """Lithium of one kind of cell, new and now [mol], and what follows from it.

    Attributes:
        before: where it was.
        now: where it is.
        inventory: what is in its active particles now.
        sites: what its active material could hold when new, negative and positive.
        left: share of that which still takes part.
        balance: of all of it.
    """

    before: dict[str, float]
    now: dict[str, float]
    inventory: Inventory
    sites: tuple[float, float]
    left: tuple[float, float]
    balance: LithiumAudit

    @property
    def salt_change(self) -> float:
        """Relative, of the lithium in the electrolyte."""
        return self.now["electrolyte"] / self.before["electrolyte"] - 1


class Examiner:
    """Examines states of one pack; built once, since it holds functions."""

    def __init__(self, pack: Pack) -> None:
        self._pack = pack
        self._stepper = Stepper(pack, pack.cell.reference_K, TOLERANCE_V, None, Backend.AUTO)
        self._kinds, self._model = self._stepper.kinds, self._stepper.model.cell
        self._rate_A = pack.rated_C / pack.parallel / 3600
        self._shares = np.array([kind.count / pack.series for kind in self._kinds])
        with SYMBOLS:
            x, y = ca.SX.sym("x"), ca.SX.sym("y")
            open_V = pack.cell.positive.ocp_V(y) - pack.cell.negative.ocp_V(x)
            self._open_circuit_V = ca.Function("open_circuit", [x, y], [open_V])
            del x, y, open_V  # symbols die in this thread, too
        self.new = self._stepper.model.initial_state(self._kinds)
        """(states,) at the start of life."""

    def examine(self, state: FloatArray, net_charge_C: float) -> Health:
        """The pack in `state`, `net_charge_C` having been drawn from it since it was new."""
        states = self._stepper.model.states(state)
        new = self._stepper.model.states(self.new)
        each_C = net_charge_C / self._pack.parallel
        kept = [
            self._kept(kind, ends, each_C)
            for kind, *ends in zip(self._kinds, new, states, strict=True)
        ]
        whole = self._window(kept, self._shares)
        drops_V = self._drops_V(states, whole)
        per_A = 1 / self._pack.parallel / self._rate_A
        ohms = drops_V[0] * (self._pack.series / self._pack.parallel / self._rate_A)
        pack = self._health(kept, self._shares, whole.charge_C, ohms)
        if len(kept) == 1:
            return pack
        cells = [
            self._cell_health(one, volts, drop_V * per_A)
            for one, volts, drop_V in zip(kept, whole.voltage_V.tolist(), drops_V[1:], strict=True)
        ]
        return replace(pack, cells=tuple(cells))

    def _kept(self, kind: CellKind, ends: Sequence[FloatArray], charge_C: float) -> _Kept:
        """From the states (new, now) of one kind of cell, `charge_C` drawn between them."""
        new, now = ends
        before, after = (self._model.lithium_mol(s, kind.values) for s in ends)
        return _Kept(
            before=before,
            now=after,
            inventory=Inventory(
                negative=after["negative"],
                positive=after["positive"],
                holds=self._sites_mol(kind, now),
            ),
            sites=self._sites_mol(kind, new),
            left=(self._left("negative", now), self._left("positive", now)),
            balance=audit(self._model, kind.values, (new, now), charge_C),
        )

    def _window(self, kept: Sequence[_Kept], shares: FloatArray) -> Window:
        cell = self._pack.cell
        cut_offs_V = cell.lower_cut_off_V, cell.upper_cut_off_V

        def open_circuit_V(x: float, y: float) -> float:
            return float(self._open_circuit_V(x, y))

        return window([k.inventory for k in kept], shares, open_circuit_V, cut_offs_V)

    def _cell_health(self, one: _Kept, volts: Sequence[float], ohm: FloatArray) -> CellHealth:
        alone = np.ones(1)
        health = self._health([one], alone, self._window([one], alone).charge_C, ohm)
        return CellHealth(health=health, full_V=volts[1], empty_V=volts[0])

    def _health(
        self, kept: Sequence[_Kept], shares: FloatArray, charge_C: float, ohms: FloatArray
    ) -> Health:
        """Of kinds that have `shares` of the series, with what is known of all of them together."""
        before, now = (_mean(amounts, shares) for amounts in zip(*map(_ends, kept), strict=True))
        cyclable = [m["negative"] + m["positive"] for m in (before, now)]
        lost = [1 - _left_of_all(kept, shares, electrode) for electrode in (0, 1)]
        gone = {k: self._as_charge(now[k] - before[k]) for k in now if k not in ALIVE}
        return Health(
            capacity_C=charge_C * self._pack.parallel,
            lithium_loss=1 - cyclable[1] / cyclable[0],
            negative_loss=lost[0],
            positive_loss=lost[1],
            lost=LostLithium(
                sei_C=gone.get("sei", 0.0),
                sei_on_cracks_C=gone.get("sei_on_cracks", 0.0),
                plated_C=gone.get("plated", 0.0),
                dead_C=gone.get("dead", 0.0),
                trapped_C=sum(gone.get(f"trapped_{s}", 0.0) for s in ("negative", "positive")),
            ),
            resistance_ohm=float(ohms[0]),
            resistance_10s_ohm=float(ohms[1]),
            lithium_error=max((k.balance.relative_error for k in kept), key=abs),
            salt_change=max((k.salt_change for k in kept), key=abs),
            charge_error_C=max((k.balance.charge_error_C for k in kept), key=abs),
        )

    def _as_charge(self, mol: float) -> float:
        return FARADAY_C_mol * mol * self._pack.parallel

    def _left(self, side: str, state: FloatArray) -> float:
        """Share of an electrode's active material that still takes part."""
        if not self._pack.ages:
            return 1.0
        weight = self._model.layout.layer(side).weight
        return float(weight @ state[self._model.layout.slice_of(f"left_{side[0]}")])

    def _sites_mol(self, kind: CellKind, state: FloatArray) -> tuple[float, float]:
        """Lithium that the active material of one cell can hold, negative and positive."""
        lithium = self._model.lithium_mol(self._filled(state, (1.0, 1.0)), kind.values)
        return lithium["negative"], lithium["positive"]

    def _filled(self, state: FloatArray, stoichiometry: tuple[float, float]) -> FloatArray:
        """`state` with every particle uniform, negative and positive."""
        layout, out = self._model.layout, state.copy()
        for side, x in zip(("negative", "positive"), stoichiometry, strict=True):
            modes = out[layout.slice_of(f"modes_{side[0]}")]  # a view: the means come first
            modes[:] = 0.0
            modes[: layout.layer(side).size] = x
        return out

    def _drops_V(self, states: FloatArray, whole: Window) -> FloatArray:
        """(1 or 1 + kinds, 2) of the mean cell, and of each kind: at once and after PULSE_S."""
        rest = self._stepper.jump(self._rested(states, whole), 0.0, 0.0)
        point = self._stepper.jump(rest.state, 0.0, self._rate_A)
        drops_V = [_voltages(rest) - _voltages(point)]
        for _ in range(PULSE_S):
            point = self._stepper.move(point.state, 1.0, self._rate_A)
        drops_V.append(_voltages(rest) - _voltages(point))
        return np.stack(drops_V, axis=1)

    def _rested(self, states: FloatArray, whole: Window) -> FloatArray:
        """Cells that aged as `states` did, without gradients, in the middle of `whole`."""
        middles = whole.negative.mean(axis=1), whole.positive.mean(axis=1)
        parts = zip(self._kinds, states, *(m.tolist() for m in middles), strict=True)
        return np.concatenate([self._at_rest(kind, s, x, y) for kind, s, x, y in parts])

    def _at_rest(self, kind: CellKind, state: FloatArray, x: float, y: float) -> FloatArray:
        """A cell that aged as `state` did, without gradients, at these stoichiometries."""
        layout = self._model.layout
        new = self._model.initial_state(0.5, self._pack.cell.reference_K, kind.values)
        out = self._filled(new, (x, y))
        for name in layout.ageing_sizes():
            if name not in CURRENTS:
                out[layout.slice_of(name)] = state[layout.slice_of(name)]
        content, uniform = (
            self._model.lithium_mol(s, kind.values)["electrolyte"] for s in (state, out)
        )
        out[layout.slice_of("salt")] *= content / uniform
        return out


def _ends(kept: _Kept) -> tuple[Mapping[str, float], Mapping[str, float]]:
    return kept.before, kept.now


def _mean(amounts: Sequence[Mapping[str, float]], shares: FloatArray) -> dict[str, float]:
    """Of kinds of cells that have `shares` of the series."""
    return {k: float(shares @ [a[k] for a in amounts]) for k in amounts[0]}


def _left_of_all(kept: Sequence[_Kept], shares: FloatArray, electrode: int) -> float:
    """Share of the active material of all kinds that still takes part."""
    sites = shares * [k.sites[electrode] for k in kept]
    return float(sites / sites.sum() @ [k.left[electrode] for k in kept])


def _voltages(point: Point) -> FloatArray:
    """(1 or 1 + kinds,) of the mean cell, and of each kind where there are several."""
    return point.out.reshape(-1, len(OUTPUTS))[:, COLUMN["voltage_V"]]


CURRENTS = ("total_n", "strip_n")
"""Of what ageing adds to the state: zero at rest; all else lasts."""
ALIVE = ("negative", "positive", "electrolyte")
"""Where lithium may be that is not lost."""
