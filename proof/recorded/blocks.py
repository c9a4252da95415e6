"""One measured run in four interleaved parts: to fit a twin, to know its error, and two to judge.

A run that was measured once has no second one. Each part keeps the whole current, so that the
twin's state is that of the run, and the voltage of its own blocks only.
"""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from proof.question import Recording
from proof.recorded.measured import FloatArray, RealTest
from proof.recorded.replay import whole_V
from twin.calibrate.flight import FlightFit, NotFitted, fit_flight
from twin.calibrate.flight_problem import Flown, Known
from twin.effects import SeriesResistance
from twin.load import Load
from twin.mismatch import HYPOTHESES, Flight
from twin.mismatch.fit import fit
from twin.mismatch.split import split
from twin.mismatch.white import white_V
from twin.pack import Pack

BoolArray = npt.NDArray[np.bool_]

LATE = 0.95  # of the error without: less is worth an effect
TIMING = ("clock_shift", "sensor_lag")
MEAN_S = 2.0  # long to the noise of samples, short to what a twin errs by (twin.mismatch.split)


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
        samples: as it was recorded, where it is means of that.
    """

    pack: Pack
    known: Known
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    counted: BoolArray
    rounds: int
    samples: RealTest | None = None

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

    def load(self, current_A: FloatArray) -> Load:
        """A current at the times of the run."""
        return Load(time_s=self.run.time_s, current_A=current_A, ambient_K=self.ambient_K)

    def flight(self, part: Part) -> Flight:
        """One part as the engine takes it."""
        voltage_V = self.run.part(part)
        return Flight(
            name=part.name,
            pack=self.pack,
            load=self.load(self.run.current_A),
            voltage_V=voltage_V,
            judged=np.isfinite(voltage_V),
            motion=np.full(voltage_V.size, ""),
        )

    def error_V(self, part: Part, current_A: FloatArray) -> float:
        """Recorded minus simulated, rms."""
        return float(np.sqrt(np.nanmean(self.residual_V(part, current_A) ** 2)))

    def floor_V(self) -> float:
        """Error of the twin where it was not fitted: rms of means over MEAN_S, free of noise."""
        r = self.residual_V(Part.FLOOR, self.run.current_A)
        own = np.isfinite(r)
        span = (self.run.time_s[own] // MEAN_S).astype(int)
        means = np.bincount(span, r[own])[np.unique(span)] / np.bincount(span)[np.unique(span)]
        return float(np.sqrt(np.mean(means**2)))

    def noise_V(self, part: Part) -> float:
        """Of a sample of it, by what is left; 0 where so few tell none."""
        r, t = self.residual_V(part, self.run.current_A), self.run.time_s
        own = np.isfinite(r)
        period_s = float(np.median(np.diff(t[own])))
        return white_V(r[own], self.run.current_A[own], period_s) or 0.0

    def residual_V(self, part: Part, current_A: FloatArray) -> FloatArray:
        """(n,) recorded minus simulated, NaN elsewhere; where that ended as at its end."""
        return np.asarray(self.run.part(part) - whole_V(self.pack, self.load(current_A)))


def fitted(run: Run) -> Fitted:
    """By least squares to the blocks of `Part.BASE`, then with current and voltage on one clock.

    As a user has it who keeps a twin of a healthy pack: `analyze` fits the flight; where loggers
    filter and poll the two apart, the engine's fit of that is adopted.
    """
    start = Fitted(run=run, pack=run.pack, ambient_K=run.pack.initial_K)
    flown = Flown(load=start.load(run.current_A), voltage_V=run.part(Part.BASE), in_air=run.counted)
    found: FlightFit | NotFitted = fit_flight(run.pack, flown, run.known)
    if isinstance(found, FlightFit):
        own = replace(one_resistance(found.pack), soc_by_rest=False)  # it starts as it was fitted
        start = replace(start, pack=own, ambient_K=found.ambient_K)
    return _aligned(start)


def _aligned(start: Fitted) -> Fitted:
    """With the effect of TIMING that `Part.BASE` shows, if `Part.FLOOR` is missed less with it."""
    flights = [start.flight(part) for part in (Part.BASE, Part.FLOOR)]
    data = split(flights[:1], flights[1:])
    best_V, pack = LATE * fit(data, ()).held_out_rms_V(), start.pack
    for timing in (h for h in HYPOTHESES if h.id in TIMING):
        found = fit(data, [timing])
        if found.held_out_rms_V() < best_V:
            best_V = found.held_out_rms_V()
            told = found.problem.values(found.q)[timing.id]
            pack = timing.within(start.pack, list(told.values()))
    return replace(start, pack=pack)


def one_resistance(pack: Pack) -> Pack:
    """The same with its resistances in series as one, which is all that a pack file can say."""
    own = [e for e in pack.effects if isinstance(e, SeriesResistance)]
    rest = tuple(e for e in pack.effects if not isinstance(e, SeriesResistance))
    whole = SeriesResistance(resistance_ohm=sum(e.resistance_ohm for e in own))
    return replace(pack, effects=(*rest, whole)) if own else pack
