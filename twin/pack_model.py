"""The kernel of a pack: that of its cell, once for each kind of cell in the series.

One current runs through all cells, so the steps of a pack are those of each kind by itself. State
and parameters are those of the kinds, one after the other. No kind is compiled anew, and a pack of
equal cells runs the very kernel of the cell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from twin.audit import audit, mean_audit
from twin.cell import Cell
from twin.kernel import Backend, Kernel, begun
from twin.limits import COLUMN
from twin.mesh import Mesh
from twin.one_thread import SYMBOLS
from twin.pack import CellKind, Pack
from twin.parameters import vector
from twin.solution import LithiumAudit
from twin.step import OUTPUTS, StepModel

FloatArray = npt.NDArray[np.float64]

OfSteps = tuple[FloatArray, FloatArray]
WORST: dict[str, Callable[..., FloatArray]] = {
    "correction_V": np.max,
    "salt_min_mol_m3": np.min,
    "surface_margin": np.min,
    "anode_V": np.min,
    "negative_under_least": np.min,
    "negative_under_most": np.max,
    "positive_under_least": np.min,
    "positive_under_most": np.max,
}


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
    kernel: Kernel

    def steps(self, state: FloatArray, drive: FloatArray, p: FloatArray) -> OfSteps:
        """States (m, states) and outputs (m, outputs) after each step, drive (m, DRIVE).

        The outputs are OUTPUTS of the pack, then, if there are several kinds, OUTPUTS of each. Of
        the pack are the means over its cells, but for the largest correction, the least salt
        and margin, and the extremes of anode and surfaces in any of them.
        """
        if len(self.counts) == 1:
            return self.kernel(state, [drive], [p])
        inputs = zip(self.states(state), self.states(p), strict=True)
        kinds = [self.kernel(own, [drive], [own_p]) for own, own_p in inputs]
        states, outs = (np.stack(parts, axis=1) for parts in zip(*kinds, strict=True))
        whole = np.average(outs, axis=1, weights=self.counts)
        for name, worst in WORST.items():
            whole[:, COLUMN[name]] = worst(outs[:, :, COLUMN[name]], axis=1)
        m = drive.shape[0]
        return states.reshape(m, -1), np.hstack([whole, outs.reshape(m, -1)])

    @property
    def outputs(self) -> int:
        """Length of what a step puts out."""
        kinds = len(self.counts)
        return len(OUTPUTS) * (1 if kinds == 1 else 1 + kinds)

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


def pack_model(pack: Pack, mesh: Mesh, backend: Backend) -> PackModel:
    """Of `pack`; kernels are kept, so the same again costs nothing."""
    with SYMBOLS:
        cell, own = _cell_kernel(_Structure.of(pack, mesh, backend))
    return PackModel(cell, tuple(kind.count for kind in pack.cells()), own)


def begin(pack: Pack, mesh: Mesh, backend: Backend) -> None:
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
    def of(cls, pack: Pack, mesh: Mesh, backend: Backend) -> "_Structure":
        return cls(pack.cell, mesh, backend, pack.ages, pack.stressed, pack.hysteretic)


@lru_cache(maxsize=16)
def _cell_kernel(of: _Structure) -> tuple[StepModel, Kernel]:
    model, made = _begun(of)
    return model, made()


@lru_cache(maxsize=16)
def _begun(of: _Structure) -> tuple[StepModel, Callable[[], Kernel]]:
    model = StepModel(
        of.cell, of.mesh, ageing=of.ageing, stressed=of.stressed, hysteretic=of.hysteretic
    )
    return model, begun(model.step(), of.backend)


def of_places(pack: Pack, rows: FloatArray) -> FloatArray:
    """(series, m) of each cell where it stands, from rows (kinds, m); read it only."""
    if rows.shape[0] == 1:
        return np.broadcast_to(rows, (pack.series, rows.shape[1]))
    return rows[list(pack.places())]


def forget() -> None:
    """Drop the kernels that are kept, so that they are made anew."""
    _cell_kernel.cache_clear()
    _begun.cache_clear()
