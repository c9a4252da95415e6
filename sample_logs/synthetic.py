"""Synthetic quadrotor flights that come with their true answer.

    flight = fly(S500, seed=7)              about 300 s, a random plan
    flight.truth                            what was commanded when
    autopilot(flight, seed=1), sensor(flight, seed=1), to_flight_log(flight)   in instruments.py

The dynamics are simple but honest: see dynamics.py (motion) and power.py (current).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flightlogs.log import ModeSpan
from sample_logs.airframe import Airframe
from sample_logs.dynamics import Motion3D, disturb, simulate
from sample_logs.plan import Leg, leg_velocity, random_plan
from sample_logs.power import battery_current_A, electrical_power_W, ripple
from segment.segment import Motion

FloatArray = npt.NDArray[np.float64]

STEP_s = 0.02
SPOOL_s = 1.2
LANDING_m_s = 0.8
AFTER_TOUCHDOWN_s = 6.0
DISARM_s = 1.5
ARMED_BEFORE_s = 2.0


@dataclass(frozen=True, slots=True)
class Truth:
    """A stretch of one commanded motion, half-open [start_s, stop_s)."""

    motion: Motion
    start_s: float
    stop_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SyntheticFlight:
    """A flight without instruments, every STEP_s.

    Attributes:
        airframe: what flew.
        seed: of every random number in it.
        time_s: (n,) from 0 on the autopilot's clock.
        current_A: (n,) discharge positive.
        position_m: (n, 3) north, east, down from the start.
        velocity_m_s: (n, 3).
        velocity_setpoint_m_s: (n, 3) NaN where not controlled (on the ground; the
            horizontal ones in altitude mode).
        position_setpoint_m: (n, 3), NaN likewise.
        thrust: (n,) share of the greatest, 0..1.
        sticks: (n, 4) roll, pitch, yaw in -1..1, throttle in 0..1, as a pilot would fly the plan.
        armed: (n,) bool.
        in_air: (n,) bool, off the ground.
        modes: names as in PX4.
        truth: ordered, adjoining, from the first sample to past the last.
    """

    airframe: Airframe
    seed: int
    time_s: FloatArray
    current_A: FloatArray
    position_m: FloatArray
    velocity_m_s: FloatArray
    velocity_setpoint_m_s: FloatArray
    position_setpoint_m: FloatArray
    thrust: FloatArray
    sticks: FloatArray
    armed: npt.NDArray[np.bool_]
    in_air: npt.NDArray[np.bool_]
    modes: tuple[ModeSpan, ...]
    truth: tuple[Truth, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Schedule:
    """The plan on the clock: when what is commanded, and the commanded velocity (n, 3)."""

    spool_s: float
    climb_s: float
    legs: tuple[tuple[Leg, float, float], ...]
    landing_s: float
    velocity_m_s: FloatArray
    altitude_mode: npt.NDArray[np.bool_]


def _vertical(n: int, speed_m_s: float) -> FloatArray:
    out = np.zeros((n, 3))
    out[:, 2] = speed_m_s * np.minimum(1.0, np.arange(n) * STEP_s / 0.5)
    return out


def _schedule(airframe: Airframe, legs: tuple[Leg, ...], rng: np.random.Generator) -> _Schedule:
    spool_s = float(np.round(rng.uniform(4, 9), 1))
    climb_s = spool_s + SPOOL_s
    height_m, speed = rng.uniform(4, 10), rng.uniform(1.0, 1.6)
    rise = _vertical(round(height_m / speed / STEP_s), -speed)
    rise[-25:] *= np.linspace(1, 0, 25)[:, None]
    parts, spans = [np.zeros((round(climb_s / STEP_s), 3)), rise], []
    altitude = [np.zeros(len(p), dtype=bool) for p in parts]
    now = STEP_s * sum(len(p) for p in parts)
    for leg in legs:
        parts.append(leg_velocity(leg, STEP_s, airframe.acceleration_m_s2))
        altitude.append(np.full(len(parts[-1]), leg.altitude_mode))
        spans.append((leg, now, now + len(parts[-1]) * STEP_s))
        now = spans[-1][2]
    down_s = height_m / LANDING_m_s + AFTER_TOUCHDOWN_s
    parts.append(_vertical(round(down_s / STEP_s), LANDING_m_s))
    altitude.append(np.zeros(len(parts[-1]), dtype=bool))
    return _Schedule(
        spool_s=spool_s,
        climb_s=climb_s,
        legs=tuple(spans),
        landing_s=now,
        velocity_m_s=np.concatenate(parts),
        altitude_mode=np.concatenate(altitude),
    )


def _truth(
    schedule: _Schedule, lift_off_s: float, touch_s: float, end_s: float
) -> tuple[Truth, ...]:
    first = schedule.legs[0][1]
    spans = [(Motion.GROUND, 0.0, lift_off_s), (Motion.TAKEOFF, lift_off_s, first)]
    spans += [(leg.motion, start, stop) for leg, start, stop in schedule.legs]
    spans += [(Motion.LANDING, schedule.landing_s, touch_s), (Motion.GROUND, touch_s, end_s)]
    merged = [spans[0]]
    for motion, start, stop in spans[1:]:
        if motion is merged[-1][0]:
            merged[-1] = (motion, merged[-1][1], stop)
        else:
            merged.append((motion, start, stop))
    return tuple(Truth(*span) for span in merged)


def _modes(schedule: _Schedule, end_s: float) -> tuple[ModeSpan, ...]:
    first, landing = schedule.legs[0][1], schedule.landing_s
    name = "ALTCTL" if schedule.legs[0][0].altitude_mode else "POSCTL"
    return (
        ModeSpan(0.0, first, "AUTO_TAKEOFF"),
        ModeSpan(first, landing, name),
        ModeSpan(landing, end_s, "AUTO_LAND"),
    )


def _sticks(airframe: Airframe, reference_m_s: FloatArray, manual: FloatArray) -> FloatArray:
    north, east, down = np.asarray(reference_m_s * manual[:, None]).T
    roll, pitch = east / airframe.cruise_m_s, north / airframe.cruise_m_s
    throttle = 0.5 - 0.5 * down / airframe.climb_m_s
    return np.asarray(np.clip(np.column_stack([roll, pitch, 0 * roll, throttle]), -1, 1))


def _airborne(off_ground: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """From the first lift-off to the last touch-down: a bounce is not a landing."""
    up = np.flatnonzero(off_ground)
    out = np.zeros_like(off_ground)
    out[up[0] : up[-1] + 1] = True
    return out


def _current(
    airframe: Airframe,
    moved: Motion3D,
    thrust_N: FloatArray,
    armed: npt.NDArray[np.bool_],
    rng: np.random.Generator,
) -> FloatArray:
    power = electrical_power_W(airframe, thrust_N, moved.axial_m_s, moved.in_plane_m_s)
    motors = (power - airframe.avionics_W) * (1 + ripple(rng, len(power), STEP_s))
    power = airframe.avionics_W + np.where(armed, motors, 0.0)
    return battery_current_A(airframe, power, STEP_s)


def fly(
    airframe: Airframe,
    *,
    seed: int,
    duration_s: float = 300.0,
    plan: tuple[Leg, ...] | None = None,
    altitude_mode: bool = False,
) -> SyntheticFlight:
    """Fly a plan (default: a random one that makes the flight about `duration_s` long).

    Equal arguments give equal arrays; different seeds give different wind, noise and, without a
    `plan`, different plans. `altitude_mode` flies the random plan in altitude mode.
    """
    rng = np.random.default_rng(seed)
    if plan is None:
        plan = random_plan(rng, airframe, duration_s - 30, altitude_mode=altitude_mode)
    schedule = _schedule(airframe, plan, rng)
    reference = schedule.velocity_m_s
    n = len(reference)
    t = np.asarray(np.arange(n) * STEP_s, dtype=np.float64)
    air = disturb(rng, n, STEP_s)
    release = np.clip((t - schedule.spool_s) / SPOOL_s, 0.05, 1.0)
    moved = simulate(airframe, reference, release, air, STEP_s)
    in_air = _airborne(moved.in_air)
    lift_off_s, touch_s = (float(t[k]) for k in np.flatnonzero(np.diff(in_air)) + 1)
    armed = (t >= schedule.spool_s - ARMED_BEFORE_s) & (t < touch_s + DISARM_s)
    thrust_N = moved.thrust_N * np.exp(-np.maximum(t - touch_s, 0) / 0.3) * armed
    position = np.cumsum(reference, axis=0) * STEP_s
    manual = (t >= schedule.legs[0][1]) & (t < schedule.landing_s)
    controlled = np.repeat((armed & (t >= schedule.spool_s) & (t < touch_s))[:, None], 3, axis=1)
    controlled[:, :2] &= ~schedule.altitude_mode[:, None]
    end_s = float(t[-1] + STEP_s)
    return SyntheticFlight(
        airframe=airframe,
        seed=seed,
        time_s=t,
        current_A=_current(airframe, moved, thrust_N, armed, rng),
        position_m=moved.position_m,
        velocity_m_s=moved.velocity_m_s,
        velocity_setpoint_m_s=np.where(controlled, moved.setpoint_m_s, np.nan),
        position_setpoint_m=np.where(controlled, position, np.nan),
        thrust=thrust_N / (airframe.thrust_to_weight * airframe.weight_N),
        sticks=_sticks(airframe, reference, manual.astype(float)),
        armed=armed,
        in_air=in_air,
        modes=_modes(schedule, end_s),
        truth=_truth(schedule, lift_off_s, touch_s, end_s),
    )
