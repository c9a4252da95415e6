"""The state of a pack on another mesh of its cell: amounts are kept, the rest is interpolated."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BarycentricInterpolator

from twin.inventory import Lithium
from twin.layout import Layout
from twin.mesh import Layer
from twin.pack import CellKind
from twin.pack_model import PackModel

FloatArray = npt.NDArray[np.float64]

WHOLE = ("gap_V", "voltage_V", "temperature_K")
"""Of the state: no number a node."""
LASTING = (
    "film", "crack_film", "plated", "dead", "crack_m", "porosity", "left_n", "left_p",
    "trapped_n", "trapped_p",
)  # fmt: skip
"""Of the state: what ageing adds and a rest leaves; its mean over the electrode is kept."""
LITHIUM = {"modes_n": "negative", "modes_p": "positive", "salt": "electrolyte"}
"""Of the state -> in the balance: amounts that are kept; means of particles are the first modes."""


def carried(
    state: FloatArray, kinds: Sequence[CellKind], of: PackModel, to: PackModel
) -> FloatArray:
    """(states of `to`,) from (states of `of`,): models of one pack, of `kinds`, on two meshes.

    Potentials stay as they were at each place: a step of length 0 makes them fit.
    """
    if of.cell.layout == to.cell.layout:
        return state
    each = zip(of.states(state), kinds, strict=True)
    return np.concatenate(
        [_carried(own, kind.values, of.cell.layout, to.cell.layout) for own, kind in each]
    )


def _carried(state: FloatArray, values: Mapping[str, float], of: Layout, to: Layout) -> FloatArray:
    """Of one cell. What an amount lacks is added to all of its nodes alike."""
    out = np.zeros(to.size)
    for name in to.sizes():
        old, new = state[of.slice_of(name)], out[to.slice_of(name)]  # views
        if name in WHOLE:
            new[:] = old
        elif name == "salt":
            for layer, span in to.layers().items():
                new[span] = _onto(of.layer(layer), to.layer(layer)) @ old[of.layers()[layer]]
        elif name == "enthalpy_V":
            n, p = of.electrodes[0], to.electrodes[0]
            new[:p] = _onto(of.layer("negative"), to.layer("negative")) @ old[:n]
            new[p:] = _onto(of.layer("positive"), to.layer("positive")) @ old[n:]
        else:
            side = "positive" if name.endswith("_p") else "negative"
            a, b = of.layer(side), to.layer(side)
            new[:] = (old.reshape(-1, a.size) @ _onto(a, b).T).ravel()
            if name in LASTING:
                new += a.weight @ old - b.weight @ new
    before, now = (Lithium(layout, values) for layout in (of, to))
    for name, held in LITHIUM.items():
        count = to.nodes if name == "salt" else to.layer(held).size
        nodes = out[to.slice_of(name)][:count]
        got_mol = now.mol(out)[held]
        nodes += 1.0
        added_mol = now.mol(out)[held] - got_mol
        nodes += (before.mol(state)[held] - got_mol) / added_mol - 1.0
    return out


@lru_cache(maxsize=16)
def _onto(old: Layer, new: Layer) -> FloatArray:
    """(new nodes, old nodes) values at the nodes of one layer from those at the other's."""
    out = np.zeros((new.size, old.size))
    for element, left, right in zip(old.elements, old.edges[:-1], old.edges[1:], strict=True):
        rows = np.flatnonzero((new.x >= left) & (new.x <= right))
        nodes = np.array(element.nodes)
        values = BarycentricInterpolator(old.x[nodes], np.eye(nodes.size))(new.x[rows])
        out[np.ix_(rows, nodes)] = values
    return out
