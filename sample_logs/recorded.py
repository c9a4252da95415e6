"""A synthetic flight as a `Recording`, without log or assembly in between."""

from collections.abc import Collection

import numpy as np
import numpy.typing as npt

from flightlogs.log import Channel, Interval
from flightlogs.recording import Recording
from sample_logs.instruments import AutopilotFlaws, autopilot
from sample_logs.synthetic import SyntheticFlight

FloatArray = npt.NDArray[np.float64]


def _columns(at_s: FloatArray, time_s: FloatArray, values: FloatArray) -> FloatArray:
    return np.column_stack([np.interp(at_s, time_s, column) for column in values.T])


def to_recording(
    flight: SyntheticFlight,
    *,
    seed: int,
    logged: Collection[str] = ("setpoint",),
    flaws: AutopilotFlaws | None = None,
) -> Recording:
    """The autopilot's record on the times of its battery samples.

    Args:
        flight: what was flown.
        seed: of the measurement noise.
        logged: which of `setpoint`, `position` (setpoint), `sticks` the log holds beside the
            measured velocity.
        flaws: of the instruments, default AutopilotFlaws().
    """
    seen = autopilot(flight, flaws or AutopilotFlaws(), seed=seed)
    t = seen.battery_time_s
    in_air = np.zeros(t.size, dtype=bool)
    for span in seen.in_air:
        in_air |= (t >= span.start_s) & (t < span.stop_s)

    def at(values: FloatArray) -> FloatArray:
        return _columns(t, seen.motion_time_s, values)

    return Recording(
        name=f"{flight.airframe.name}-{flight.seed}",
        battery="synthetic",
        other_batteries=(),
        time_s=t,
        current_A=seen.current_A,
        current_source="autopilot",
        voltage_V=np.full(t.size, np.nan),
        temperature_K=None,
        cell_voltage_V=None,
        velocity_m_s=at(seen.velocity_m_s),
        velocity_setpoint_m_s=at(seen.velocity_setpoint_m_s) if "setpoint" in logged else None,
        setpoint_source="synthetic" if "setpoint" in logged else "",
        position_setpoint_m=at(seen.position_setpoint_m) if "position" in logged else None,
        in_air=in_air,
        flight=Interval(float(t[0]), float(t[-1])),
        modes=flight.modes,
        sticks=Channel(time_s=seen.motion_time_s, values=seen.sticks, source="synthetic.sticks")
        if "sticks" in logged
        else None,
        series=flight.airframe.series,
        series_inferred=False,
        capacity_C=flight.airframe.capacity_C,
    )
