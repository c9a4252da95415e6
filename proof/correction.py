"""A correction of the voltage without physics: sparse regression of the residual on a library.

Terms are quantities of the load and of the twin's answer, their squares and their products with the
current, as in sparse identification (Brunton, Proctor, Kutz, PNAS 113, 3932, 2016). They are taken
one after the other, each the one that then mends most; how many is chosen by cross-validation over
blocks of time of the fitted recordings, so that it is as good as such a correction can be made
without looking at what is held out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from twin.load import Load
from twin.mismatch import Flight
from twin.mismatch.left import beyond_cut_offs, left_V
from twin.mismatch.quantities import quantities
from twin.simulate import simulate
from twin.solution import Solution

FloatArray = npt.NDArray[np.float64]

MOST_TERMS = 12
BLOCKS = 6  # of each recording
CURRENT = "current"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answered:
    """A recording and the twin as configured.

    Attributes:
        load: the recorded current.
        solution: the twin's answer.
        residual_V: (n,) recorded minus simulated, as the engine has it (`left_V`); NaN where it
            does not count.
    """

    load: Load
    solution: Solution
    residual_V: FloatArray

    @classmethod
    def of(cls, flight: Flight) -> "Answered":
        """Simulates."""
        pack = beyond_cut_offs(flight.pack)
        solution = simulate(pack, flight.load)
        residual_V = np.where(flight.judged, left_V(flight, pack, solution), np.nan)
        return cls(load=flight.load, solution=solution, residual_V=residual_V)

    def library(self) -> Mapping[str, FloatArray]:
        """Name -> (n,) at all samples; beyond the end of the twin as at its end."""
        n = self.load.time_s.size
        plain = {
            name: np.pad(values, (0, n - values.size), mode="edge")
            for name, values in quantities(self.load, self.solution).items()
        }
        squares = {f"({name})²": values**2 for name, values in plain.items()}
        products = {
            f"{CURRENT} x {name}": plain[CURRENT] * values
            for name, values in plain.items()
            if name != CURRENT and CURRENT in plain
        }
        return {**plain, **squares, **products}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correction:
    """What is added to the voltage: `constant_V` and a weight times each term."""

    names: tuple[str, ...]
    weights: FloatArray
    constant_V: float

    def at(self, own: Answered) -> FloatArray:
        """(n,) [V]; a term that a recording has not is not added."""
        library = own.library()
        zero = np.zeros(own.residual_V.size)
        columns = [library.get(name, zero) for name in self.names]
        added = [w * c for w, c in zip(self.weights.tolist(), columns, strict=True)]
        return np.asarray(self.constant_V + sum(added, zero))


def corrected(fitted: Sequence[Answered]) -> Correction:
    """The correction that these recordings suggest."""
    libraries = [own.library() for own in fitted]
    names = sorted(set.intersection(*(set(library) for library in libraries)))
    residual_V = np.concatenate([own.residual_V for own in fitted])
    good = np.isfinite(residual_V)
    columns = {n: np.concatenate([library[n] for library in libraries])[good] for n in names}
    columns = {n: c for n, c in columns.items() if np.ptp(c) > 0}
    blocks = np.concatenate([_blocks(own.load.time_s, k) for k, own in enumerate(fitted)])[good]
    y = residual_V[good]
    order = _greedy(columns, y)
    sizes = range(len(order) + 1)
    best = min(sizes, key=lambda k: _cross_validated(columns, order[:k], y, blocks))
    solved = _solved(columns, order[:best], y)
    return Correction(names=tuple(order[:best]), weights=solved[:-1], constant_V=float(solved[-1]))


def _blocks(time_s: FloatArray, recording: int) -> npt.NDArray[np.int64]:
    share = (time_s - time_s[0]) / max(time_s[-1] - time_s[0], 1e-9)
    return np.asarray(recording * BLOCKS + np.minimum((BLOCKS * share).astype(int), BLOCKS - 1))


def _greedy(columns: Mapping[str, FloatArray], y: FloatArray) -> list[str]:
    """Terms in the order in which they mend most (orthogonal matching pursuit)."""
    unit = {n: (c - c.mean()) / np.linalg.norm(c - c.mean()) for n, c in columns.items()}
    order: list[str] = []
    left = y - y.mean()
    while unit and len(order) < MOST_TERMS:
        name = max(unit, key=lambda n: abs(float(unit[n] @ left)))
        order.append(name)
        del unit[name]
        left = y - _design(columns, order) @ _solved(columns, order, y)
    return order


def _cross_validated(
    columns: Mapping[str, FloatArray], names: Sequence[str], y: FloatArray,
    blocks: npt.NDArray[np.int64],
) -> float:  # fmt: skip
    """Sum of squares in each block by what the others say."""
    whole, total = _design(columns, names), 0.0
    for block in np.unique(blocks):
        own = blocks == block
        said_V = 0.0 if own.all() else whole[own] @ _weights(whole[~own], y[~own])
        total += float(np.sum((y[own] - said_V) ** 2))
    return total


def _design(columns: Mapping[str, FloatArray], names: Sequence[str]) -> FloatArray:
    n = next(iter(columns.values())).size
    return np.column_stack([*(columns[name] for name in names), np.ones(n)])


def _solved(columns: Mapping[str, FloatArray], names: Sequence[str], y: FloatArray) -> FloatArray:
    """Weights, then the constant."""
    return _weights(_design(columns, names), y)


def _weights(whole: FloatArray, y: FloatArray) -> FloatArray:
    """By least squares; columns are scaled first: their units differ by 1e6."""
    scale = np.abs(whole).max(axis=0, initial=0.0)
    scale[scale == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(whole / scale, y, rcond=None)[0] / scale)
