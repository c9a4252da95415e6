"""Can the numbers be true: scale of the current, charge counter, velocity. Plain arrays in."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from flightlogs.errors import LogWarning
from flightlogs.log import Channel, FloatArray, Interval
from flightlogs.resample import bridged_s, charge_C, resample, within

BoolArray = npt.NDArray[np.bool_]

DRIFT_S = 30.0  # what is slower than this belongs to the state of charge, not to the resistance
HUBER = 1.345  # 95 % efficiency for normal noise; Huber, Robust Statistics (1981)
HUBER_ROUNDS = 50
MAD_SD = 1.4826  # standard deviation of normal noise / its median absolute deviation
LEAST_SAMPLES = 30
LEAST_CORRELATION = 0.3  # below it the voltage does not follow the current and no slope is meant
HIGH_CELL_OHM = (
    0.017  # between real packs in order (3.5 to 15 mOhm a cell) and doubtful ones (19 on)
)
HIGH_CELL_OHM_AH = 0.040  # resistance falls as capacity grows; a worn 2.2 Ah cell has 18 mOhm
LOW_CELL_OHM = 0.0005  # contacts alone have more
HEALTHY_CELL_OHM = (0.0035, 0.015)
AH_C = 3600.0
COULOMB_TOLERANCE = 0.05  # counters of autopilots that miss samples stay within 2 %
LEAST_CHARGE_C = 20.0  # a counter in whole mAh is then good to 1 in 5
FASTEST_M_S = 50.0  # beyond any multirotor that carries a flight log of these autopilots
CLIMB_WINDOW_S = 5.0
CLIMB_ERROR_M = 5.0  # 1 m/s over the window: no barometer in propeller wash is that wrong for long
CLIMB_ERROR_SHARE = (
    0.1  # of the time; a crash at the end reaches half of it, a diverging filter 3 times
)
PLATEAU = 3  # equal samples in turn at the top
STRONG = 10  # steps of strong currents elsewhere, to tell whether they stand still
AFTER_S = 5.0  # for so long a voltage answers to what a sensor at its end did not show
STANDS_STILL = 0.2  # of the steps of strong currents: then equal samples are no plateau
STEADY = 0.98  # of the largest: half of the strong currents above, and it was set, not cut off


@dataclass(frozen=True, slots=True)
class Slope:
    """How the voltage follows the current.

    Attributes:
        ohm: fall of the voltage per ampere.
        correlation: of voltage and current after the drift is removed.
    """

    ohm: float
    correlation: float


def resistance(time_s: FloatArray, current_A: FloatArray, voltage_V: FloatArray) -> Slope | None:
    """Slope of voltage on current, drift removed, outliers bounded (Huber's M-estimate).

    Args:
        time_s: (n,).
        current_A: (n,), NaN where unknown.
        voltage_V: (n,), NaN where unknown.

    Returns:
        None where the voltage does not follow the current or hardly anything was measured.
    """
    known = np.isfinite(current_A) & np.isfinite(voltage_V)
    if known.sum() < LEAST_SAMPLES:
        return None
    t = time_s[known]
    x, y = _without_drift(t, current_A[known]), _without_drift(t, voltage_V[known])
    if not (x.std() > 0 and y.std() > 0):
        return None
    correlation = float(np.corrcoef(x, y)[0, 1])
    if correlation > -LEAST_CORRELATION:
        return None
    slope = float(x @ y / (x @ x))
    for _ in range(HUBER_ROUNDS):
        rest = y - slope * x
        scale = max(MAD_SD * float(np.median(np.abs(rest))), 1e-12)
        weight = np.minimum(1.0, HUBER * scale / np.maximum(np.abs(rest), 1e-12))
        slope = float((weight * x) @ y / ((weight * x) @ x))
    return Slope(-slope, correlation)


def _without_drift(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """(n,) values minus their average within DRIFT_S around each sample."""
    low = np.searchsorted(time_s, time_s - DRIFT_S / 2, side="left")
    high = np.searchsorted(time_s, time_s + DRIFT_S / 2, side="right")
    level: FloatArray = values - values.mean()
    total = np.concatenate([[0.0], np.cumsum(level)])
    drift = (total[high] - total[low]) / (high - low)
    return np.asarray(level - drift)


def scale_warning(
    slope: Slope | None, series: int, capacity_C: float | None, where: str
) -> LogWarning | None:
    """Whether a pack can have this resistance; a current that is too small makes it too large."""
    if slope is None:
        return None
    cell_ohm = slope.ohm / series
    limit = max(HIGH_CELL_OHM, HIGH_CELL_OHM_AH * AH_C / capacity_C if capacity_C else 0.0)
    if LOW_CELL_OHM <= cell_ohm <= limit:
        return None
    low, high = (1e3 * ohm for ohm in HEALTHY_CELL_OHM)
    factor = (cell_ohm / HEALTHY_CELL_OHM[1], cell_ohm / HEALTHY_CELL_OHM[0])
    guess = "small" if cell_ohm > limit else "large"
    ratio = factor if cell_ohm > limit else (1 / factor[1], 1 / factor[0])
    return LogWarning(
        "current_scale_doubtful",
        f"the voltage falls by {1e3 * slope.ohm:.1f} mOhm ({1e3 * cell_ohm:.1f} a cell); packs in "
        f"order show {low:g} to {high:g} a cell. If this pack is one, the current is logged "
        f"{ratio[0]:.1f} to {ratio[1]:.1f} times too {guess}: check the current sensor's scale "
        "(BATn_A_PER_V, BATT_AMP_PERVLT). A worn or very small pack looks the same",
        where,
    )


def coulomb_check(
    time_s: FloatArray, current_A: FloatArray, counter_C: FloatArray | None
) -> float | None:
    """Integral of the current / difference of the log's counter; None if the counter is no use.

    Where the counter falls (it was reset), that step is left out of both.
    """
    if counter_C is None:
        return None
    known = np.isfinite(counter_C) & np.isfinite(current_A)
    t, current, counter = time_s[known], current_A[known], counter_C[known]
    steps = np.diff(counter)
    risen = steps >= 0
    counted = float(steps[risen].sum())
    if counted < LEAST_CHARGE_C:
        return None
    reset_C = [charge_C(t[i : i + 2], current[i : i + 2]) for i in np.flatnonzero(~risen)]
    return (charge_C(t, current) - float(sum(reset_C))) / counted


def coulomb_warning(ratio: float | None, where: str) -> LogWarning | None:
    """Where current and counter disagree by more than the counter's own inaccuracy."""
    if ratio is None or abs(ratio - 1) <= COULOMB_TOLERANCE:
        return None
    return LogWarning(
        "coulomb_mismatch",
        f"the integral of the current is {ratio:.3f} of what the log's own counter gained: samples "
        "are missing, or the two come from different sensors",
        where,
    )


def sign_warning(time_s: FloatArray, current_A: FloatArray, where: str) -> LogWarning | None:
    """Where a flight has charged its pack on balance, which no multirotor does."""
    drawn_C = charge_C(time_s, current_A)
    if drawn_C > 0:
        return None
    return LogWarning(
        "current_sign_doubtful",
        f"the pack gave {drawn_C / AH_C:.3f} Ah in flight on balance: the current sensor is "
        "reversed, or its zero is far off. The current was used as it is",
        where,
    )


def plateau(size_A: FloatArray) -> BoolArray:
    """(n,) which sizes (n,) are equal and the largest: a sensor came to the end of its range.

    They count only where strong currents elsewhere neither stand still nor are nearly as large (a
    bench that draws one current); NaN is unknown.
    """
    none = np.zeros(size_A.size, dtype=bool)
    top = float(np.nanmax(size_A)) if np.any(np.isfinite(size_A)) else 0.0
    if top <= 0:
        return none
    at_top = size_A >= top * (1 - 1e-6)
    inside = np.concatenate([[False], at_top, [False]]).astype(int)
    starts, stops = np.flatnonzero(np.diff(inside) == 1), np.flatnonzero(np.diff(inside) == -1)
    if np.max(stops - starts) < PLATEAU:
        return none
    strong = (size_A[:-1] > 0.5 * top) & ~at_top[:-1]
    still = np.mean(np.diff(size_A)[strong] == 0) if strong.sum() >= STRONG else 1.0
    return none if still > STANDS_STILL or np.median(size_A[:-1][strong]) > STEADY * top else at_top


def unsaturated(time_s: FloatArray, current_A: FloatArray) -> BoolArray:
    """(n,) where a sensor shows all of the current, and has for so long that a voltage does too.

    After a `plateau` a pack answers for AFTER_S to what was not seen.
    """
    ends_s = time_s[plateau(current_A)]
    before = np.searchsorted(ends_s, time_s, side="right") - 1
    since_s = time_s - ends_s[before] if ends_s.size else np.full(time_s.size, np.inf)
    return np.asarray((before < 0) | (since_s > AFTER_S))


def saturation_warning(current_A: FloatArray, where: str) -> LogWarning | None:
    """Where currents (n,), discharge positive, stand at the largest: see `plateau`."""
    count = int(np.count_nonzero(plateau(current_A)))
    if not count:
        return None
    return LogWarning(
        "current_saturated",
        f"{count} samples stand at {np.nanmax(current_A):.1f} A, the most that the current sensor "
        "shows: more may have flowed there, and neither charge nor damage counts it; "
        f"`twin` does not judge the voltage there, nor for {AFTER_S:g} s after",
        where,
    )


def velocity_warning(
    velocity: Channel, altitude: Channel | None, in_air: tuple[Interval, ...]
) -> LogWarning | None:
    """Whether a vehicle can have moved so: top speed, climb rate against altitude."""
    flying = within(velocity.time_s, in_air)
    speed = np.linalg.norm(np.nan_to_num(velocity.values[flying]), axis=1)
    fastest = float(np.max(speed, initial=0.0))
    if fastest > FASTEST_M_S:
        said = f"it reaches {fastest:.0f} m/s, and no multirotor exceeds {FASTEST_M_S:g}"
    else:
        share = _climb_error_share(velocity, altitude, in_air)
        if share <= CLIMB_ERROR_SHARE:
            return None
        said = (
            f"in {share:.0%} of the flight the climb rate, integrated over {CLIMB_WINDOW_S:g} s, "
            f"misses the altitude by more than {CLIMB_ERROR_M:g} m: the estimator diverged"
        )
    return LogWarning("velocity_impossible", f"velocity not used: {said}", velocity.source)


def _climb_error_share(
    velocity: Channel, altitude: Channel | None, in_air: tuple[Interval, ...]
) -> float:
    """Share of the windows in flight in which climb rate and altitude contradict each other."""
    known = np.isfinite(velocity.values[:, 2])
    if altitude is None or known.sum() < LEAST_SAMPLES:
        return 0.0
    t, up = velocity.time_s[known], -velocity.values[known, 2]
    height = resample(altitude.time_s, altitude.values, t)
    risen = np.concatenate([[0.0], np.cumsum(np.diff(t) * (up[1:] + up[:-1]) / 2)])
    start = np.flatnonzero(within(t, in_air) & (t + CLIMB_WINDOW_S <= t[-1]))
    stop = np.searchsorted(t, t[start] + CLIMB_WINDOW_S)
    whole = t[stop] - t[start] < CLIMB_WINDOW_S + bridged_s(t)
    error = (height[stop] - height[start]) - (risen[stop] - risen[start])
    error = error[whole & np.isfinite(error)]
    return float(np.mean(np.abs(error) > CLIMB_ERROR_M)) if error.size else 0.0
