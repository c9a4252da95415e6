"""What the instruments of a synthetic flight record: autopilot, sensor, a whole `FlightLog`."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flightlogs.log import BatteryLog, Channel, FlightLog, Interval, Vehicle
from sample_logs.synthetic import STEP_s, SyntheticFlight

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFlaws:
    """How the separate current sensor departs from the truth.

    Its clock relates to the autopilot's as in `flightlogs.recording.ClockFit`:
    t_autopilot = t_sensor * (1 + drift_ppm * 1e-6) + offset_s.

    Attributes:
        offset_s: autopilot time of the sensor's zero.
        drift_ppm: how much faster the autopilot's clock runs.
        period_s: between samples.
        noise_A: standard deviation.
        step_A: of the converter (+-100 A, 12 bits).
        gain: measured / true.
        bias_A: measured at zero current.
        missing: share of the samples that are not there.
    """

    offset_s: float = 0.0
    drift_ppm: float = 0.0
    period_s: float = 0.1
    noise_A: float = 0.08
    step_A: float = 200 / 4096
    gain: float = 1.0
    bias_A: float = 0.0
    missing: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorSamples:
    """On the sensor's own clock, from 0.

    Attributes:
        time_s: (n,) strictly increasing.
        current_A: (n,).
    """

    time_s: FloatArray
    current_A: FloatArray


def sensor(flight: SyntheticFlight, flaws: SensorFlaws, *, seed: int) -> SensorSamples:
    """Samples of the current sensor while both it and the flight's log run.

    Where the sensor runs before the log starts or after it ends the current is that of the nearest
    end (idle electronics).
    """
    rng = np.random.default_rng(seed)
    end_s = flight.time_s[-1] - min(flaws.offset_s, 0.0) + 1.0
    t = np.arange(0.0, max(end_s - max(flaws.offset_s, 0.0), 1.0), flaws.period_s)
    t = t[rng.random(t.size) >= flaws.missing]
    at = t * (1 + flaws.drift_ppm * 1e-6) + flaws.offset_s
    true_A = np.interp(at, flight.time_s, flight.current_A)
    measured = flaws.gain * true_A + flaws.bias_A + flaws.noise_A * rng.standard_normal(t.size)
    return SensorSamples(time_s=t, current_A=np.round(measured / flaws.step_A) * flaws.step_A)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotFlaws:
    """How the autopilot's record departs from the truth.

    Attributes:
        battery_period_s: between battery samples (PX4 logs 5 Hz).
        jitter_s: standard deviation of their stamps' spacing.
        average_s: the current is a mean over this time before the stamp.
        noise_A: standard deviation.
        step_A: resolution.
        gain: measured / true current.
        bias_A: measured at zero current.
        motion_period_s: between velocities.
        velocity_noise_m_s: standard deviation.
        landing_delay_s: the landed flag comes this late after touch-down.
    """

    battery_period_s: float = 0.2
    jitter_s: float = 0.004
    average_s: float = 0.02
    noise_A: float = 0.12
    step_A: float = 0.01
    gain: float = 1.0
    bias_A: float = 0.0
    motion_period_s: float = 0.1
    velocity_noise_m_s: float = 0.04
    landing_delay_s: float = 0.8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AutopilotSamples:
    """As logged, at the logged rates.

    Attributes:
        battery_time_s: (n,).
        current_A: (n,).
        motion_time_s: (m,) of all that follows.
        velocity_m_s: (m, 3).
        velocity_setpoint_m_s: (m, 3).
        position_m: (m, 3).
        position_setpoint_m: (m, 3).
        thrust: (m,).
        sticks: (m, 4).
        armed: spans.
        in_air: spans.
    """

    battery_time_s: FloatArray
    current_A: FloatArray
    motion_time_s: FloatArray
    velocity_m_s: FloatArray
    velocity_setpoint_m_s: FloatArray
    position_m: FloatArray
    position_setpoint_m: FloatArray
    thrust: FloatArray
    sticks: FloatArray
    armed: tuple[Interval, ...]
    in_air: tuple[Interval, ...]


def _spans(flight: SyntheticFlight, mask: npt.NDArray[np.bool_]) -> tuple[Interval, ...]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return tuple(
        Interval(float(flight.time_s[a]), float(flight.time_s[b - 1]) + STEP_s)
        for a, b in zip(edges[::2], edges[1::2], strict=True)
    )


def autopilot(flight: SyntheticFlight, flaws: AutopilotFlaws, *, seed: int) -> AutopilotSamples:
    """What the autopilot writes to its log."""
    rng = np.random.default_rng(seed)
    n = int(flight.time_s[-1] / flaws.battery_period_s)
    steps = flaws.battery_period_s + np.clip(flaws.jitter_s * rng.standard_normal(n), -0.04, 0.04)
    t = np.cumsum(steps)
    t = t[t < flight.time_s[-1]]
    width = max(1, round(flaws.average_s / STEP_s))
    mean_A = np.convolve(flight.current_A, np.full(width, 1 / width))[: flight.time_s.size]
    true_A = np.interp(t, flight.time_s, mean_A)
    measured = flaws.gain * true_A + flaws.bias_A + flaws.noise_A * rng.standard_normal(t.size)
    every = round(flaws.motion_period_s / STEP_s)
    pick = slice(None, None, every)
    noise = flaws.velocity_noise_m_s * rng.standard_normal(flight.velocity_m_s[pick].shape)
    late = tuple(
        Interval(s.start_s, s.stop_s + flaws.landing_delay_s) for s in _spans(flight, flight.in_air)
    )
    return AutopilotSamples(
        battery_time_s=t,
        current_A=np.round(measured / flaws.step_A) * flaws.step_A,
        motion_time_s=flight.time_s[pick],
        velocity_m_s=flight.velocity_m_s[pick] + noise,
        velocity_setpoint_m_s=flight.velocity_setpoint_m_s[pick],
        position_m=flight.position_m[pick],
        position_setpoint_m=flight.position_setpoint_m[pick],
        thrust=flight.thrust[pick],
        sticks=flight.sticks[pick],
        armed=_spans(flight, flight.armed),
        in_air=late,
    )


def to_flight_log(
    flight: SyntheticFlight, *, seed: int, flaws: AutopilotFlaws | None = None
) -> FlightLog:
    """The flight as a reader would give it, without a file in between.

    The voltage is a straight line through the pack's EMF and resistance.

    Args:
        flight: what was flown.
        seed: of the measurement noise.
        flaws: of the autopilot's instruments, default AutopilotFlaws().
    """
    seen = autopilot(flight, flaws or AutopilotFlaws(), seed=seed)
    charge_C = np.cumsum(flight.current_A) * STEP_s
    emf_V = flight.airframe.series * (4.15 - 0.45 * charge_C / flight.airframe.capacity_C)
    voltage_V = emf_V - flight.airframe.resistance_ohm * flight.current_A
    battery = BatteryLog(
        instance=0,
        label="synthetic battery",
        time_s=seen.battery_time_s,
        current_A=seen.current_A,
        voltage_V=np.interp(seen.battery_time_s, flight.time_s, voltage_V),
        charge_C=np.interp(seen.battery_time_s, flight.time_s, charge_C),
        series=flight.airframe.series,
        capacity_C=flight.airframe.capacity_C,
        current_source="synthetic.current",
    )

    def channel(values: FloatArray, name: str) -> Channel:
        return Channel(time_s=seen.motion_time_s, values=values, source=f"synthetic.{name}")

    return FlightLog(
        name=f"{flight.airframe.name}-{flight.seed}",
        format="ulog",
        firmware="synthetic",
        hardware="",
        vehicle=Vehicle.MULTIROTOR,
        vehicle_label="synthetic",
        simulated=False,
        start_utc=None,
        duration_s=float(flight.time_s[-1]),
        batteries=(battery,),
        velocity_m_s=channel(seen.velocity_m_s, "velocity"),
        velocity_setpoint_m_s=channel(seen.velocity_setpoint_m_s, "velocity_setpoint"),
        position_setpoint_m=channel(seen.position_setpoint_m, "position_setpoint"),
        sticks=channel(seen.sticks, "sticks"),
        thrust=channel(seen.thrust, "thrust"),
        altitude_m=channel(-seen.position_m[:, 2], "altitude"),
        modes=flight.modes,
        armed=seen.armed,
        in_air=seen.in_air,
    )
