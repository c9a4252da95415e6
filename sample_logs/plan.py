"""What a synthetic flight is told to do: legs, and the commanded trajectory they make.

Every stroke of a leg starts and ends at rest, so a leg's commanded motion begins and ends exactly
where the leg does: that is the truth a detector is judged by.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sample_logs.airframe import Airframe
from segment.segment import Motion

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A stretch of one commanded motion.

    Attributes:
        motion: HOVER, VERTICAL, HORIZONTAL or MIXED.
        strokes: how often it goes from rest to rest (a hover has one).
        stroke_s: duration of each.
        speed_m_s: greatest commanded horizontal (HORIZONTAL, MIXED) or vertical speed.
        climb_m_s: greatest commanded vertical speed of a MIXED leg.
        heading_rad: of the first horizontal stroke.
        turn_rad: change of heading from stroke to stroke (pi: to and fro; pi / 2: squares).
        altitude_mode: flown in altitude mode: no horizontal velocity is commanded to the autopilot.
    """

    motion: Motion
    strokes: int
    stroke_s: float
    speed_m_s: float = 0.0
    climb_m_s: float = 0.0
    heading_rad: float = 0.0
    turn_rad: float = np.pi
    altitude_mode: bool = False

    @property
    def duration_s(self) -> float:
        """Of all strokes."""
        return self.strokes * self.stroke_s


def _stroke(n: int, dt_s: float, speed_m_s: float, acceleration_m_s2: float) -> FloatArray:
    """(n,) commanded speed of one stroke: a trapezoid with rounded corners, zero at both ends."""
    t = (np.arange(n) + 0.5) * dt_s
    ramp = acceleration_m_s2 * np.minimum(t, n * dt_s - t)
    speed = np.clip(ramp, 0, speed_m_s)
    round_n = max(1, min(round(0.3 / dt_s), n // 6))
    speed[:round_n] *= np.sin(np.linspace(0, np.pi / 2, round_n)) ** 2
    speed[n - round_n :] *= np.cos(np.linspace(0, np.pi / 2, round_n)) ** 2
    return np.asarray(speed)


def leg_velocity(leg: Leg, dt_s: float, acceleration_m_s2: float) -> FloatArray:
    """(n, 3) commanded north, east, down of one leg."""
    n = round(leg.stroke_s / dt_s)
    out = np.zeros((leg.strokes, n, 3))
    for k in range(leg.strokes):
        heading = leg.heading_rad + k * leg.turn_rad
        up = 1.0 if k % 2 == 0 else -1.0
        if leg.motion in (Motion.HORIZONTAL, Motion.MIXED):
            speed = _stroke(n, dt_s, leg.speed_m_s, acceleration_m_s2)
            out[k, :, 0], out[k, :, 1] = speed * np.cos(heading), speed * np.sin(heading)
        if leg.motion is Motion.VERTICAL:
            out[k, :, 2] = -up * _stroke(n, dt_s, leg.speed_m_s, acceleration_m_s2)
        if leg.motion is Motion.MIXED:
            out[k, :, 2] = -up * _stroke(n, dt_s, leg.climb_m_s, acceleration_m_s2)
    return out.reshape(-1, 3)


def hover(duration_s: float, *, altitude_mode: bool = False) -> Leg:
    """A hover leg."""
    return Leg(motion=Motion.HOVER, strokes=1, stroke_s=duration_s, altitude_mode=altitude_mode)


def steady_hover(duration_s: float) -> tuple[Leg, ...]:
    """A flight that does nothing but hover."""
    return (hover(duration_s),)


def random_plan(
    rng: np.random.Generator, airframe: Airframe, duration_s: float, *, altitude_mode: bool = False
) -> tuple[Leg, ...]:
    """Legs of hover, vertical, horizontal and mixed motion in random order, `duration_s` in all.

    Each of the four occurs while there is time; hover stands at both ends. In `altitude_mode` the
    whole flight is flown so.
    """
    legs = [hover(float(rng.uniform(8, 20)), altitude_mode=altitude_mode)]
    left_s = duration_s - legs[0].duration_s - 8
    queue: list[Motion] = []
    while left_s > 12:
        if not queue:
            queue = [Motion.VERTICAL, Motion.HORIZONTAL, Motion.HOVER, Motion.MIXED]
            queue = [queue[i] for i in rng.permutation(4)]
        leg = _random_leg(queue.pop(), rng, airframe, left_s, altitude_mode=altitude_mode)
        legs.append(leg)
        left_s -= leg.duration_s
    legs.append(hover(8 + max(left_s, 0.0), altitude_mode=altitude_mode))
    return tuple(legs)


def _random_leg(
    motion: Motion,
    rng: np.random.Generator,
    airframe: Airframe,
    longest_s: float,
    *,
    altitude_mode: bool,
) -> Leg:
    if motion is Motion.HOVER:
        return hover(min(float(rng.uniform(6, 30)), longest_s), altitude_mode=altitude_mode)
    stroke_s = float(np.round(rng.uniform(3.0, 6.0), 1))
    square = bool(rng.random() < 0.5) and motion is Motion.HORIZONTAL
    group = 4 if square else 2
    groups = min(int(rng.integers(1, 5)), max(int(longest_s / (group * stroke_s)), 1))
    vertical = motion is Motion.VERTICAL
    fastest = airframe.climb_m_s if vertical else airframe.cruise_m_s
    share = 0.7 if motion is Motion.MIXED else 1.0
    return Leg(
        motion=motion,
        strokes=group * groups,
        stroke_s=stroke_s,
        speed_m_s=float(rng.uniform(0.35, share)) * fastest,
        climb_m_s=float(rng.uniform(0.35, 0.7)) * airframe.climb_m_s,
        heading_rad=float(rng.uniform(0, 2 * np.pi)),
        turn_rad=np.pi / 2 if square else np.pi,
        altitude_mode=altitude_mode,
    )
