"""The sensor's clock mapped to the autopilot's by what both saw: the current."""

from dataclasses import dataclass, replace

import numpy as np

from flightlogs.correlate import (
    STEP_S,
    lively,
    masked_mean,
    overlap_correlation,
    peaks,
    regrid,
    significance,
    spikes,
)
from flightlogs.errors import LogError, LogWarning
from flightlogs.evidence import Evidence, judge
from flightlogs.log import FlightLog, FloatArray, check_increasing, frozen_array
from flightlogs.polish import Polished, polish
from flightlogs.recording import ClockFit
from flightlogs.reference import BATTERY_CURRENT, MIN_SAMPLES, THRUST, Reference, candidates
from flightlogs.refine import ClockMap, Pair, refine
from flightlogs.sensor import SensorLog

MIN_COMMON_S = 30.0
"""Shorter recordings hold too few manoeuvres to tell one lag from another."""
TREND_S, LIMIT = 10.0, 6.0
CANDIDATES = 4
APART_S = 0.5
"""Lags closer than this are one and the same."""
SMOOTHING_S = 0.2
SECOND_BEST = 1.5
"""Another lag may not leave less than this times the residual of the best one."""
MOST_UNEXPLAINED = {BATTERY_CURRENT: 0.2, THRUST: 0.4}
LEAST_CORRELATION = 0.9
MOST_SURPRISE = 0.38
"""At steps of 0.1, 0.2 and 0.5 s 31, 30 and 28 of 32 right pairs each are below, and of the seven
beyond five have a wrong drift; of 96 with a flight of the same plan all are beyond, from 0.41, 0.41
and 0.46 (seeds 50000 to 50011 and 51000 to 51019 of benchmarks/alignment.py)."""
CHANCE = 4.0
"""Redness may exceed 1 by this / sqrt(stretches): white noise has a standard deviation of 0.6 of
that unit, and of these 96 right pairs two exceed 2.1 of it."""
LEAST_LIVELINESS = 0.03
LARGEST_DRIFT = 500e-6
"""Of two quartz or ceramic clocks over the temperatures of a flight."""
USABLE_S = 0.02
"""Standard deviation of a time anywhere in the flight: 50 ms is 2.5 times that."""
GOOD_DRIFT = 20e-6 / 2.576
"""Standard deviation with which the drift is within 20 ppm in 99 of 100 flights."""
THRUST_BAND_S = 1.0
"""Slower than this, current depends on climb and airspeed too, which follow thrust late."""
THRUST_UNEXPLAINED = 0.2
"""Of the variance within the band, at most."""
MOTOR_LAG_S = 0.05
"""Commanded thrust leads the current by about this; how much is not known."""
THRUST_DRIFT = 100e-6
"""Standard deviation of a drift by thrust: the lag depends on what is flown. Three synthetic
flights were wrong by up to 60 ppm."""


