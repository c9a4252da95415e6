"""The kernel of a pack: that of its cell, for each kind of cell in the series.

One current runs through all cells, so the steps of a pack are those of each kind, side by side.
State and parameters are those of the kinds, one after the other. No kind is compiled anew, and a
pack of equal cells runs the very kernel of the cell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from twin.abreast import Abreast, begun_abreast
from twin.audit import audit, mean_audit
from twin.cell import Cell
from twin.cell_mesh import fine_mesh_of, mesh_of
from twin.kernel import Backend
from twin.limits import COLUMN
from twin.mesh import Mesh
from twin.one_thread import SYMBOLS
from twin.pack import CellKind, Pack
from twin.parameters import vector
from twin.solution import LithiumAudit
from twin.step import OUTPUTS, StepModel

FloatArray = npt.NDArray[np.float64]

OfSteps = tuple[FloatArray, FloatArray]
LARGEST = [COLUMN[n] for n in (
    "correction_V", "negative_under_most", "positive_under_most",
)]  # fmt: skip
LEAST = [COLUMN[n] for n in (
    "salt_min_mol_m3", "surface_margin", "anode_V", "negative_under_least", "positive_under_least",
)]  # fmt: skip
"""Of a pack that of its worst cell."""


@dataclass(frozen=True, slots=True, eq=False)
class PackModel:
    """Of kinds of cells with `counts` places in the series each.

    Attributes:
        cell: the equations of one cell.
        counts: (kinds,)
        kernel: of the cell.
    """

    cell: StepModel
    counts: tuple[int, ...]
    kernel: Abreast

    def steps(self, state: FloatArray, drive: FloatArray, p: FloatArray) -> OfSteps:
        """States (m, kinds, of one cell) and outputs (m, outputs) after each step.

        The outputs are OUTPUTS of the pack, then, if there are several kinds, OUTPUTS of each. Of
        the pack are the means over its cells, but for the largest correction, the least salt
        and margin, and the extremes of anode and surfaces in any of them. Drive is (m, DRIVE).
        """
        return steps_of([Asked(self, state, drive, p)])[0]

    def put_out(self, outs: FloatArray) -> FloatArray:
        """(m, outputs) from OUTPUTS (m, kinds, OUTPUTS) of each kind."""
        if len(self.counts) == 1:
            return outs[:, 0]
        whole = np.average(outs, axis=1, weights=self.counts)
        for columns, worst in ((LARGEST, np.max), (LEAST, np.min)):
            whole[:, columns] = worst(outs[:, :, columns], axis=1)
        return np.hstack([whole, outs.reshape(outs.shape[0], -1)])

    @property
    def outputs(self) -> int:
        """Length of what a step puts out."""
        kinds = len(self.counts)
        return len(OUTPUTS) * (1 if kinds == 1 else 1 + kinds)

    @property
    def size(self) -> int:
        """Length of a state."""
        return len(self.counts) * self.cell.layout.size

    def initial_state(self, kinds: Sequence[CellKind]) -> FloatArray:
        """All cells rested."""
        return np.concatenate(
            [self.cell.initial_state(k.initial_soc, k.initial_K, k.values) for k in kinds]
        )

    def parameters(self, kinds: Sequence[CellKind]) -> FloatArray:
        """The kernel's parameter input."""
        return np.concatenate([vector(k.values) for k in kinds])

    def states(self, state: FloatArray) -> FloatArray:
        """(..., kinds, of one cell), a view of (..., states); of parameters likewise."""
        return state.reshape(*state.shape[:-1], len(self.counts), -1)

    def of_kinds(self, out: FloatArray) -> FloatArray:
        """(kinds, OUTPUTS, m) from the outputs (rows, m) of m steps."""
        own = out if len(self.counts) == 1 else out[len(OUTPUTS) :]
        return own.reshape(len(self.counts), len(OUTPUTS), -1)

    def lithium(
        self, kinds: Sequence[CellKind], states: tuple[FloatArray, FloatArray], charge_C: float
    ) -> LithiumAudit:
        """The balance between two states, `charge_C` drawn from each cell between them."""
        ends = zip(*(self.states(s) for s in states), strict=True)
        audits = [
            audit(self.cell, kind.values, (start, end), charge_C)
            for kind, (start, end) in zip(kinds, ends, strict=True)
        ]
        return mean_audit(audits, self.counts)


class Asked(NamedTuple):
    """Arguments of `PackModel.steps`."""

    model: PackModel
    state: FloatArray
    drive: FloatArray
    p: FloatArray


def steps_of(asked: Sequence[Asked]) -> list[OfSteps]:
    """`PackModel.steps` of several packs, all with the same kernel, side by side."""
    cells = [a.model.states(a.state) for a in asked]
    longest = np.arange(max(a.drive.shape[0] for a in asked))
    drives = [a.drive[np.minimum(longest, a.drive.shape[0] - 1)] for a in asked]
    kinds = [own.shape[0] for own in cells]
    states, outs = asked[0].model.kernel(
        np.concatenate(cells),
        np.repeat(drives, kinds, axis=0),
        np.concatenate([a.model.states(a.p) for a in asked]),
    )
    done, first = [], 0
    for own, count in zip(asked, kinds, strict=True):
        place = slice(own.drive.shape[0]), slice(first, first := first + count)
        done.append((states[place], own.model.put_out(outs[place])))
    return done


def pack_model(pack: Pack, mesh: Mesh | None, backend: Backend) -> PackModel:
    """Of `pack`; kernels are kept, so the same again costs nothing."""
    with SYMBOLS:
        cell, own = _cell_kernel(_Structure.of(pack, mesh, backend))
    return PackModel(cell, pack.counts, own)


def finer_model(pack: Pack, backend: Backend) -> PackModel:
    """Where salt runs short, see `simulate.LITTLE_SALT`."""
    return pack_model(pack, fine_mesh_of(pack.cell), backend)


def begin(pack: Pack, mesh: Mesh | None, backend: Backend) -> None:
    """Start to compile what `pack_model` will ask for, and do not wait for it."""
    with SYMBOLS:
        _begun(_Structure.of(pack, mesh, backend))


class _Structure(NamedTuple):
    """What a kernel depends on; all else are its inputs."""

    cell: Cell
    mesh: Mesh
    backend: Backend
    ageing: bool
    stressed: bool
    hysteretic: bool

    @classmethod
    def of(cls, pack: Pack, mesh: Mesh | None, backend: Backend) -> "_Structure":
        own = mesh or mesh_of(pack.cell)
        return cls(pack.cell, own, backend, pack.ages, pack.stressed, pack.hysteretic)


@lru_cache(maxsize=16)
def _cell_kernel(of: _Structure) -> tuple[StepModel, Abreast]:
    model, made = _begun(of)
    return model, made()


@lru_cache(maxsize=16)
def _begun(of: _Structure) -> tuple[StepModel, Callable[[], Abreast]]:
    model = StepModel(
        of.cell, of.mesh, ageing=of.ageing, stressed=of.stressed, hysteretic=of.hysteretic
    )
    return model, begun_abreast(model, of.backend)


def of_places(pack: Pack, rows: FloatArray) -> FloatArray:
    """(series, m) of each cell where it stands, from rows (kinds, m); read it only."""
    if rows.shape[0] == 1:
        return np.broadcast_to(rows, (pack.series, rows.shape[1]))
    return rows[list(pack.places())]


def forget() -> None:
    """Drop the kernels that are kept, so that they are made anew."""
    _cell_kernel.cache_clear()
    _begun.cache_clear()
