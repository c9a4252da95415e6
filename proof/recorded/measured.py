"""`RealTest` and `RealCell`: what was measured on a cell, and what stands for it so far."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.io import loadmat

from twin.builtin import load_cell
from twin.calibrate.reference import ReferenceTest
from twin.cell import Cell
from twin.load import Between
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]

RESTED_S = 900.0  # without a current: at rest
TICK_S = 1e-3  # between two samples with one time stamp: before and after a step
BEYOND_V = 0.5  # a replay goes on so far beyond the cut-offs, to be judged by its voltage


class NotHere(Exception):
    """A recording that is not on this machine; the text says which."""


def recording(folder: Path, name: str) -> Path:
    """The path of a file in the collection of recordings, by its name there; NotHere without it."""
    path = folder / name
    if not path.exists():
        raise NotHere(f"no recording at {path}")
    return path


@dataclass(frozen=True, kw_only=True, eq=False)
class RealTest:
    """One test, from rest; (n,) each.

    Attributes:
        name: short.
        time_s: from 0, strictly increasing.
        current_A: at the terminals, discharge positive; straight from sample to sample.
        voltage_V: at the terminals; NaN where it was not recorded.
        temperature_K: measured on the cell; None if it was not.
        mount: what held the cell: it cools alike in all tests with this name.
        drawn_before_C: charge drawn since the cell was charged as its maker says.
    """

    name: str
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    temperature_K: FloatArray | None = None
    mount: str = ""
    drawn_before_C: float = 0.0

    @cached_property
    def drawn_C(self) -> FloatArray:
        """(n,) since the start."""
        mean = (self.current_A[1:] + self.current_A[:-1]) / 2
        return np.concatenate([[0.0], np.cumsum(np.diff(self.time_s) * mean)])

    def part(self, rows: slice) -> "RealTest":
        """Some of its samples, from time 0."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        chosen: dict[str, Any] = {
            k: v[rows] for k, v in arrays.items() if isinstance(v, np.ndarray)
        }
        chosen["time_s"] = chosen["time_s"] - chosen["time_s"][0]
        return replace(self, **chosen)

    def start_K(self, otherwise_K: float) -> float:
        """Temperature of the first sample; `otherwise_K` if none was measured."""
        return otherwise_K if self.temperature_K is None else float(self.temperature_K[0])

    def reference(self, *, ambient_K: float, between: Between = Between.HOLD) -> ReferenceTest:
        """As a calibration takes it; rows before its first voltage have that, unheard."""
        heard = np.isfinite(self.voltage_V)
        early = np.arange(heard.size) < np.argmax(heard)
        return ReferenceTest(
            name=self.name, time_s=self.time_s, current_A=self.current_A,
            voltage_V=np.where(early, self.voltage_V[np.argmax(heard)], self.voltage_V),
            between=between, ambient_K=ambient_K, temperature_K=self.temperature_K,
            mount=self.mount, unheard=early if early.any() else None,
        )  # fmt: skip


def rms_A(test: RealTest | ReferenceTest) -> float:
    """Current of a test, each sample for as long as it lasts."""
    lasts_s = np.diff(test.time_s, append=test.time_s[-1])
    return float(np.sqrt(np.average(test.current_A**2, weights=lasts_s)))


def on_one_clock(test: RealTest) -> RealTest:
    """The same with strictly increasing times from 0.

    Samples with the same stamp, before and after a step, move TICK_S apart; stamps that go back by
    more are dropped.
    """
    t = test.time_s
    latest = np.maximum.accumulate(t)
    first = np.searchsorted(latest, latest)  # of the samples with this stamp
    spread = latest + TICK_S * (np.arange(t.size) - first)
    keep = (t > latest - TICK_S) & np.append(np.diff(spread) > 0, True)
    arrays = {
        name: getattr(test, name)[keep]
        for name in ("current_A", "voltage_V", "temperature_K")
        if getattr(test, name) is not None
    }
    return replace(test, time_s=spread[keep] - spread[keep][0], **arrays)


def discharge_of(test: RealTest) -> RealTest:
    """Up to the last sample of the first discharge, with the rest before it."""
    flows = test.current_A > 0.02 * test.current_A.max()
    start = int(np.argmax(flows))
    ended = np.flatnonzero(~flows[start:])
    return test.part(slice(0, start + int(ended[0]) if ended.size else None))


def recorded_parts(test: RealTest) -> tuple[RealTest, ...]:
    """Its stretches with a voltage that begin after a rest, or with the test.

    Those of a test with gaps have a number in their name. Before the first voltage of one without
    there may be rows with a current.
    """
    there = np.isfinite(test.voltage_V)
    edges = np.flatnonzero(np.diff(there.astype(int), prepend=0, append=0)).reshape(-1, 2)
    if len(edges) == 1:
        return (test.part(slice(0, int(edges[0][1]))),)
    before_C = test.drawn_C - np.interp(test.time_s - RESTED_S, test.time_s, test.drawn_C)
    rested = [(a, b) for a, b in edges.tolist() if before_C[a] == 0.0]
    return tuple(
        replace(test.part(slice(a, b)), name=f"{test.name}, {k}")
        for k, (a, b) in enumerate(rested, start=1)
    )


def held_V(test: RealTest) -> RealTest:
    """The same with the voltage of the row before in rows without one.

    At a change of the current that is a row with the voltage of the other side, which a calibration
    leaves out (`twin.calibrate.switched`).
    """
    there = np.where(np.isfinite(test.voltage_V), np.arange(test.voltage_V.size), 0)
    return replace(test, voltage_V=test.voltage_V[np.maximum.accumulate(there)])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RealCell:
    """A cell, or pack of equal cells, with the tests to fit and the tests to judge by.

    Attributes:
        name: short.
        fit: tests a calibration may see.
        held_out: tests it is judged on.
        baseline: what stands for it before any calibration, as it starts when charged (a flight:
            as it took off).
        source: where the baseline is from.
        published: the baseline was measured or tuned on this very make of cell by its publisher.
    """

    name: str
    fit: tuple[RealTest, ...]
    held_out: tuple[RealTest, ...]
    baseline: Pack
    source: str
    published: bool


def wide(cell: Cell) -> Cell:
    """The same cell with its cut-offs out of the way of a replay."""
    return cell.beyond(BEYOND_V, BEYOND_V)


def narrow(cell: Cell) -> Cell:
    """Inverse of `wide`."""
    return cell.beyond(-BEYOND_V, -BEYOND_V)


def nearest(builtin: str, slow: RealTest) -> tuple[Pack, str]:
    """A built-in cell with the charge that a slow discharge gave, and how to call it."""
    capacity_C = float(slow.drawn_C[-1])
    pack = Pack(cell=wide(load_cell(builtin)), capacity_C=capacity_C)
    return pack, f"built-in {builtin}, scaled to the {capacity_C / 3600:.2f} Ah of {slow.name}"


def matlab(path: Path) -> SimpleNamespace:
    """The one variable of a MATLAB file, its fields as attributes."""
    content = loadmat(path, squeeze_me=True, struct_as_record=False)
    names = [name for name in content if not name.startswith("__")]
    return SimpleNamespace(**vars(content[names[0]]))
