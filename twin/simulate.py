"""Drive the kernel through a load: `simulate(pack, load)`.

The load becomes pieces (`pieces.py`). The kernel takes many of them a call; this file looks at what
came back, halves what did not converge, and locates where a limit was reached.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from twin.abreast import Abreast
from twin.carried import carried
from twin.effects import OF_CURRENT, ColdPack, OfCurrent, SelfHeating
from twin.inside import inside
from twin.kernel import CHUNK, Backend
from twin.limits import COLUMN, limits_of
from twin.load import Load
from twin.mesh import Mesh
from twin.pack import CellKind, Pack
from twin.pack_model import Asked, PackModel, finer_model, of_places, pack_model, steps_of
from twin.pieces import cut_into_pieces, sample_ends
from twin.solution import Solution, Status

FloatArray = npt.NDArray[np.float64]

LOCATE_HALVINGS = 20  # of a piece: 1 s / 2**20 is a microsecond
LITTLE_SALT = 0.03
"""Of what was mixed: where less is left anywhere, a run begins again on the finer mesh of its cell.

The usual one does not follow the front behind which reactions have ended: of an LG M50 at 3C it is
0.9 mV off when so little is left, 12 after four minutes, 22 rms down to 2.83 V; the finer one 1.0
(`pytest tests/twin/test_reference.py tests/twin/test_depleted.py`)."""


def little_salt_mol_m3(pack: Pack) -> float:
    """LITTLE_SALT of what was mixed."""
    return LITTLE_SALT * pack.cell.electrolyte.initial_concentration_mol_m3


def surroundings(pack: Pack, ambient_K: float) -> FloatArray:
    """The last three of the kernel's drive."""
    heating = next((e for e in pack.effects if isinstance(e, SelfHeating)), None)
    transfer = heating.heat_transfer_W_m2_K if heating else 0.0
    ambient_K += sum(e.ambient_offset_K for e in pack.effects if isinstance(e, ColdPack))
    return np.array([ambient_K, transfer, float(heating is not None)])


def flowed(pack: Pack, load: Load) -> Load:
    """The load the cells of `pack` had while `load` was recorded, by the effects that differ."""
    return _flowed(tuple(e for e in pack.effects if isinstance(e, OF_CURRENT)), load)


def as_flowed(pack: Pack, load: Load) -> tuple[Pack, Load]:
    """The pack without those effects, and the load `flowed` with them."""
    kept = tuple(e for e in pack.effects if not isinstance(e, OF_CURRENT))
    return replace(pack, effects=kept), flowed(pack, load)


