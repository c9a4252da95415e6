"""`Truth`: what is sealed, and what a verdict has to say to be right."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Channel:
    """Measured beside a recording and kept from the judge.

    Attributes:
        recording: name of it.
        time_s: (n,) on its clock.
        temperature_K: (n,) of the pack; None if it is not what is concealed.
        cell_voltage_V: (n, cells); None likewise.
    """

    recording: str
    time_s: FloatArray
    temperature_K: FloatArray | None = None
    cell_voltage_V: FloatArray | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """A number of a named effect whose true value is known."""

    effect: str
    name: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """Of one trial.

    Attributes:
        kind: of the trial, see KINDS.
        said: what is in the data, in words.
        verdicts: that are right: "none", "named", "unknown", "ambiguous".
        effects: of a named verdict: for each effect that is there, the ids that are right for it.
            One is enough; it may be among the equivalents of what was named.
        also: ids that may be named beside, since they come with it (resistance with age).
        strength: rms by which the effect changes the voltage of the fitted recordings, over
            `floor_V`. Where no twin has the effect (age, transport): rms by which they are missed.
        floor_V: noise; of a real cell the error of its calibrated twin.
        noise_V: of a sample, beside a `floor_V` that is free of it.
        numbers: true values.
        channels: revealed afterwards.
        capacity_C: that a check-up which is held out draws to empty. No number is fitted to that
            check-up, but it decides between effects. None where none is predicted.
        details: anything else, for the reader.
    """

    kind: str
    said: str
    verdicts: tuple[str, ...]
    effects: tuple[tuple[str, ...], ...]
    strength: float
    floor_V: float
    also: tuple[str, ...] = ()
    numbers: tuple[Number, ...] = ()
    channels: tuple[Channel, ...] = ()
    capacity_C: float | None = None
    details: Mapping[str, str | float] | None = None
    noise_V: float = 0.0

    @property
    def ahead_V(self) -> float:
        """What the best that can be said leaves of samples held out: floor and noise."""
        return hypot(self.floor_V, self.noise_V)


SIMULATED = ("control", "single", "pair", "foreign")
RECORDED = (
    "real control", "real foreign", "temperature", "ageing", "weak cell", "fault", "transport",
)  # fmt: skip
KINDS = SIMULATED + RECORDED
CONTROLS = ("control", "real control")  # there is nothing to be found
FOREIGN = ("foreign", "real foreign")  # and in these nothing that has a name
NO_NAME = ("none", "unknown")
"""Right of a recorded control: no twin is quite its cell, and that it is missed may be said."""
