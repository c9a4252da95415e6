"""Drive the kernel through a load: `simulate(pack, load)`.

The load becomes pieces, each a length of time over which the current runs straight (length 0: it
jumps). The kernel takes many pieces a call; this file looks at what came back, halves what did not
converge, and locates where a limit was reached.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from twin.cell import Cell
from twin.constants import FARADAY_C_mol
from twin.effects import SelfHeating
from twin.kernel import CHUNK, Backend, Kernel, kernel
from twin.kinetics import SURFACE_MARGIN, SALT_FLOOR_mol_m3
from twin.load import Between, Load
from twin.mesh import Mesh, electrode_mesh
from twin.newton import CONVERGED_V
from twin.pack import Pack
from twin.parameters import vector
from twin.solution import LithiumAudit, Solution, Status
from twin.step import OUTPUTS, StepModel

FloatArray = npt.NDArray[np.float64]

DEFAULT_MESH = electrode_mesh((0.0, 1.0), (5,))
"""One element of order 5 an electrode: benchmarks/pybamm_replay.py shows its error."""
MAX_STEP_S = 1.0  # longer samples are cut: salt diffusion is first order in time
LOWER_TOLERANCE_V = 1e-4
UPPER_TOLERANCE_V = 5e-3  # a full cell at rest, under a sensor's noise, is not being overcharged
LOCATE_HALVINGS = 20  # of a piece: 1 s / 2**20 is a microsecond
COLUMN = {name: i for i, name in enumerate(OUTPUTS)}


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """A load of one cell, cut for the kernel.

    Attributes:
        start_A: (m,) current at the start of each piece.
        stop_A: (m,) at its end.
        length_s: (m,) 0 where the current jumps.
        sample: (m,) the load's sample at whose time the piece ends, or that it leads to.
    """

    start_A: FloatArray
    stop_A: FloatArray
    length_s: FloatArray
    sample: npt.NDArray[np.int64]


def cut_into_pieces(load: Load, divisor: float) -> Pieces:
    """`load` as pieces no longer than MAX_STEP_S, currents divided by `divisor`."""
    current = load.current_A / divisor
    dt = np.diff(load.time_s)
    parts = np.maximum(np.ceil(dt / MAX_STEP_S - 1e-9), 1).astype(int)
    hold = load.between is Between.HOLD
    ends = current[:-1] if hold else current[1:]
    sample = np.repeat(np.arange(1, current.size), parts)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    nth = np.arange(sample.size) - first
    before, after = np.repeat(current[:-1], parts), np.repeat(ends, parts)
    share = np.repeat(1.0 / parts, parts)
    start = before + (after - before) * (nth * share)
    stop = before + (after - before) * ((nth + 1) * share)
    length = np.repeat(dt / parts, parts)
    jump_at = np.flatnonzero(np.diff(current)) + 1 if hold else np.array([], dtype=int)
    where = np.searchsorted(sample, jump_at, side="right")
    start = np.insert(start, where, current[jump_at - 1])
    stop = np.insert(stop, where, current[jump_at])
    length = np.insert(length, where, 0.0)
    sample = np.insert(sample, where, jump_at)
    return Pieces(
        np.concatenate([[0.0], start]),
        np.concatenate([[current[0]], stop]),
        np.concatenate([[0.0], length]),
        np.concatenate([[0], sample]),
    )


@lru_cache(maxsize=16)
def built(
    cell: Cell, mesh: Mesh, backend: Backend, *, ageing: bool, stressed: bool
) -> tuple[StepModel, Kernel]:
    """Model, and kernel of its steps."""
    model = StepModel(cell, mesh, ageing=ageing, stressed=stressed)
    return model, kernel(model.step(), backend)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a step may not go beyond."""

    lower_V: float
    upper_V: float

    def beyond(self, out: FloatArray, current_A: FloatArray) -> npt.NDArray[np.bool_]:
        """(limits, m) in the order of `REACHED`, for outputs (OUTPUTS, m) at currents (m,)."""
        voltage = out[COLUMN["voltage_V"]]
        return np.array(
            [
                out[COLUMN["salt_min_mol_m3"]] <= SALT_FLOOR_mol_m3,
                out[COLUMN["surface_margin"]] <= SURFACE_MARGIN,
                (voltage < self.lower_V - LOWER_TOLERANCE_V) & (current_A > 0),
                (voltage > self.upper_V + UPPER_TOLERANCE_V) & (current_A < 0),
            ]
        )

    def accepts(self, out: FloatArray, current_A: FloatArray) -> npt.NDArray[np.bool_]:
        """(m,) solved and within all limits."""
        solved = np.isfinite(out).all(axis=0) & (out[COLUMN["correction_V"]] <= CONVERGED_V)
        return np.asarray(solved & ~self.beyond(out, current_A).any(axis=0))

    def reached(self, trial: FloatArray, last: FloatArray, current_A: float) -> Status:
        """Why `trial` was not accepted, a moment after `last` was."""
        for status, hit in zip(
            REACHED, self.beyond(trial[:, None], np.array([current_A]))[:, 0], strict=True
        ):
            if hit:
                return status
        if last[COLUMN["salt_min_mol_m3"]] < NEARLY_DEPLETED * SALT_FLOOR_mol_m3:
            return Status.ELECTROLYTE_DEPLETED
        if last[COLUMN["surface_margin"]] < NEARLY_EMPTY * SURFACE_MARGIN:
            return Status.ELECTRODE_EMPTY
        return Status.NOT_CONVERGED


