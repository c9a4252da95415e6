"""Drive the kernel through a load: `simulate(pack, load)`.

The load becomes pieces (`pieces.py`). The kernel takes many of them a call; this file looks at what
came back, halves what did not converge, and locates where a limit was reached.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.effects import OF_CURRENT, ColdPack, SelfHeating
from twin.inside import inside
from twin.kernel import CHUNK, Backend
from twin.limits import COLUMN, Limits
from twin.load import Load
from twin.mesh import Mesh, electrode_mesh
from twin.pack import CellKind, Pack
from twin.pack_model import of_places, pack_model
from twin.pieces import cut_into_pieces, sample_ends
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]

DEFAULT_MESH = electrode_mesh((0.0, 1.0), (5,))
"""One element of order 5 an electrode: benchmarks/pybamm_replay.py shows its error."""
LOCATE_HALVINGS = 20  # of a piece: 1 s / 2**20 is a microsecond


def surroundings(pack: Pack, ambient_K: float) -> FloatArray:
    """The last three of the kernel's drive."""
    heating = next((e for e in pack.effects if isinstance(e, SelfHeating)), None)
    transfer = heating.heat_transfer_W_m2_K if heating else 0.0
    ambient_K += sum(e.ambient_offset_K for e in pack.effects if isinstance(e, ColdPack))
    return np.array([ambient_K, transfer, float(heating is not None)])


def flowed(pack: Pack, load: Load) -> Load:
    """The load the cells of `pack` had while `load` was recorded, by the effects that differ."""
    current_A = load.current_A
    for effect in pack.effects:
        if isinstance(effect, OF_CURRENT):
            current_A = effect.flowed_A(load.time_s, current_A)
    return load if current_A is load.current_A else replace(load, current_A=current_A)


OUTSIDE = ("ambient_K", "heat_transfer_W_m2_K")


def changeable(pack: Pack, load: Load) -> dict[str, float]:
    """Name -> value of all numbers a run depends on: those of the pack, and OUTSIDE."""
    outside = surroundings(pack, load.ambient_K)[:2].tolist()
    return pack.numbers() | dict(zip(OUTSIDE, outside, strict=True))


def cells_of(pack: Pack, whole: Mapping[str, float]) -> tuple[CellKind, ...]:
    """The kinds of cells of `pack` with other numbers, all of `changeable`."""
    return pack.cells({name: value for name, value in whole.items() if name not in OUTSIDE})


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
        self.model, self.kinds = pack_model(pack, mesh, backend), pack.cells()
        self.pack, self._p = pack, self.model.parameters(self.kinds)
        fresh = self.model.initial_state(self.kinds)
        self.initial = self.state = fresh if state is None else state
        self.pieces = cut_into_pieces(flowed(pack, load), pack.parallel)
        self._limits = Limits(pack.cell.lower_cut_off_V, pack.cell.upper_cut_off_V)
        self._tail = surroundings(pack, load.ambient_K)
        self.rows: list[FloatArray] = []
        self.charge_C = self.elapsed_s = 0.0
        self.retried = 0
        self.status = Status.DONE
        self.taken: list[Taken] | None = None

    def change(self, whole: Mapping[str, float]) -> None:
        """Start from other numbers, all of `changeable`."""
        self._tail[:2] = [whole[name] for name in OUTSIDE]
        self.kinds = cells_of(self.pack, whole)
        self._p = self.model.parameters(self.kinds)
        self.initial = self.state = self.model.initial_state(self.kinds)

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
        states, out = self.model.steps(self.state, drive, self._p)
        rows = out.T
        good = self._limits.accepts(rows, current_A)
        accepted = size if good.all() else int(np.argmin(good))
        if accepted:
            self.state = states[accepted - 1].copy()
            self.rows.append(rows[:, :accepted].copy())  # the block it lies in is free again
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
        last = self.rows[-1][:, -1] if self.rows else np.full(self.model.outputs, np.inf)
        while share < 1.0:
            goal = min(share + size, 1.0)
            current_A = self._current_A(at, goal)
            drive = np.array([(goal - share) * length_s, current_A, *self._tail])
            following, out = self.model.steps(self.state, drive[None], self._p)
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


def solution_of(run: Run, pack: Pack, load: Load) -> Solution:
    """What the finished `run` of `pack` under `load` gives."""
    out = np.hstack(run.rows) if run.rows else np.zeros((run.model.outputs, 0))
    ends = sample_ends(run.pieces, out.shape[1])
    out, n = out[:, ends], ends.size
    return Solution(
        time_s=load.time_s[:n],
        current_A=load.current_A[:n],
        voltage_V=out[COLUMN["voltage_V"]] * pack.terminals,
        temperature_K=out[COLUMN["temperature_K"]],
        soc=run.kinds[0].soc(out[COLUMN["negative_mean"]]),
        heat_W=out[COLUMN["heat_W"]] * pack.series * pack.parallel,
        audit=run.model.lithium(run.kinds, (run.initial, run.state), run.charge_C),
        status=run.status,
        stopped_s=float(load.time_s[0]) + run.elapsed_s,
        steps=sum(r.shape[1] for r in run.rows) + run.retried,
        retried_steps=run.retried,
        charge_C=run.charge_C * pack.parallel,
        end_state=run.state,
        cell_voltage_V=of_places(pack, run.model.of_kinds(out)[:, COLUMN["voltage_V"]]),
        cell_temperature_K=of_places(pack, run.model.of_kinds(out)[:, COLUMN["temperature_K"]]),
        inside=inside(pack, out),
    )
