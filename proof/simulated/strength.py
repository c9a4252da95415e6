"""How large an effect must be for the twin to miss the voltage by so much."""

from collections.abc import Callable
from math import exp, isfinite, log

import numpy as np

from proof.question import Recording
from proof.simulated.configured import Configured
from proof.simulated.effects import Effect
from proof.simulated.faults import Traces
from proof.simulated.flights import TrueFlight
from proof.simulated.flown import Flown, fly
from proof.simulated.instruments import Instruments
from proof.simulated.pack_truth import PackTruth
from proof.simulated.rest import read
from proof.simulated.solves import OutOfReachError, Solves
from twin.at_rest import open_circuit_V
from twin.builtin import load_cell

CLOSE = 0.1  # in the logarithm of the difference
TRIALS = 8
LONGEST = log(8.0)  # step
BEYOND_V = 1e-3  # of a cell: off its reference temperature it rests beside its curve


def missed_V(told: Configured, flown: Flown, before: float = 0.0) -> float:
    """Rms of recorded minus the twin's voltage under the recorded current, without noise.

    From when the share `before` of the charge was drawn: until then what flowed is known. Its start
    is as the judge reads it, where the flight's rest tells it; OutOfReachError if that is none, or
    none that a charger leaves.
    """
    seen = flown.recorded
    if flown.flight.rest_s:
        check_charged(told, flown)
        told = known_start(told, seen)
    begin = int(np.searchsorted(seen.drawn, before))
    current_A = seen.current_A.copy()
    current_A[:begin] = flown.flight.current_A[:begin]
    if begin > 1:
        drawn_C = float(np.trapezoid(current_A[:begin], seen.time_s[:begin]))
        current_A[:begin] *= seen.drawn[begin - 1] * told.full_C / drawn_C
    left_V = seen.voltage_V - told.voltage_V(seen.time_s, current_A)
    return float(np.sqrt(np.mean(left_V[begin:] ** 2)))


def check_charged(told: Configured, flown: Flown) -> None:
    """OutOfReachError where the pack, whatever its sensor shows, rests above a full one."""
    full_V = open_circuit_V(load_cell(told.cell), 1.0)
    rests_V = float(flown.cells_V[:, 0].sum()) / told.series
    if rests_V > full_V + BEYOND_V:
        raise OutOfReachError(
            f"it rests at {rests_V:.3f} V a cell: a charger stops at {full_V:.3f}"
        )


def known_start(told: Configured, recorded: Traces | Recording) -> Configured:
    """The start as the judge reads it from a rest; OutOfReachError if it takes that for none.

    What is off may hide in it: a sensor that reads high shows a fuller pack.
    """
    known = read(told, recorded.time_s, recorded.current_A, recorded.voltage_V)
    if known is None:
        raise OutOfReachError(f"a rest at {recorded.current_A[0]:.2f} A is taken for none")
    return known


def answer_V(told: Configured, flight: TrueFlight, by: Instruments) -> float:
    """Rms of what the twin answers otherwise to a current as it was recorded than as it flowed."""
    time_s, true_A = flight.time_s, flight.current_A
    noise_A = by.noise_A * np.random.default_rng(flight.seed).standard_normal(time_s.size)
    kept = slice(None, None, by.every)
    recorded_V = told.voltage_V(time_s[kept], (true_A + noise_A)[kept])
    return float(np.sqrt(np.nanmean((recorded_V - told.voltage_V(time_s, true_A)[kept]) ** 2)))


def size_for(  # noqa: PLR0913
    effect: Effect,
    flavour: int,
    told: Configured,
    flight: TrueFlight,
    target_V: float,
    solves: Solves,
    *,
    close: float = CLOSE,
) -> float:
    """Size of `effect` at which the twin misses this flight by `target_V`, within `close`.

    OutOfReachError if no physical size does.
    """

    def missed(size: float) -> float:
        try:
            return missed_V(
                told, fly(effect.make(PackTruth.of(told), size, flavour), flight, solves)
            )
        except OutOfReachError:
            return float("inf")

    size = found(missed, target_V, effect.guess, (effect.least, effect.most), close=close)
    if size is None:
        raise OutOfReachError(
            f"{effect.id}: no size from {effect.least} to {effect.most} ({effect.meaning}) gives "
            f"{1e3 * target_V:.0f} mV on {flight.name}"
        )
    return size


def found(
    f: Callable[[float], float], target: float, guess: float, bounds: tuple[float, float],
    *, close: float = CLOSE,
) -> float | None:  # fmt: skip
    """Where the growing function f is within `close` of `target`: secants in logarithms.

    f is about a power law; infinite where a size is too large to be tried. None if not reached.
    """
    least, most = (log(b) for b in bounds)
    seen: list[tuple[float, float]] = []  # log size, log f, that are finite
    x = min(max(log(guess), least), most)
    for _ in range(TRIALS):
        value = f(exp(x))
        if isfinite(value):
            y = log(max(value, 1e-9) / target)
            if abs(y) < close:
                return exp(x)
            seen.append((x, y))
            if (y < 0 and x == most) or (y > 0 and x == least):
                return None
            x = min(max(_next(seen), least), most)
        else:
            most = x
            x = (x + (seen[-1][0] if seen else least)) / 2
    return None


def _next(seen: list[tuple[float, float]]) -> float:
    """Secant through the last two, at least as steep as a square root, as a cube at most."""
    (x, y), slope = seen[-1], 1.0
    if len(seen) > 1 and seen[-2][0] != x:
        slope = float(np.clip((y - seen[-2][1]) / (x - seen[-2][0]), 0.25, 3.0))
    return x - float(np.clip(y / slope, -LONGEST, LONGEST))