REACHED = (
    Status.ELECTROLYTE_DEPLETED,
    Status.ELECTRODE_EMPTY,
    Status.LOWER_CUT_OFF,
    Status.UPPER_CUT_OFF,
)
NEARLY_DEPLETED = 50.0  # times the floor: Newton may fail a little before the floor is met
NEARLY_EMPTY = 1e4  # likewise: a stoichiometry within 1 % of its end


def surroundings(pack: Pack, ambient_K: float) -> FloatArray:
    """The last three of the kernel's drive."""
    heating = next((e for e in pack.effects if isinstance(e, SelfHeating)), None)
    transfer = heating.heat_transfer_W_m2_K if heating else 0.0
    return np.array([ambient_K, transfer, float(heating is not None)])


START = ("initial_soc", "initial_K")
OUTSIDE = ("ambient_K", "heat_transfer_W_m2_K")


def changeable(pack: Pack, load: Load) -> dict[str, float]:
    """Name -> value of all numbers a run depends on: of one cell, START and OUTSIDE."""
    outside = surroundings(pack, load.ambient_K)[:2].tolist()
    start = pack.initial_soc, pack.initial_K
    return pack.cell_parameters() | dict(zip(START + OUTSIDE, (*start, *outside), strict=True))


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """Steps that were accepted, one after the other.

    Attributes:
        drive: (m, DRIVE) of each.
        after: (m, states) that each ended in.
        piece: (m,) that each belongs to; a piece may take several.
    """

    drive: FloatArray
    after: FloatArray
    piece: npt.NDArray[np.int64]


class Run:
    """One simulation while it goes on; `rows` collects the outputs of accepted pieces.

    `taken` collects their steps if it is made a list before it runs.
    """

    def __init__(
        self, pack: Pack, load: Load, mesh: Mesh, backend: Backend, state: FloatArray | None
    ) -> None:
        self.model, self._kernel = built(
            pack.cell, mesh, backend, ageing=pack.ages, stressed=pack.stressed
        )
        self.values = pack.cell_parameters()
        self._p = vector(self.values)
        fresh = self.model.initial_state(pack.initial_soc, pack.initial_K, self.values)
        self.initial = self.state = fresh if state is None else state
        self.pieces = cut_into_pieces(load, pack.parallel)
        self._limits = Limits(pack.cell.lower_cut_off_V, pack.cell.upper_cut_off_V)
        self._tail = surroundings(pack, load.ambient_K)
        self.rows: list[FloatArray] = []
        self.charge_C = self.elapsed_s = 0.0
        self.retried = 0
        self.status = Status.DONE
        self.taken: list[Taken] | None = None

    def change(self, whole: Mapping[str, float]) -> None:
        """Start from other numbers, all of `changeable`."""
        own = dict(whole)
        soc, temperature_K = (own.pop(name) for name in START)
        self._tail[:2] = [own.pop(name) for name in OUTSIDE]
        self.values, self._p = own, vector(own)
        self.initial = self.state = self.model.initial_state(soc, temperature_K, own)

    def run(self) -> None:
        """All pieces, or up to where it ends."""
        at, total = 0, self.pieces.length_s.size
        while at < total and self.status is Status.DONE:
            accepted = self._chunk(at)
            at += accepted
            if accepted < CHUNK and at < total and self._difficult(at):
                at += 1

    def _chunk(self, at: int) -> int:
        """Up to CHUNK pieces from `at` in one call; how many of them were accepted."""
        span = slice(at, at + CHUNK)
        length_s, current_A = self.pieces.length_s[span], self.pieces.stop_A[span]
        size = length_s.size
        drive = np.empty((size, 5))
        drive[:, 0], drive[:, 1], drive[:, 2:] = length_s, current_A, self._tail
        states, out = self._kernel(self.state, [drive], [self._p])
        rows = out.T
        good = self._limits.accepts(rows, current_A)
        accepted = size if good.all() else int(np.argmin(good))
        if accepted:
            self.state = states[accepted - 1].copy()
            self.rows.append(rows[:, :accepted])
            done = slice(at, at + accepted)
            if self.taken is not None:
                where = np.arange(at, at + accepted)
                self.taken.append(Taken(drive[:accepted], states[:accepted], where))
            self._count(self.pieces.length_s[done], self.pieces.start_A[done], current_A[:accepted])
        return accepted

    def _difficult(self, at: int) -> bool:
        """The piece at `at` in ever smaller parts; False with the status set if that fails too."""
        share, size = 0.0, 1.0
        length_s = float(self.pieces.length_s[at])
        last = self.rows[-1][:, -1] if self.rows else np.full(len(OUTPUTS), np.inf)
        while share < 1.0:
            goal = min(share + size, 1.0)
            current_A = self._current_A(at, goal)
            drive = np.array([(goal - share) * length_s, current_A, *self._tail])
            following, out = self._kernel(self.state, [drive[None]], [self._p])
            trial = out[0]
            self.retried += 1
            if self._limits.accepts(trial[:, None], np.array([current_A]))[0]:
                done = np.array([drive[0]]), np.array([self._current_A(at, share)])
                self._count(*done, np.array([current_A]))
                if self.taken is not None:
                    self.taken.append(Taken(drive[None], following, np.array([at])))
                self.state, share, last = following[0], goal, trial
                size *= 2
            elif size > 0.5**LOCATE_HALVINGS:
                size /= 2
            else:
                self.status = self._limits.reached(trial, last, current_A)
                return False
        self.rows.append(last[:, None])
        return True

    def _current_A(self, at: int, share: float) -> float:
        start, stop = float(self.pieces.start_A[at]), float(self.pieces.stop_A[at])
        return start + share * (stop - start)

    def _count(self, length_s: FloatArray, start_A: FloatArray, stop_A: FloatArray) -> None:
        self.charge_C += float(np.dot(length_s, start_A + stop_A) / 2)
        self.elapsed_s += float(length_s.sum())


