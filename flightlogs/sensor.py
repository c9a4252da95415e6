"""`SensorLog`: what the separate current sensor recorded, on its own clock."""

from dataclasses import dataclass, fields
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from flightlogs import quality
from flightlogs.correlate import spikes
from flightlogs.errors import LogDamaged, LogError, LogWarning
from flightlogs.log import FloatArray, check_increasing, frozen_array
from flightlogs.sensor_table import RawTable, read_table

ABSURD_A = 1000.0
"""No pack that a multirotor carries gives more: such a value is a damaged number (3.4e38)."""
RAIL_A = 100.0
"""End of the module's range."""
RAIL_TOLERANCE_A = 1.0
GLITCH = 2.0
"""Times the largest current of all other samples: a single sample above is no peak of a flight."""
LEAST_FOR_GLITCHES = 100
COUNTER_S = (2**32 * 1e-6, 2**32 * 1e-3)
"""After which a counter of us, or of ms, in 32 bits begins again."""
JUMP_S = 3600.0
"""A longer pause is another session, or the clock being set."""
GAP_STEPS = 2.5
COPIED_SHARE = 0.9
"""Of the rows that repeat a stamp: if so many repeat the values too, rows were written twice."""
COARSE_SHARE = 0.5
"""Share of equal neighbouring stamps from which the stamps are coarser than the sampling."""

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorCounts:
    """How many rows of the file met which fate; each that is not zero has a warning of its own.

    Attributes:
        rows: data rows met, whole or not, repeated headers and comments not counted.
        kept: rows in the `SensorLog`.
        malformed: rows that could not be read as numbers (the truncated last one included).
        repeated_headers: header lines after the first.
        stray_stamps: rows whose stamp jumps away and back, dropped.
        duplicate_stamps: rows that repeat the stamp before them, or the whole row, dropped.
        resets: times the clock went back for good.
        rows_after_reset: rows of the pieces that were left out because of the resets.
        missing: kept rows without a current (NaN, empty).
        absurd: kept rows whose current no battery can give, now NaN.
        glitches: kept rows with a single value far beyond all others, now NaN.
        saturated: kept rows at a rail of the sensor, now NaN.
        wraps: times a counter of 32 bits began again, which was made good.
        gaps: places where the step is more than 2.5 times the usual one.
    """

    rows: int = 0
    kept: int = 0
    malformed: int = 0
    repeated_headers: int = 0
    stray_stamps: int = 0
    duplicate_stamps: int = 0
    resets: int = 0
    rows_after_reset: int = 0
    missing: int = 0
    absurd: int = 0
    glitches: int = 0
    saturated: int = 0
    wraps: int = 0
    gaps: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorLog:
    """The recording of a current sensor with a clock of its own.

    Attributes:
        name: file name, for messages.
        time_s: (n,) since the first kept sample, strictly increasing; gaps stay gaps.
        current_A: (n,) discharge positive; NaN where not measured, absurd or at a rail.
        voltage_V: (n,) at the sensor, NaN where not measured, or None.
        counts: how many rows met which fate.
        warnings: everything doubtful or repaired.
    """

    name: str
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray | None
    counts: SensorCounts
    warnings: tuple[LogWarning, ...] = ()

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, f.name, frozen_array(value))
                if value.shape != self.time_s.shape:
                    raise LogError(
                        f"{self.name}: {f.name} {value.shape}, {self.time_s.shape} times"
                    )
        check_increasing(self.time_s, self.name)


