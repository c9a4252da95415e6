"""`Loss`: what a pack has lost, by mechanism; `Ledger` reads it from the kernel's state."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from twin.cell_mesh import fine_mesh_of
from twin.constants import FARADAY_C_mol
from twin.inventory import Lithium
from twin.kernel import Backend
from twin.mesh import Mesh
from twin.pack import Pack
from twin.pack_model import pack_model

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """Between two moments, of a pack; charges are those its lithium could have carried [C].

    `lithium_C` is read from what is left in the particles, the rest from where it went: the first
    is the sum of the others to rounding, but for what the salt gained or gave.

    Attributes:
        lithium_C: that left the active particles.
        sei_C: bound in SEI.
        sei_on_cracks_C: bound in SEI on the faces of cracks.
        plated_C: metallic, in contact: it strips in the next flight and is not lost; may be < 0.
        dead_C: metallic, cut off.
        trapped_C: in active material that was lost.
        negative: share of the negative electrode's active material that was lost.
        positive: likewise.
    """

    lithium_C: float
    sei_C: float
    sei_on_cracks_C: float
    plated_C: float
    dead_C: float
    trapped_C: float
    negative: float
    positive: float

    @property
    def reactions_C(self) -> float:
        """By side reactions, for good: SEI, SEI on cracks, dead lithium."""
        return self.sei_C + self.sei_on_cracks_C + self.dead_C

    @property
    def inventory_C(self) -> float:
        """Lithium that is lost for good: by reactions, and with lost material."""
        return self.reactions_C + self.trapped_C

    def __add__(self, other: "Loss") -> "Loss":
        return _loss(np.add(astuple(self), astuple(other)))

    def __sub__(self, other: "Loss") -> "Loss":
        return _loss(np.subtract(astuple(self), astuple(other)))

    def __mul__(self, factor: float) -> "Loss":
        return _loss(np.multiply(astuple(self), factor))


def _loss(values: Sequence[float] | FloatArray) -> Loss:
    return Loss(**dict(zip(Loss.__slots__, map(float, values), strict=True)))


NOTHING = _loss(np.zeros(len(Loss.__slots__)))


class Ledger:
    """Reads states of one pack; of unlike cells the mean."""

    def __init__(
        self, pack: Pack, *, mesh: Mesh | None = None, backend: Backend = Backend.AUTO
    ) -> None:
        assert pack.ages, "a pack without ageing loses nothing"
        self._model, kinds = pack_model(pack, mesh, backend), pack.cells()
        self._pack, self._mesh, self._backend = pack, mesh, backend
        self._layout = self._model.cell.layout
        self._lithium = [Lithium(self._layout, kind.values) for kind in kinds]
        self._shares = np.array([kind.count / pack.series for kind in kinds])
        self._as_charge = FARADAY_C_mol * pack.parallel
        self.new = self._model.initial_state(kinds)
        """(states,) of the kernel at the start of life."""
        self._zero = NOTHING
        self._zero = self.loss(self.new)

    @cached_property
    def _finer(self) -> "Ledger":
        return Ledger(self._pack, mesh=fine_mesh_of(self._pack.cell), backend=self._backend)

    @property
    def cyclable_C(self) -> float:
        """Lithium in the particles of the new pack."""
        return -self._zero.lithium_C

    def loss(self, state: FloatArray) -> Loss:
        """Since the start of life.

        Of a state on the mesh that was asked for; if none was, on the usual or the finer one.
        """
        if self._mesh is None and state.size != self._model.size:
            return self._finer.loss(state)
        rows = [
            self._row(lithium, own)
            for lithium, own in zip(self._lithium, self._model.states(state), strict=True)
        ]
        return _loss(self._shares @ np.array(rows)) - self._zero

    def _row(self, lithium: Lithium, state: FloatArray) -> list[float]:
        mol, scale = lithium.mol(state), self._as_charge
        return [
            -scale * (mol["negative"] + mol["positive"]),
            *(scale * mol[name] for name in ("sei", "sei_on_cracks", "plated", "dead")),
            scale * (mol["trapped_negative"] + mol["trapped_positive"]),
            *(1 - self._left(side, state) for side in ("negative", "positive")),
        ]

    def _left(self, side: str, state: FloatArray) -> float:
        left = state[self._layout.slice_of(f"left_{side[0]}")]
        return float(self._layout.layer(side).weight @ left)