def simulate(
    pack: Pack,
    load: Load,
    *,
    mesh: Mesh = DEFAULT_MESH,
    backend: Backend = Backend.AUTO,
    state: FloatArray | None = None,
) -> Solution:
    """The response of `pack` to `load` (pack current, discharge positive).

    `state` continues where another solution of this pack on this mesh ended (its `end_state`);
    None starts at rest as the pack says.

    Never raises for what the load asks: a limit that is reached ends the solution with a status
    and everything up to there.
    """
    run = Run(pack, load, mesh, backend, state)
    run.run()
    return solution_of(run, pack, load)


def sample_ends(pieces: Pieces, done: int) -> npt.NDArray[np.int64]:
    """(n,) piece that answers each sample, where all its pieces are among the first `done`."""
    sample = pieces.sample[:done]
    whole = sample < pieces.sample[done] if done < pieces.sample.size else sample >= 0
    return np.flatnonzero(np.diff(sample[whole], append=-1))


def solution_of(run: Run, pack: Pack, load: Load) -> Solution:
    """What the finished `run` of `pack` under `load` gives."""
    out = np.hstack(run.rows) if run.rows else np.zeros((len(OUTPUTS), 0))
    ends = sample_ends(run.pieces, out.shape[1])
    out, n = out[:, ends], ends.size
    low, high = (run.values[f"negative.stoichiometry_{end}"] for end in ("min", "max"))
    return Solution(
        time_s=load.time_s[:n],
        current_A=load.current_A[:n],
        voltage_V=out[COLUMN["voltage_V"]] * pack.series,
        temperature_K=out[COLUMN["temperature_K"]],
        soc=(out[COLUMN["negative_mean"]] - low) / (high - low),
        heat_W=out[COLUMN["heat_W"]] * pack.series * pack.parallel,
        audit=audit(run.model, run.values, (run.initial, run.state), run.charge_C),
        status=run.status,
        stopped_s=float(load.time_s[0]) + run.elapsed_s,
        steps=sum(r.shape[1] for r in run.rows) + run.retried,
        retried_steps=run.retried,
        charge_C=run.charge_C * pack.parallel,
        end_state=run.state,
    )


def audit(
    model: StepModel,
    values: Mapping[str, float],
    states: tuple[FloatArray, FloatArray],
    charge_C: float,
) -> LithiumAudit:
    """Lithium of one cell in its first and last state, `charge_C` drawn between them."""
    start, end = (model.lithium_mol(s, values) for s in states)
    total = sum(start.values()), sum(end.values())
    taken = {k: end[k] - start[k] for k in ("positive", "trapped_positive") if k in end}
    moved = {name: np.array([start[name], end[name]]) for name in start}
    return LithiumAudit(
        negative_mol=moved.pop("negative"),
        positive_mol=moved.pop("positive"),
        electrolyte_mol=moved.pop("electrolyte"),
        lost_mol=moved,
        relative_error=(total[1] - total[0]) / total[0],
        charge_error_C=charge_C - FARADAY_C_mol * sum(taken.values()),
    )
