"""A recording of a pack beside the twin that is meant to answer it."""

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
import numpy.typing as npt

from twin.calibrate.doubt import Other
from twin.load import Load
from twin.pack import Pack

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


START_SOC = 0.002
"""Tolerance of a state of charge at the start that is known, standard deviation."""
UNTOLD = 0.05
"""The same of one that only the twin as configured tells (`started`). Of 140 recordings by another
simulator, most of them with an effect in it, it was 0.025 off, rms, 0.15 at worst (lost material);
of controls 0.007. A calibrated twin errs besides."""
NO_REST = 0.03
"""The same of one that was read from a voltage at rest, beside an effect by which that was no rest.
Near full a charge of 0.01 is 10 mV of a cell: of packs of 2.2 Ah by another simulator a leak of
0.3 A made 0.005 of it, one of 2.4 A 0.03, 3000 mol/m3 of lithium that strip 0.007."""
OF_SAMPLES = ("voltage_V", "judged", "motion", "temperature_K", "cell_voltage_V", "recorded")


class MismatchError(ValueError):
    """The recordings cannot be judged; the text says which, why and what would do."""


@dataclass(frozen=True, slots=True)
class Idle:
    """A stretch of a recording in which the pack idles and its current is noise about a mean.

    Attributes:
        start_s: first of its samples.
        end_s: last of them.
        noise_A: of the current, standard deviation.
        samples: how many.
    """

    start_s: float
    end_s: float
    noise_A: float
    samples: int

    @property
    def mean_A(self) -> float:
        """Of the mean, standard deviation."""
        return self.noise_A / sqrt(self.samples)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flight:
    """One recording; MismatchError if its arrays do not fit.

    Attributes:
        name: for results.
        pack: the twin as configured, with how it starts.
        load: the recorded current of the pack.
        voltage_V: (n,) recorded at the times of the load; NaN where not measured.
        judged: (n,) which samples count; a voltage must have been measured there.
        motion: (n,) what the vehicle did, or "" where that is not known.
        temperature_K: (n,) of the pack, NaN where it was not measured; None if it never was.
        cell_voltage_V: (n, cells) likewise.
        recorded: (n,) which samples of the load were recorded; None if none were added between.
        allowed: other cells that the tests of a calibrated one allow as well.
        idle: where the mean of the current stands for it (`idle`).
        start_std: of the state of charge at the start, standard deviation: UNTOLD where nothing
            tells it, more than START_SOC where a flat open-circuit voltage hardly does.
    """

    name: str
    pack: Pack
    load: Load
    voltage_V: FloatArray
    judged: BoolArray
    motion: npt.NDArray[np.str_]
    temperature_K: FloatArray | None = None
    cell_voltage_V: FloatArray | None = None
    recorded: BoolArray | None = None
    allowed: tuple[Other, ...] = ()
    idle: tuple[Idle, ...] = ()
    start_std: float = START_SOC

    def __post_init__(self) -> None:
        for name in OF_SAMPLES:
            values = getattr(self, name)
            if values is not None and values.shape[:1] != self.load.time_s.shape:
                raise MismatchError(
                    f"{self.name}: {name} {values.shape}, load {self.load.time_s.shape}"
                )
        object.__setattr__(self, "judged", self.judged & np.isfinite(self.voltage_V))

    @property
    def start_told(self) -> bool:
        """How full the pack was is more than an assumption."""
        return self.start_std < UNTOLD

    @property
    def start_open(self) -> bool:
        """How full it was is known so badly that its own voltage tells it better."""
        return self.start_std > START_SOC

    def beside(self, *, no_rest: bool) -> "Flight":
        """With effects, of which some may have made what was read as a rest none."""
        if not (no_rest and self.pack.soc_by_rest):
            return self
        return replace(self, start_std=max(self.start_std, NO_REST))

    @property
    def time_s(self) -> FloatArray:
        """(n,) of the samples."""
        return self.load.time_s

    @property
    def recorded_load(self) -> Load:
        """Without what was added between its samples."""
        if self.recorded is None:
            return self.load
        time_s, current_A = (v[self.recorded] for v in (self.load.time_s, self.load.current_A))
        return replace(self.load, time_s=time_s, current_A=current_A)