def read_sensor(stream: BinaryIO, *, name: str) -> SensorLog:
    """Read the CSV of a current sensor.

    Any header that names quantity and unit will do (time in s, ms, us or a date; current in A or
    mA), or none. After a reset of the sensor its clock starts anew at an unknown time: of the
    pieces only the longest is kept, nothing is joined by guess.

    Args:
        stream: bytes of the file.
        name: for messages.

    Raises:
        NotALog: no table with a time and a current.
        LogDamaged: a table, but without two samples on one clock, or without any current.
    """
    raw = read_table(stream.read(), name)
    once = ~copies(raw)
    counted_s, wraps = unwrapped(raw.time_s[once])
    time_s, coarse = spread_coarse(counted_s)
    good, stray, duplicate, resets, after_reset = keep_one_clock(time_s)
    t, i = time_s[good], raw.current_A[once][good]
    absurd, missing = np.abs(i) > ABSURD_A, ~np.isfinite(i)  # an infinite value is absurd
    absurd, missing = absurd | np.isinf(i), missing & ~np.isinf(i)
    i = np.where(absurd, np.nan, i)
    alone = glitches(i)
    i = np.where(alone, np.nan, i)
    at_rail = saturated(i)
    i = np.where(at_rail, np.nan, i)
    if len(t) < 2 or not np.any(np.isfinite(i)):
        raise LogDamaged(f"{name}: no two samples of current on one clock")
    low, high = np.nanpercentile(i, [5, 95])
    inverted = bool(-low > high)
    steps = np.diff(t)
    gaps = steps > GAP_STEPS * float(np.median(steps))
    counts = SensorCounts(
        rows=raw.rows,
        kept=len(t),
        malformed=raw.malformed,
        repeated_headers=raw.repeated_headers,
        stray_stamps=stray,
        duplicate_stamps=duplicate + int(np.sum(~once)),
        resets=resets,
        rows_after_reset=after_reset,
        missing=int(np.sum(missing)),
        absurd=int(np.sum(absurd)),
        glitches=int(np.sum(alone)),
        saturated=int(np.sum(at_rail)),
        wraps=wraps,
        gaps=int(np.sum(gaps)),
    )
    facts = (
        (raw.cut, "last_line_cut", "the file ends inside its last line, which is left out"),
        (coarse, "coarse_stamps", "stamps are coarser than the sampling: spread evenly"),
        (inverted, "current_sign_turned", "the file counts discharge negative: sign turned"),
        (counts.gaps, "sensor_gaps", f"{counts.gaps} gaps, {np.sum(steps[gaps]):.1f} s in all"),
    )
    said = tuple(LogWarning(c, f"{name}: {text}", "csv") for true, c, text in facts if true)
    return SensorLog(
        name=name,
        time_s=t - t[0],
        current_A=-i if inverted else i,
        voltage_V=None if raw.voltage_V is None else raw.voltage_V[once][good],
        counts=counts,
        warnings=(*raw.warnings, *said, *told(counts, name)),
    )


def copies(raw: RawTable) -> BoolArray:
    """(n,) rows that are the row before them once more; none where stamps are only coarse."""
    columns = [v for v in (raw.time_s, raw.current_A, raw.voltage_V) if v is not None]
    same = [(v[1:] == v[:-1]) | (np.isnan(v[1:]) & np.isnan(v[:-1])) for v in columns]
    whole = np.append(False, np.all(same, axis=0))
    many = np.sum(whole) >= COPIED_SHARE * np.sum(same[0])
    return np.asarray(whole & many)


def spread_coarse(time_s: FloatArray) -> tuple[FloatArray, bool]:
    """Stamps coarser than the sampling (dates to the second): spread evenly over their step."""
    if np.mean(np.diff(time_s) == 0) < COARSE_SHARE:
        return time_s, False
    start = np.append(0, np.flatnonzero(np.diff(time_s) != 0) + 1)
    length = np.diff(start, append=len(time_s))
    step = np.diff(time_s[start])
    step_s = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
    usual = float(np.percentile(length, 75))
    place = np.arange(len(time_s)) - np.repeat(start, length)
    share = place / np.maximum(np.repeat(length, length), usual)
    missed = max(usual - length[0], 0.0) / usual  # the first step was under way when it began
    share[: length[0]] += missed
    return time_s + share * step_s, True


