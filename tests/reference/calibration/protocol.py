"""The tests a cell is put to, and how a cycler samples them; times are multiples of 0.1 s."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from tests.reference.loads import ReferenceLoad, flight

FloatArray = npt.NDArray[np.float64]

TICK_S = 0.1  # of the cycler's clock
REST_S = 60.0  # before a discharge
RELAX_S = 600.0  # after a discharge, and before the first pulse of a level
LEVELS = (0.70, 0.50, 0.30, 0.15)  # of the nominal charge; higher up a 2C charge meets the cut-off
PULSES = (1.0, -1.0, 2.0, -2.0)  # C-rates, discharge positive, each for PULSE_S
PULSE_S, BETWEEN_S = 10.0, 40.0
FLIGHTS = {"lipo_2200": (6.5, 14.0), "lg_m50": (2.0, 4.0)}
"""Mean and peak C-rate: hard, but within what every cell drawn can deliver."""
FLIGHT_S = 330.0

Step = tuple[float, float, float]
"""C-rate, duration [s], period of the samples [s]."""


def discharge(capacity_Ah: float, *, rate: float, duration_s: float) -> ReferenceLoad:
    """From full to the cut-off, which comes after `duration_s`; rest before and after it.

    The last sample before the rest is TICK_S earlier.
    """
    period_s = 60.0 if rate < 0.5 else 1.0
    flowing = [(rate, duration_s - TICK_S, period_s), (rate, TICK_S, TICK_S)]
    return _load(capacity_Ah, [(0.0, REST_S, 10.0), *flowing, *_relaxing()])


def pulses(capacity_Ah: float) -> ReferenceLoad:
    """From full down the LEVELS at 1C; at each, after a rest, the PULSES with rests."""
    steps: list[Step] = [(0.0, REST_S, 10.0)]
    soc = 1.0
    for level in LEVELS:
        steps += [(1.0, round((soc - level) * 36000) / 10, 10.0), *_relaxing()]
        for rate in PULSES:
            steps += [(rate, PULSE_S, 0.1), (0.0, 10.0, 0.1), (0.0, BETWEEN_S - 10.0, 1.0)]
        soc = level
    return _load(capacity_Ah, steps)


def flying(cell_name: str, capacity_Ah: float, seed: int) -> ReferenceLoad:
    """330 s at 10 Hz from full: what the calibration is judged on."""
    mean, peak = FLIGHTS[cell_name]
    load = flight(capacity_Ah, mean=mean, peak=peak, duration_s=FLIGHT_S, seed=1000 + seed)
    return ReferenceLoad(time_s=load.time_s, current_A=_single(load.current_A), hold=False)


def _relaxing() -> list[Step]:
    return [(0.0, 30.0, 1.0), (0.0, RELAX_S - 30.0, 30.0)]


def _load(capacity_Ah: float, steps: Iterable[Step]) -> ReferenceLoad:
    """The current holds from sample to sample; the last sample ends the last step."""
    times, rates, start = [], [], 0
    for rate, duration_s, period_s in steps:
        times.append(np.arange(start, start + round(10 * duration_s), round(10 * period_s)))
        rates.append(np.full(times[-1].size, rate))
        start += round(10 * duration_s)
    time_s = np.append(np.concatenate(times), start) / 10
    rate_C = np.append(np.concatenate(rates), rates[-1][-1])
    return ReferenceLoad(time_s=time_s, current_A=_single(rate_C * capacity_Ah), hold=True)


def _single(values: FloatArray) -> FloatArray:
    """As they are after they were stored in single precision."""
    return values.astype(np.float32).astype(np.float64)