@lru_cache(maxsize=16)  # while another number is fitted, the same again and again
def _flowed(effects: tuple[OfCurrent, ...], load: Load) -> Load:
    current_A = load.current_A
    for effect in effects:
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

    `taken` collects their steps if it is made a list before it runs. If no mesh is asked for, it
    begins again where it comes to LITTLE_SALT.
    """

    initial: FloatArray
    state: FloatArray

    def __init__(
        self, pack: Pack, load: Load, mesh: Mesh | None, backend: Backend, state: FloatArray | None
    ) -> None:
        self.pack, self.kinds, self._backend = pack, pack.cells(), backend
        self.pieces = cut_into_pieces(flowed(pack, load), pack.parallel)
        self._limits = limits_of(pack)
        self._tail = surroundings(pack, load.ambient_K)
        self.taken: list[Taken] | None = None
        self._least_mol_m3 = little_salt_mol_m3(pack)
        usual = pack_model(pack, mesh, backend)
        start = usual.initial_state(self.kinds) if state is None else state
        self._may_refine = mesh is None and start.size == usual.size
        finer = mesh is None and start.size != usual.size
        self._begin(finer_model(pack, backend) if finer else usual, start)

    def _begin(self, model: PackModel, state: FloatArray) -> None:
        """On the mesh of `model`."""
        self.model, self.initial, self.state = model, state, state
        self._p = model.parameters(self.kinds)
        self.rows: list[FloatArray] = []
        self.charge_C = self.energy_J = self.elapsed_s = self._voltage_V = 0.0
        self.retried = self._at = 0
        self.status = Status.DONE
        self.taken = None if self.taken is None else []

    def change(self, whole: Mapping[str, float]) -> None:
        """Start from other numbers, all of `changeable`."""
        self._tail[:2] = [whole[name] for name in OUTSIDE]
        self.kinds = cells_of(self.pack, whole)
        self._p = self.model.parameters(self.kinds)
        self.initial = self.state = self.model.initial_state(self.kinds)

    @property
    def goes_on(self) -> bool:
        """It has not come to its end."""
        return self.status is Status.DONE and self._at < self.pieces.length_s.size

    def run(self) -> None:
        """All pieces, or up to where it ends."""
        run_abreast([self])

    def ahead(self) -> Asked:
        """The next CHUNK pieces, as a call of the kernel."""
        span = slice(self._at, self._at + CHUNK)
        length_s = self.pieces.length_s[span]
        drive = np.empty((length_s.size, 5))
        drive[:, 0], drive[:, 1], drive[:, 2:] = length_s, self.pieces.stop_A[span], self._tail
        return Asked(self.model, self.state, drive, self._p)

    def take(self, drive: FloatArray, states: FloatArray, out: FloatArray) -> None:
        """What came of `ahead`: as much as is accepted, and the piece behind it in parts."""
        at, size, current_A = self._at, drive.shape[0], drive[:, 1]
        good = self._limits.accepts(out.T, current_A)
        accepted = size if good.all() else int(np.argmin(good))
        self._at += accepted
        if accepted:
            self.state = states[accepted - 1].flatten()
            self.rows.append(out[:accepted].T.copy())  # the block it lies in is free again
            done = slice(at, self._at)
            if self.taken is not None:
                after = states[:accepted].reshape(accepted, -1).copy()
                self.taken.append(Taken(drive[:accepted], after, np.arange(at, self._at)))
            lasting = self.pieces.length_s[done], self.pieces.start_A[done]
            self._count(*lasting, current_A[:accepted], out[:accepted, COLUMN["voltage_V"]])
        if accepted < size and self._difficult(self._at):
            self._at += 1
        if self._may_refine and self._salt_mol_m3(out[:accepted]) < self._least_mol_m3:
            self._may_refine, finer = False, finer_model(self.pack, self._backend)
            self._begin(finer, carried(self.initial, self.kinds, self.model, finer))

    def _salt_mol_m3(self, out: FloatArray) -> float:
        """Least of these accepted outputs, and of the last one that was kept."""
        last = self.rows[-1][COLUMN["salt_min_mol_m3"], -1] if self.rows else np.inf
        return float(out[:, COLUMN["salt_min_mol_m3"]].min(initial=last))

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
                self._count(*done, np.array([current_A]), trial[[COLUMN["voltage_V"]]])
                if self.taken is not None:
                    after = following.reshape(1, -1)
                    self.taken.append(Taken(drive[None], after, np.array([at])))
                self.state, share, last = following[0].flatten(), goal, trial
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

    def _count(
        self, length_s: FloatArray, start_A: FloatArray, stop_A: FloatArray, stop_V: FloatArray
    ) -> None:
        start_V = np.concatenate([[self._voltage_V], stop_V[:-1]])  # a jump is a piece of its own
        self.charge_C += float(np.dot(length_s, start_A + stop_A) / 2)
        self.energy_J += float(np.dot(length_s, start_A * start_V + stop_A * stop_V) / 2)
        self._voltage_V = float(stop_V[-1])
        self.elapsed_s += float(length_s.sum())


def run_abreast(runs: Sequence[Run]) -> None:
    """All to their ends, side by side; they share a kernel, or that of the finer mesh."""
    while going := [run for run in runs if run.goes_on]:
        kernels = dict.fromkeys(run.model.kernel for run in going)
        for together in ([r for r in going if r.model.kernel is kernel] for kernel in kernels):
            asked = [run.ahead() for run in together]
            for run, own, (states, out) in zip(together, asked, steps_of(asked), strict=True):
                run.take(own.drive, states, out)


def run_all(runs: Iterable[Run], *, workers: int | None = None) -> None:
    """All to their ends: as many side by side as the kernel has lanes, and `workers` threads.

    None is a thread a processor: the compiled kernel lets others run.
    """
    groups = list(_shared_out(runs))
    if len(groups) < 2:
        for group in groups:
            run_abreast(group)
        return
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        for _ in pool.map(run_abreast, groups):
            pass


def _shared_out(runs: Iterable[Run]) -> Iterator[list[Run]]:
    """In groups that share a kernel, of as many cells as it has lanes, or of one run."""
    open_: dict[Abreast, list[Run]] = {}
    for run in runs:
        kernel = run.model.kernel
        group = open_.setdefault(kernel, [])
        if group and sum(len(r.kinds) for r in (*group, run)) > kernel.lanes:
            yield open_.pop(kernel)
            group = open_.setdefault(kernel, [])
        group.append(run)
    yield from open_.values()


def simulate(
    pack: Pack,
    load: Load,
    *,
    mesh: Mesh | None = None,
    backend: Backend = Backend.AUTO,
    state: FloatArray | None = None,
) -> Solution:
    """The response of `pack` to `load` (pack current, discharge positive).

    `mesh`: that of the cell (`mesh_of`) if there is none, the finer where salt runs short.
    `state` continues where another solution of this pack on this mesh ended (its `end_state`, of
    the finer mesh where it had to be taken); None starts at rest as the pack says.

    Never raises for what the load asks: a limit that is reached ends the solution with a status
    and everything up to there.
    """
    run = Run(pack, load, mesh, backend, state)
    run.run()
    return solution_of(run, pack, load)


def simulate_all(asked: Sequence[tuple[Pack, Load]]) -> list[Solution]:
    """`simulate` of each, several at once; they cost least with the same equations side by side."""
    runs = [Run(*each, None, Backend.AUTO, None) for each in asked]
    run_all(runs)
    return [solution_of(run, *each) for run, each in zip(runs, asked, strict=True)]


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
        energy_J=run.energy_J * pack.series * pack.parallel,
        end_state=run.state,
        cell_voltage_V=of_places(pack, run.model.of_kinds(out)[:, COLUMN["voltage_V"]]),
        cell_temperature_K=of_places(pack, run.model.of_kinds(out)[:, COLUMN["temperature_K"]]),
        inside=inside(pack, out),
    )