class AlignmentRefused(LogError):
    """The evidence does not fix the sensor's clock; `code` names the reason.

    Codes: `too_short` (too few common samples), `no_overlap` (no lag at which the recordings can
    meet), `no_reference` (the log has neither a usable current nor thrust), `steady` (nothing
    happens that could fix a lag), `ambiguous` (two lags fit nearly equally well), `wrong_flight`
    (no lag at which the recordings agree as two records of one flight do), `uncertain` (the
    standard deviation of the clock is larger than usable).
    """

    def __init__(self, code: str, message: str) -> None:
        self.code = code
        super().__init__(message)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AlignedSensor:
    """The sensor's recording on the autopilot's clock.

    Attributes:
        time_s: (n,) on the clock of the flight log, strictly increasing.
        current_A: (n,) as in `SensorLog`: discharge positive, NaN where not measured.
        voltage_V: (n,) as in `SensorLog`: at the sensor, NaN where not measured, or None.
        fit: the map of the clocks and how well it is known.
        battery: instance of the battery whose current it follows; None if thrust fixed the clock.
        warnings: everything doubtful in the alignment.
    """

    time_s: FloatArray
    current_A: FloatArray
    fit: ClockFit
    voltage_V: FloatArray | None = None
    battery: int | None = None
    warnings: tuple[LogWarning, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_s", frozen_array(self.time_s))
        object.__setattr__(self, "current_A", frozen_array(self.current_A))
        if self.voltage_V is not None:
            object.__setattr__(self, "voltage_V", frozen_array(self.voltage_V))
        check_increasing(self.time_s, "aligned sensor")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rough:
    """A lag that may be the right one."""

    reference: Reference
    pair: Pair
    clock: ClockMap
    score: float
    unexplained: float


def _long_enough(time_s: FloatArray) -> bool:
    return len(time_s) >= MIN_SAMPLES and float(time_s[-1] - time_s[0]) >= MIN_COMMON_S


def align(sensor: SensorLog, log: FlightLog, *, battery: int | None = None) -> AlignedSensor:
    """Map the sensor's clock to that of the flight log: t_log = t_sensor (1 + drift) + offset.

    The sensor's current is held against the current of the autopilot's battery, or against thrust
    where the log has no current that moves. Only what changes counts, so a wrong scale or zero of
    either does no harm. A low-pass filter in the autopilot is not told from the clock: up to a time
    constant of about 0.05 s its delay becomes part of the offset, a slower one is refused
    (`wrong_flight`).

    Args:
        sensor: recording of the current sensor.
        log: flight log of the same flight.
        battery: instance of the battery the sensor sits at; None takes the one whose current
            fits best.

    Raises:
        AlignmentRefused: the evidence does not fix the clock; its `code` names the reason.
    """
    references = candidates(log, battery)
    if not references:
        raise AlignmentRefused(
            "no_reference",
            f"{log.name}: neither a battery current that moves nor thrust to hold "
            f"{sensor.name} against",
        )
    known = np.isfinite(sensor.current_A)
    if np.sum(known) >= MIN_SAMPLES:
        known[known] = ~spikes(sensor.current_A[known])
    t, x = sensor.time_s[known], sensor.current_A[known]
    references = tuple(r for r in references if _long_enough(r.time_s))
    if not references or not _long_enough(t):
        raise AlignmentRefused(
            "too_short",
            f"{sensor.name}, {log.name}: less than {MIN_COMMON_S:.0f} s of current on one side",
        )
    found = [rough for r in references for rough in search(t, x, r)]
    if not found:
        raise AlignmentRefused(
            "no_overlap",
            f"{sensor.name}, {log.name}: at no lag do {MIN_COMMON_S:.0f} s of both meet and agree",
        )
    best = choose(found, sensor.name, log.name)
    return finish(sensor, log, best)


def search(t: FloatArray, x: FloatArray, reference: Reference) -> list[Rough]:
    """The most significant lags of one reference, each refined to some milliseconds."""
    grids = [regrid(t, x), regrid(reference.time_s, reference.values)]
    a, b = (lively(g, trend_s=TREND_S, limit=LIMIT, step_s=STEP_S) for g in grids)
    lags, r, n = overlap_correlation(a, b, round(MIN_COMMON_S / STEP_S))
    z = significance(r, n)
    out: list[Rough] = []
    for lag in peaks(lags, z, apart=round(2 * APART_S / STEP_S), count=CANDIDATES):
        clock = ClockMap(float(lag * STEP_S + reference.time_s[0] - t[0]), 0.0)
        at = clock.to_sensor(reference.time_s)
        common = (at >= t[0]) & (at <= t[-1])
        if np.sum(common) < MIN_SAMPLES:
            continue
        pair = Pair(
            sensor_s=t,
            sensor=x,
            reference_s=reference.time_s[common],
            reference=reference.values[common],
        )
        if reference.method == THRUST:
            pair = replace(pair, reference=as_current(pair, clock))
        clock, unexplained = refine(pair, clock, width_s=width(pair))
        score = float(z[lags == lag][0])
        out.append(
            Rough(reference=reference, pair=pair, clock=clock, score=score, unexplained=unexplained)
        )
    return out


def width(pair: Pair) -> float:
    """Of the smoothing: SMOOTHING_S, or a sampling step of the slower instrument."""
    steps = [float(np.median(np.diff(t))) for t in (pair.sensor_s, pair.reference_s)]
    return max(SMOOTHING_S, *steps)


def as_current(pair: Pair, clock: ClockMap) -> FloatArray:
    """(m,) cubic in thrust that comes closest to the current: power grows faster than thrust."""
    current = np.interp(clock.to_sensor(pair.reference_s), pair.sensor_s, pair.sensor)
    v = pair.reference / max(float(np.max(np.abs(pair.reference))), 1e-12)
    powers = np.column_stack([v**k for k in range(4)])
    return np.asarray(powers @ np.linalg.lstsq(powers, current, rcond=None)[0])


def choose(found: list[Rough], sensor: str, log: str) -> Rough:
    """The lag that fits best; refused if a distant one fits nearly as well.

    Among several batteries the most significant one counts: the others are not rivals, a second
    battery of the same vehicle may well see the same manoeuvres.
    """
    top = max(found, key=lambda rough: rough.score).reference
    mine = sorted((r for r in found if r.reference is top), key=lambda r: r.unexplained)
    best = mine[0]
    if best.unexplained > MOST_UNEXPLAINED[top.method]:
        raise AlignmentRefused(
            "wrong_flight",
            f"{sensor} does not follow {top.source} of {log} at any lag: "
            f"{100 * best.unexplained:.0f} % of its variance is left at the best one",
        )
    middle = best.clock.to_reference(np.array([best.pair.sensor_s.mean()]))
    for other in mine[1:]:
        there = other.clock.to_reference(np.array([best.pair.sensor_s.mean()]))
        far = abs(float(there[0] - middle[0])) > APART_S
        if far and other.unexplained < SECOND_BEST * best.unexplained:
            raise AlignmentRefused(
                "ambiguous",
                f"{sensor} follows {top.source} of {log} nearly equally well at offsets "
                f"{best.clock.offset_s:.1f} s and {other.clock.offset_s:.1f} s",
            )
    return best


def finish(sensor: SensorLog, log: FlightLog, rough: Rough) -> AlignedSensor:
    """The last milliseconds, the evidence and the refusals that rest on them."""
    names = f"{sensor.name}, {log.name} ({rough.reference.source})"
    if rough.reference.method == THRUST:
        return finish_by_thrust(sensor, rough, names)
    polished = polish(rough.pair, rough.clock)
    c = polished.comparison
    spacing = float(np.median(np.diff(polished.reference_s)))
    evidence = judge(c.expected, c.residual, spacing, beside(rough.pair, polished))
    if evidence is None:
        raise AlignmentRefused("too_short", f"{names}: less than 20 s of flight in common")
    if evidence.liveliness < LEAST_LIVELINESS:
        raise AlignmentRefused(
            "steady",
            f"{names}: in flight the current stays within {100 * evidence.liveliness:.1f} % of its "
            "mean, as in any hover: nothing tells this flight from another",
        )
    check_flight(evidence, polished, names)
    end_std = float(np.hypot(polished.middle_std_s, polished.drift_std * rough.pair.half_s))
    if not end_std < USABLE_S:
        raise AlignmentRefused(
            "uncertain",
            f"{names}: the clock is known to {1e3 * end_std:.0f} ms only, {1e3 * USABLE_S:.0f} ms "
            "is usable",
        )
    fit = ClockFit(
        method=BATTERY_CURRENT,
        offset_s=polished.clock.offset_s,
        drift_ppm=1e6 * polished.clock.drift,
        correlation=evidence.correlation,
        uncertainty_s=polished.middle_std_s,
        drift_uncertainty_ppm=1e6 * polished.drift_std,
        gain=c.gain,
        bias_A=c.bias,
    )
    return AlignedSensor(
        time_s=polished.clock.to_reference(sensor.time_s),
        current_A=sensor.current_A,
        voltage_V=sensor.voltage_V,
        fit=fit,
        battery=rough.reference.battery,
        warnings=doubts(fit, sensor.name, rough.reference.source),
    )


def beside(pair: Pair, polished: Polished) -> tuple[FloatArray, FloatArray]:
    """Stamps and current of the sensor from the first to the last stamp of the reference."""
    first, last = polished.clock.to_sensor(polished.reference_s[[0, -1]])
    inside = (pair.sensor_s >= first) & (pair.sensor_s <= last)
    return pair.sensor_s[inside], pair.sensor[inside]


def finish_by_thrust(sensor: SensorLog, rough: Rough, names: str) -> AlignedSensor:
    """Thrust and current compared within THRUST_BAND_S alone, where one is nearly the other."""
    pair = rough.pair
    fast = []
    for t, v in ((pair.sensor_s, pair.sensor), (pair.reference_s, pair.reference)):
        samples = max(3, round(THRUST_BAND_S / float(np.median(np.diff(t)))))
        fast.append(v - masked_mean(v, samples))
    liveliness = float(np.std(fast[0]) / max(float(np.mean(pair.sensor)), 1e-12))
    if liveliness < LEAST_LIVELINESS:
        raise AlignmentRefused(
            "steady", f"{names}: within {THRUST_BAND_S} s the current varies {liveliness:.3f} of it"
        )
    banded = replace(pair, sensor=fast[0], reference=fast[1])
    clock, unexplained = refine(banded, rough.clock, width_s=width(pair))
    if unexplained > THRUST_UNEXPLAINED or abs(clock.drift) > LARGEST_DRIFT:
        raise AlignmentRefused(
            "wrong_flight",
            f"{names}: the current does not follow thrust: {100 * unexplained:.0f} % of what is "
            f"faster than {THRUST_BAND_S} s is left, drift {1e6 * clock.drift:.0f} ppm",
        )
    fit = ClockFit(
        method=THRUST,
        offset_s=clock.offset_s,
        drift_ppm=1e6 * clock.drift,
        correlation=float(np.sqrt(1.0 - unexplained)),
        uncertainty_s=MOTOR_LAG_S,
        drift_uncertainty_ppm=1e6 * THRUST_DRIFT,
        gain=None,
        bias_A=None,
    )
    return AlignedSensor(
        time_s=clock.to_reference(sensor.time_s),
        current_A=sensor.current_A,
        voltage_V=sensor.voltage_V,
        fit=fit,
        battery=rough.reference.battery,
        warnings=doubts(fit, sensor.name, rough.reference.source),
    )


def check_flight(evidence: Evidence, polished: Polished, names: str) -> None:
    """AlignmentRefused("wrong_flight") unless these look like two records of one flight."""
    reasons = []
    if not polished.converged:
        reasons.append("the fit of the clock does not settle")
    if abs(polished.clock.drift) > LARGEST_DRIFT:
        reasons.append(
            f"the clocks would drift by {1e6 * polished.clock.drift:.0f} ppm, "
            f"{1e6 * LARGEST_DRIFT:.0f} is the most that is credible"
        )
    if not polished.comparison.gain > 0:
        reasons.append("the currents have opposite signs")
    if evidence.correlation < LEAST_CORRELATION:
        reasons.append(
            f"their correlation is {evidence.correlation:.2f}, two records of one flight "
            f"reach {LEAST_CORRELATION:.2f}"
        )
    if evidence.redness > 1.0 + CHANCE / np.sqrt(evidence.stretches):
        reasons.append(
            f"they differ slowly, {evidence.redness:.1f} times what the noise of two instruments "
            "gives, as flights of one plan in different gusts do"
        )
    if not evidence.surprise <= MOST_SURPRISE:
        reasons.append(
            "the sensor foretells the autopilot's samples hardly better than their own neighbours "
            f"do (residual power {evidence.surprise:.2f} of theirs, at most {MOST_SURPRISE})"
        )
    if reasons:
        raise AlignmentRefused("wrong_flight", f"{names}: " + "; ".join(reasons))


def doubts(fit: ClockFit, sensor: str, source: str) -> tuple[LogWarning, ...]:
    """What a reader of the alignment should know."""
    out = []
    if 1e-6 * fit.drift_uncertainty_ppm > GOOD_DRIFT:
        out.append(
            LogWarning(
                "drift_uncertain",
                f"{sensor}: drift {fit.drift_ppm:.0f} ppm is known to "
                f"{fit.drift_uncertainty_ppm:.0f} ppm only; do not extrapolate beyond this flight",
                source,
            )
        )
    if fit.method == THRUST:
        out.append(
            LogWarning(
                "aligned_by_thrust",
                f"{sensor}: the log has no usable current, so thrust fixed the clock; the current "
                f"follows thrust by a lag that is not known to better than {MOTOR_LAG_S} s",
                source,
            )
        )
    return tuple(out)
