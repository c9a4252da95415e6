"""The flights of the cases: what a pack gives at 10 Hz on a plan, and what the vehicle did."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from sample_logs.airframe import S500
from sample_logs.plan import Leg, hover, random_plan
from sample_logs.synthetic import SyntheticFlight, fly
from segment.segment import Motion

FloatArray = npt.NDArray[np.float64]

PERIOD_S = 0.1
CALM_S = 4.0  # of a flight in calm air: gusts and ripple are averaged over about so long
IDLE_S = 20.0  # on the ground before a mixed flight


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueFlight:
    """What the pack truly gave.

    Attributes:
        name: plan and seed.
        seed: of the flight.
        time_s: (n,) from 0, PERIOD_S apart.
        current_A: (n,) out of the pack, discharge positive, straight between the samples.
        motion: (n,) names of `Motion`.
        rest_s: of rest before it that tells how full the pack is; 0: a pack file states that.
    """

    name: str
    seed: int
    time_s: FloatArray
    current_A: FloatArray
    motion: npt.NDArray[np.str_]
    rest_s: float = 0.0


def _hovering(rng: np.random.Generator) -> tuple[Leg, ...]:
    """Hover with a short excursion now and then."""
    legs: list[Leg] = []
    while sum(leg.duration_s for leg in legs) < 300:
        heading, speed = rng.uniform(0, 2 * np.pi), rng.uniform(2.0, 6.0)
        legs += [
            hover(float(np.round(rng.uniform(20, 50), 1))),
            Leg(
                motion=Motion.HORIZONTAL, strokes=2, stroke_s=float(np.round(rng.uniform(3, 5), 1)),
                speed_m_s=float(speed), heading_rad=float(heading),
            ),
        ]  # fmt: skip
    return (*legs, hover(10.0))


def _vertical(rng: np.random.Generator) -> tuple[Leg, ...]:
    """Climbs and descents with little between them."""
    legs: list[Leg] = [hover(8.0)]
    while sum(leg.duration_s for leg in legs) < 300:
        stroke_s = float(np.round(rng.uniform(3.0, 6.0), 1))
        legs += [
            Leg(
                motion=Motion.VERTICAL, strokes=2 * int(rng.integers(2, 6)), stroke_s=stroke_s,
                speed_m_s=float(rng.uniform(0.5, 1.0)) * S500.climb_m_s,
            ),
            hover(float(np.round(rng.uniform(4, 12), 1))),
        ]  # fmt: skip
    return tuple(legs)


def _mixed(rng: np.random.Generator) -> tuple[Leg, ...]:
    """All motions in random order."""
    return random_plan(rng, S500, 300.0)


def _cruise(rng: np.random.Generator) -> tuple[Leg, ...]:
    """Squares and lines at speed."""
    legs: list[Leg] = [hover(8.0)]
    while sum(leg.duration_s for leg in legs) < 300:
        legs += [
            Leg(
                motion=Motion.HORIZONTAL, strokes=4 * int(rng.integers(1, 4)),
                stroke_s=float(np.round(rng.uniform(3.5, 7.0), 1)),
                speed_m_s=float(rng.uniform(0.5, 1.0)) * S500.cruise_m_s,
                heading_rad=float(rng.uniform(0, 2 * np.pi)),
                turn_rad=np.pi / 2 if rng.random() < 0.5 else np.pi,
            ),
            hover(float(np.round(rng.uniform(4, 10), 1))),
        ]  # fmt: skip
    return tuple(legs)


PLANS: Mapping[str, Callable[[np.random.Generator], tuple[Leg, ...]]] = {
    "hover": _hovering,
    "vertical": _vertical,
    "mixed": _mixed,
    "cruise": _cruise,
    "calm": _hovering,
}


def true_flight(plan: str, seed: int, *, full_C: float, drawn: tuple[float, float]) -> TrueFlight:
    """A flight of 5 to 6 minutes whose current is scaled to draw a share of the charge.

    Args:
        plan: a key of PLANS.
        seed: of plan, wind, ripple and end.
        full_C: what the pack holds.
        drawn: least and most of it that the flight takes.
    """
    rng = np.random.default_rng([zlib.crc32(plan.encode()), seed])
    flight = fly(S500, seed=seed, plan=PLANS[plan](rng))
    time_s, current_A, motion = _at_10_hz(flight)
    if plan == "mixed":
        idle = round(IDLE_S / PERIOD_S)
        current_A = np.concatenate([np.full(idle, current_A[0]), current_A])
        motion = np.concatenate([np.full(idle, motion[0]), motion])
        time_s = PERIOD_S * np.arange(current_A.size, dtype=float)
    unscaled_C = float(np.trapezoid(current_A, time_s))
    if plan == "calm":
        current_A = gaussian_filter1d(current_A, CALM_S / PERIOD_S, mode="nearest")
    current_A = current_A * rng.uniform(*drawn) * full_C / unscaled_C
    return TrueFlight(
        name=f"{plan}-{seed}", seed=seed, time_s=time_s, current_A=current_A, motion=motion
    )


def _at_10_hz(flight: SyntheticFlight) -> tuple[FloatArray, FloatArray, npt.NDArray[np.str_]]:
    """Means over each sample period, in its middle, and the motion there."""
    step_s = float(flight.time_s[1] - flight.time_s[0])
    each = round(PERIOD_S / step_s)
    whole = flight.time_s.size // each * each
    current_A = flight.current_A[:whole].reshape(-1, each).mean(axis=1)
    middle_s = flight.time_s[:whole].reshape(-1, each).mean(axis=1)
    starts = [span.start_s for span in flight.truth]
    names = np.array([span.motion.value for span in flight.truth])
    motion = names[np.searchsorted(starts, middle_s, side="right") - 1]
    return PERIOD_S * np.arange(current_A.size, dtype=float), current_A, motion
