"""What is recorded of a case, at times poorly, and what is not."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from proof.simulated import record as usual
from proof.simulated.flown import Flown

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

STEPS_V = (0.010, 0.025)  # least and most of a quantised voltage
GAPS = 3
GAP_S = (4.0, 15.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording(usual.Recording):
    """One flight as it was recorded.

    Attributes:
        motion: (n,) names of `segment.segment.Motion`.
    """

    motion: npt.NDArray[np.str_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Concealed(usual.Concealed):
    """What nobody recorded, at the times of the recording.

    Attributes:
        current_A: (n,) truly drawn through the sensor.
        clean_V: (n,) what the voltage recorder would have shown without noise and rounding.
    """

    current_A: FloatArray
    clean_V: FloatArray


def _all(time_s: FloatArray, rng: np.random.Generator) -> BoolArray:
    del rng
    return np.ones(time_s.size, dtype=bool)


def _gaps(time_s: FloatArray, rng: np.random.Generator) -> BoolArray:
    kept = np.ones(time_s.size, dtype=bool)
    for start in rng.uniform(20.0, time_s[-1] - 20.0, size=GAPS):
        kept &= ~((time_s > start) & (time_s < start + rng.uniform(*GAP_S)))
    return kept


def _every_tenth(time_s: FloatArray, rng: np.random.Generator) -> BoolArray:
    del rng
    return np.asarray(np.arange(time_s.size) % 10 == 0)


KEPT: Mapping[str, Callable[[FloatArray, np.random.Generator], BoolArray]] = {
    "plain": _all,
    "gaps": _gaps,
    "1hz": _every_tenth,
    "quantised": _all,
    "saturated": _all,
}
"""Variants of a recording: which samples are kept. `quantised` rounds the voltage, `saturated`
cuts the current off at three quarters of its highest."""


def record(flown: Flown, variant: str, rng: np.random.Generator) -> tuple[Recording, Concealed]:
    """With noise; every random number from `rng`."""
    seen, hidden = usual.record(flown, rng)
    voltage_V, current_A = seen.voltage_V, seen.current_A
    kept = KEPT[variant](seen.time_s, rng)
    if variant == "quantised":
        step_V = rng.uniform(*STEPS_V)
        voltage_V = np.round(voltage_V / step_V) * step_V
    if variant == "saturated":
        current_A = np.minimum(current_A, 0.75 * flown.recorded.current_A.max())
    recording = Recording(
        time_s=seen.time_s[kept] - seen.time_s[kept][0],
        current_A=current_A[kept],
        voltage_V=voltage_V[kept],
        motion=flown.flight.motion[kept],
    )
    concealed = Concealed(
        temperature_K=hidden.temperature_K[kept],
        cells_V=hidden.cells_V[:, kept],
        current_A=flown.flight.current_A[kept],
        clean_V=flown.recorded.voltage_V[kept],
    )
    return recording, concealed
