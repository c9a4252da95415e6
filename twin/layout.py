"""Where the quantities lie in the state, and in which order the salt is eliminated."""

from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from twin.mesh import Layer, Mesh


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the quantities lie in the state.

    Modes of the negative and positive particles (nodes x modes), salt (nodes left to right),
    reaction current negative, positive, phi_s - phi_e of both at the separator, how the reactions
    answer a change of the cell's current [1/m2], enthalpy potential of both, voltage, temperature.
    With hysteresis also where each node of both electrodes is between its branches, -1 to 1. With
    ageing also, in the negative electrode, films, plated and dead lithium [mol per m3 of
    electrode], crack length, porosity, total current, the part of it that strips; in both
    electrodes the share of active material that is left, and the lithium trapped in the rest (share
    of what all can hold).
    """

    mesh: Mesh
    ageing: bool = False
    hysteretic: bool = False
    _slices: dict[str, slice] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        sizes = self.sizes()
        ends = np.cumsum(list(sizes.values())).tolist()
        slices = {k: slice(end - sizes[k], end) for k, end in zip(sizes, ends, strict=True)}
        object.__setattr__(self, "_slices", slices)

    @property
    def electrodes(self) -> tuple[int, int]:
        """Nodes in the negative and positive electrode."""
        return self.mesh.negative.size, self.mesh.positive.size

    @property
    def nodes(self) -> int:
        """Nodes of the electrolyte; a node between two layers counts once."""
        return self.mesh.negative.size + self.mesh.separator.size + self.mesh.positive.size - 2

    @property
    def size(self) -> int:
        """Length of the state."""
        return sum(self.sizes().values())

    def layer(self, name: str) -> Layer:
        """The mesh of `negative`, `separator` or `positive`."""
        return {
            "negative": self.mesh.negative,
            "separator": self.mesh.separator,
            "positive": self.mesh.positive,
        }[name]

    def layers(self) -> dict[str, slice]:
        """Name -> nodes of the electrolyte in it; a node between two layers is in both."""
        n, p = self.electrodes
        return {
            "negative": slice(0, n),
            "separator": slice(n - 1, self.nodes - p + 1),
            "positive": slice(self.nodes - p, self.nodes),
        }

    def sizes(self) -> dict[str, int]:
        """Name -> length in the state, in order."""
        n, p = self.electrodes
        m = self.mesh.sphere.size
        base = {
            "modes_n": n * m, "modes_p": p * m, "salt": self.nodes, "reaction_n": n,
            "reaction_p": p, "gap_V": 2, "answer_n": n, "answer_p": p,
            "enthalpy_V": n + p, "voltage_V": 1, "temperature_K": 1,
        }  # fmt: skip
        memory = {"hysteresis_n": n, "hysteresis_p": p} if self.hysteretic else {}
        return base | memory | self.ageing_sizes()

    def ageing_sizes(self) -> dict[str, int]:
        """The part of `sizes` that ageing adds."""
        if not self.ageing:
            return {}
        n, p = self.electrodes
        names = (
            "film",
            "crack_film",
            "plated",
            "dead",
            "crack_m",
            "porosity",
            "total_n",
            "strip_n",
        )
        out = dict.fromkeys((*names, "left_n", "trapped_n"), n)
        return out | dict.fromkeys(("left_p", "trapped_p"), p)

    def split(self, state: ca.SX) -> dict[str, ca.SX]:
        """The parts of a state vector by name; modes as (nodes, modes)."""
        ends = np.cumsum([0, *self.sizes().values()])
        parts = dict(zip(self.sizes(), ca.vertsplit(state, ends.tolist()), strict=True))
        for key, nodes in zip(("modes_n", "modes_p"), self.electrodes, strict=True):
            parts[key] = ca.reshape(parts[key], nodes, self.mesh.sphere.size)
        return parts

    def slice_of(self, name: str) -> slice:
        """Where `name` lies in the state."""
        return self._slices[name]

    def elimination_order(self) -> list[int]:
        """Nodes of the electrolyte in the order they are eliminated: collectors first."""
        n, p = self.electrodes
        total = self.nodes
        return [*range(n), *reversed(range(total - p, total)), *range(n, total - p)]