def unwrapped(time_s: FloatArray) -> tuple[FloatArray, int]:
    """(n,) with the steps back of a counter of 32 bits made good, and how many there were."""
    step = np.diff(time_s)
    usual_s = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
    for whole_s in COUNTER_S:
        wraps = (step < 0) & (np.abs(step + whole_s - usual_s) <= GAP_STEPS * usual_s)
        if wraps.any():
            return time_s + whole_s * np.append(0, np.cumsum(wraps)), int(wraps.sum())
    return time_s, 0


def keep_one_clock(time_s: FloatArray) -> tuple[BoolArray, int, int, int, int]:
    """Rows (n,) of the longest piece in which time only grows, and what was left out.

    Returns:
        kept (n,), stray stamps, duplicate stamps, resets, rows of other pieces.
    """
    kept = np.ones(len(time_s), dtype=bool)
    before, now, after = time_s[:-2], time_s[1:-1], time_s[2:]
    away = (now < before) | (now > after)
    kept[1:-1] = ~(away & (after > before) & (after - before < JUMP_S))
    stray = int(np.sum(~kept))
    index = np.flatnonzero(kept)
    step = np.diff(time_s[index])
    cuts = np.flatnonzero((step < 0) | (step > JUMP_S)) + 1
    pieces = np.split(index, cuts)
    longest = max(pieces, key=lambda piece: float(time_s[piece[-1]] - time_s[piece[0]]))
    new = np.diff(time_s[longest], prepend=-np.inf) > 0
    kept[:] = False
    kept[longest[new]] = True
    return kept, stray, int(np.sum(~new)), len(cuts), len(index) - len(longest)


def glitches(current_A: FloatArray) -> BoolArray:
    """(n,) single samples GLITCH times as large as all that are not single, and not at the rail."""
    known, out = np.isfinite(current_A), np.zeros(current_A.size, dtype=bool)
    if np.sum(known) < LEAST_FOR_GLITCHES:
        return out
    own = current_A[known]
    single = spikes(own)
    at_rail = np.abs(np.abs(own) - RAIL_A) <= RAIL_TOLERANCE_A
    out[known] = single & ~at_rail & (np.abs(own) > GLITCH * np.max(np.abs(own[~single])))
    return out


def saturated(current_A: FloatArray) -> BoolArray:
    """(n,) samples at a rail: that of the module, or a plateau at the top."""
    size = np.abs(current_A)
    top = float(np.nanmax(size)) if np.any(np.isfinite(size)) else 0.0
    if abs(top - RAIL_A) <= RAIL_TOLERANCE_A:
        return np.asarray(size >= RAIL_A - RAIL_TOLERANCE_A)
    return quality.plateau(size)


def told(counts: SensorCounts, name: str) -> tuple[LogWarning, ...]:
    """A warning for each fate that rows met."""
    after = f"the longest piece is used, {counts.rows_after_reset} rows of the others are not"
    said = (
        ("rows_malformed", counts.malformed, "rows could not be read"),
        ("header_repeated", counts.repeated_headers, "further lines repeat the header"),
        ("stray_stamps", counts.stray_stamps, "stamps jump away and back: left out"),
        ("duplicate_stamps", counts.duplicate_stamps, "rows repeat a stamp: left out"),
        ("sensor_reset", counts.resets, f"times the clock starts anew: {after}"),
        ("current_missing", counts.missing, "rows have no current"),
        ("current_absurd", counts.absurd, f"currents beyond {ABSURD_A:.0f} A: unknown"),
        ("current_glitches", counts.glitches, "single currents far beyond all others: unknown"),
        ("clock_wrapped", counts.wraps, "times a counter of 32 bits began again: made good"),
        ("current_saturated", counts.saturated, "samples at the end of the range: unknown"),
    )
    return tuple(LogWarning(code, f"{name}: {n} {text}", "csv") for code, n, text in said if n)
