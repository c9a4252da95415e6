"""What lies between the cells and the recording: resistances outside them, and instruments."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

LIMITER_A = 20.0
DRIFT_S = 75.0  # period of the drifting voltage sensor
ADC_V = 0.45  # period of the nonlinear converter
CONTACT_S = 3.0  # how long a loose contact stays as it is, on average


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Traces:
    """A pack's flight on its way to the recorder.

    Attributes:
        time_s: (n,) samples.
        current_A: (n,) of the pack, then as the sensor shows it.
        voltage_V: (n,) at the cells, then as the sensor shows it.
        drawn: (n,) share of the pack's charge given so far.
        seed: of what is random in a fault.
    """

    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    drawn: FloatArray
    seed: int


def current_gain(t: Traces, size: float) -> Traces:
    """Recorded = (1 + size) true."""
    return replace(t, current_A=(1 + size) * t.current_A)


def current_offset(t: Traces, size: float) -> Traces:
    """Recorded = true + size [A]."""
    return replace(t, current_A=t.current_A + size)


def sensor_lag(t: Traces, size: float) -> Traces:
    """The current sensor is a first-order lag of `size` seconds, exact for straight pieces."""
    i, dt = t.current_A, np.diff(t.time_s)
    out = np.empty_like(i)
    out[0] = i[0]
    for k, step in enumerate(dt):
        slope, keep = (i[k + 1] - i[k]) / step, np.exp(-step / size)
        out[k + 1] = keep * (out[k] - i[k] + slope * size) + i[k + 1] - slope * size
    return replace(t, current_A=out)


def clock_shift(t: Traces, size: float) -> Traces:
    """The current is stamped `size` seconds late."""
    return replace(t, current_A=np.interp(t.time_s - size, t.time_s, t.current_A))


def voltage_gain(t: Traces, size: float) -> Traces:
    """Recorded = (1 + size) true."""
    return replace(t, voltage_V=(1 + size) * t.voltage_V)


def _resistor(t: Traces, ohm: FloatArray) -> Traces:
    return replace(t, voltage_V=t.voltage_V - ohm * t.current_A)


def loose_connector(t: Traces, size: float) -> Traces:
    """A contact of `size` ohm that comes and goes at random."""
    rng = np.random.default_rng([t.seed, 77])
    flips = rng.random(t.time_s.size) < np.gradient(t.time_s) / CONTACT_S
    return _resistor(t, size * np.asarray(np.cumsum(flips) % 2, dtype=float))


def resistance_of_charge(t: Traces, size: float) -> Traces:
    """A contact whose resistance is `size` ohm after 35 % of the charge, none before and after."""
    return _resistor(t, size * np.exp(-(((t.drawn - 0.35) / 0.05) ** 2)))


def current_limiter(t: Traces, size: float) -> Traces:
    """A protection circuit that resists what exceeds LIMITER_A with `size` ohm."""
    over = np.maximum(t.current_A - LIMITER_A, 0.0)
    return replace(t, voltage_V=t.voltage_V - size * over)


def voltage_drift(t: Traces, size: float) -> Traces:
    """The voltage sensor's zero swings by `size` volts, slowly."""
    return replace(t, voltage_V=t.voltage_V + size * np.sin(2 * np.pi * t.time_s / DRIFT_S))


def adc_nonlinearity(t: Traces, size: float) -> Traces:
    """The voltage converter errs by up to `size` volts, depending on the voltage."""
    return replace(t, voltage_V=t.voltage_V + size * np.sin(2 * np.pi * t.voltage_V / ADC_V))


FAULTS: Mapping[str, Callable[[Traces, float], Traces]] = {
    f.__name__: f
    for f in (
        current_gain, current_offset, sensor_lag, clock_shift, voltage_gain, loose_connector,
        resistance_of_charge, current_limiter, voltage_drift, adc_nonlinearity,
    )
}  # fmt: skip
