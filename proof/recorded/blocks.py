"""One measured run in four interleaved parts: to fit a twin, to know its error, and two to judge.

A run that was measured once has no second one. Each part keeps the whole current, so that the
twin's state is that of the run, and the voltage of its own blocks only.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from proof.question import Recording
from proof.recorded.measured import FloatArray
from twin.calibrate.flight import FlightFit, NotFitted, fit_flight
from twin.calibrate.flight_problem import Flown, Known
from twin.load import Load
from twin.mismatch.problem import beyond_cut_offs
from twin.pack import Pack
from twin.simulate import simulate

BoolArray = npt.NDArray[np.bool_]


class Part(IntEnum):
    """What the voltage of a block is for."""

    BASE = 0
    """The twin is fitted to it."""
    FLOOR = 1
    """Shows the error of the twin where it was not fitted."""
    FITTED = 2
    """Concealed effects are looked for in it."""
    HELD_OUT = 3
    """They are judged on it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """A flight or a drive cycle, and the pack that it was made with as far as it is known.

    Attributes:
        pack: before a fit, as it started.
        known: what of it was known.
        time_s: (n,) increasing.
        current_A: (n,) of the pack, discharge positive.
        voltage_V: (n,) of the pack.
        counted: (n,) where it is compared: in the air.
        rounds: how often the parts take turns.
        fit: a fit may change the pack; not where it was published for this very cell.
    """

    pack: Pack
    known: Known
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    counted: BoolArray
    rounds: int
    fit: bool = True

    def part(self, part: Part) -> FloatArray:
        """(n,) voltage of one part, NaN elsewhere."""
        t = self.time_s[self.counted]
        edges = np.linspace(t[0], t[-1], len(Part) * self.rounds + 1)
        block = np.searchsorted(edges, self.time_s, side="right") - 1
        own = self.counted & (block % len(Part) == part.value)
        return np.where(own, self.voltage_V, np.nan)

    def recording(self, part: Part, name: str, current_A: FloatArray) -> Recording:
        """One part, as it would have been recorded with this current."""
        return Recording(
            name=name, time_s=self.time_s, current_A=current_A, voltage_V=self.part(part)
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """The pack of a run, as its first part tells it, in air of this temperature."""

    run: Run
    pack: Pack
    ambient_K: float

    def error_V(self, part: Part, current_A: FloatArray) -> float:
        """Recorded minus simulated, rms; where the simulation ended as at its end."""
        load = Load(time_s=self.run.time_s, current_A=current_A, ambient_K=self.ambient_K)
        got = simulate(beyond_cut_offs(self.pack), load).voltage_V
        whole = np.append(got, np.full(load.time_s.size - got.size, got[-1]))
        return float(np.sqrt(np.nanmean((self.run.part(part) - whole) ** 2)))


def fitted(run: Run) -> Fitted:
    """By least squares to the blocks of `Part.BASE`, as `analyze` fits every flight."""
    still = Fitted(run=run, pack=run.pack, ambient_K=run.pack.initial_K)
    if not run.fit:
        return still
    load = Load(time_s=run.time_s, current_A=run.current_A, ambient_K=still.ambient_K)
    flown = Flown(load=load, voltage_V=run.part(Part.BASE), in_air=run.counted)
    found: FlightFit | NotFitted = fit_flight(run.pack, flown, run.known)
    if isinstance(found, NotFitted):
        return still
    return Fitted(run=run, pack=found.pack, ambient_K=found.ambient_K)
