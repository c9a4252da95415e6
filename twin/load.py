"""`Load`: what is drawn from a cell or pack, over time."""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

MAX_STEP_S = 1.0  # longer samples are cut: salt diffusion is first order in time


class LoadError(ValueError):
    """The load cannot be simulated as given; the text says where and what to do."""


class Between(Enum):
    """How the current runs between samples."""

    HOLD = "hold"  # programmed steps: sample k holds until sample k + 1
    LINEAR = "linear"  # instantaneous samples of a sensor: straight from k to k + 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Load:
    """A current over time, discharge positive; LoadError if it cannot be simulated.

    Attributes:
        time_s: (n,) strictly increasing, n >= 1; a single sample asks for the voltage at once.
        current_A: (n,) at the terminals of whatever it is applied to (cell or pack).
        between: how the current runs between the samples.
        ambient_K: temperature of the surroundings.
        longest_step_s: samples that lie further apart are cut into steps no longer than this.
    """

    time_s: FloatArray
    current_A: FloatArray
    between: Between = Between.LINEAR
    ambient_K: float = 298.15
    longest_step_s: float = MAX_STEP_S

    def __post_init__(self) -> None:
        for name in ("time_s", "current_A"):
            values = np.array(getattr(self, name), dtype=float)
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.time_s.ndim != 1 or not self.time_s.size:
            raise LoadError(
                f"a load needs a sample or more, one after the other: {self.time_s.shape}"
            )
        if self.current_A.shape != self.time_s.shape:
            raise LoadError(f"{self.current_A.shape} currents for {self.time_s.shape} times")
        for name in ("time_s", "current_A"):
            bad = np.flatnonzero(~np.isfinite(getattr(self, name)))
            if bad.size:
                raise LoadError(f"{name}[{bad[0]}] is not finite ({bad.size} such samples)")
        _expect("ambient_K", self.ambient_K, 200.0, 400.0)
        _expect("longest_step_s", self.longest_step_s, np.finfo(float).tiny, np.inf)
        if (stuck := np.flatnonzero(np.diff(self.time_s) <= 0)).size:
            raise LoadError(
                f"time_s[{stuck[0] + 1}] does not exceed the one before ({stuck.size} such steps)"
            )

    def refined(self, longest_s: float | FloatArray) -> "Load":
        """The same current over the same time, with samples added where they lie further apart.

        `longest_s` is one for all intervals, or (n - 1,).
        """
        dt = np.diff(self.time_s)
        parts = np.maximum(np.ceil(dt / longest_s - 1e-9), 1).astype(int)
        first = np.repeat(np.cumsum(parts) - parts, parts)
        share = (np.arange(first.size) - first) / np.repeat(parts, parts)
        held = self.between is Between.HOLD
        rise = np.zeros(dt.size) if held else np.diff(self.current_A)

        def spread(values: FloatArray, slope: FloatArray) -> FloatArray:
            inner = np.repeat(values[:-1], parts) + share * np.repeat(slope, parts)
            return np.append(inner, values[-1])

        return replace(self, time_s=spread(self.time_s, dt), current_A=spread(self.current_A, rise))

    def drawn_C(self) -> FloatArray:
        """(n,) integral of the current up to each sample [C]."""
        dt, i = np.diff(self.time_s), self.current_A
        mean = i[:-1] if self.between is Between.HOLD else (i[:-1] + i[1:]) / 2
        return np.concatenate([[0.0], np.cumsum(dt * mean)])

    def charge_C(self) -> float:
        """Integral of the current over the whole load, exact for its `between` [C]."""
        dt = np.diff(self.time_s)
        if self.between is Between.HOLD:
            return float(np.dot(dt, self.current_A[:-1]))
        return float(np.dot(dt, self.current_A[:-1] + self.current_A[1:]) / 2)


def _expect(name: str, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        raise LoadError(f"{name} = {value}: expected {least:.3g} to {most:.3g}")
