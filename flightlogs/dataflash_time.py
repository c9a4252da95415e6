"""The time of each row of a DataFlash log, also where the log does not say."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from flightlogs.log import FloatArray
from flightlogs.measured import MAH_C
from flightlogs.stamps import FileClock, file_clock
from flightlogs.table import RawLog, Table

# label -> unit [s]; TimeMS is the time since boot only where it leads the record: in GPS of 3.x
# it is the time of the week, and `T` is the time since boot
CLOCK_LABELS = {"TimeUS": 1e-6, "TimeMS": 1e-3}
GPS_BOOT, GPS_WEEK_TIME = "T", "Time"
RHYTHM = frozenset(["Curr", "CurrTot"])
MILLI = 1e-3
NOT_DATA = frozenset(
    ["FMTU", "UNIT", "MULT", "PARM", "MSG", "VER", "FILE"]
)  # dumped when a log starts
ROW_PERIOD_S = 1.0  # ArduCopter 3.0 logs CURR in its one-hertz loop
PERIOD_TOLERANCE = 0.05
MIN_CHARGE_MAH = 5.0  # less does not resolve the period to 5 % (the counter starts between rows)
LOST_STEPS = 2.5  # of the usual step by the counter: one missing row makes 2 of it
LOST_MAH = 2.0  # beyond what a counter in whole mAh adds to a step

Timed = Mapping[str, tuple[Table, FloatArray]]


def own_stamps(table: Table) -> FloatArray | None:
    """(n,) seconds since boot that the rows themselves carry, or None."""
    first = next(iter(table.types), "")
    if first in CLOCK_LABELS and first in table.numbers:
        return table.numbers[first] * CLOCK_LABELS[first]
    if table.name.startswith("GPS") and GPS_BOOT in table.numbers:
        return table.numbers[GPS_BOOT] * MILLI
    return None


def timed_tables(raw: RawLog) -> tuple[Timed, FileClock]:
    """Every table with its times, zero at the first data row (stray: NaN), and the clock.

    Rows without a stamp of their own have the time of the last stamped one before them. A log
    without any stamp has no tables here unless its time can be reconstructed.
    """
    stamps = {
        name: (table.offset, own)
        for name, table in raw.tables.items()
        if name not in NOT_DATA and (own := own_stamps(table)) is not None
    }
    if not stamps:
        return _reconstructed(raw)
    clock = file_clock(stamps)
    if not np.isfinite(clock.time_s).any():
        return {}, clock
    times = {
        name: clock.of(table.offset) if name in stamps else clock.at(table.offset)
        for name, table in raw.tables.items()
    }
    return _from_start(raw, times, clock)


def _from_start(
    raw: RawLog, times: Mapping[str, FloatArray], clock: FileClock
) -> tuple[Timed, FileClock]:
    data = [t[np.isfinite(t)] for name, t in times.items() if name not in NOT_DATA]
    start_s = min((float(t.min()) for t in data if t.size), default=0.0)
    timed = {name: (raw.tables[name], np.maximum(t - start_s, 0.0)) for name, t in times.items()}
    return timed, replace(clock, time_s=clock.time_s - start_s)


def _reconstructed(raw: RawLog) -> tuple[Timed, FileClock]:
    """Times of a log without stamps: GPS time of week, else the rhythm of the current rows."""
    gps, current = raw.tables.get("GPS"), raw.tables.get("CURR")
    if gps is not None and GPS_WEEK_TIME in gps.numbers and len(gps) > 1:
        base = gps.offset, gps.numbers[GPS_WEEK_TIME] * MILLI
        reason = f"the time of week of its {len(gps)} GPS rows"
    elif current is not None and len(current) > 1 and current.numbers.keys() >= RHYTHM:
        time_s, evidence = row_times(current)
        base = current.offset, time_s
        reason = f"{len(current)} CURR rows {evidence}"
    else:
        return {}, file_clock({})
    clock = file_clock({"base": base}, reconstructed_from=reason)
    if not np.isfinite(clock.time_s).any():
        return {}, clock
    times = {name: clock.between(t.offset) for name, t in raw.tables.items()}
    return _from_start(raw, times, clock)


def end_s(timed: Timed) -> float:
    """Time of the last data row [s]."""
    last = [t[np.isfinite(t)] for name, (_, t) in timed.items() if name not in NOT_DATA]
    return max((float(t.max()) for t in last if t.size), default=0.0)


def row_times(current: Table) -> tuple[FloatArray, str]:
    """(n,) times of CURR rows that have none [s], and the evidence in words.

    The charge counter is the integral of the current, so what it gains over the sum of the currents
    is the period. It decides: 1 s, the autopilot's own schedule, if it agrees with that within its
    error, else what it says. Where it gains far more from one row to the next than it usually does,
    rows are missing: these steps do not count for the period, and last as long as it says.
    """
    amps = current.numbers["Curr"] * 0.01
    mean_A, gained_C = (amps[1:] + amps[:-1]) / 2, np.diff(current.numbers["CurrTot"]) * MAH_C
    counted = (mean_A > 0) & (gained_C >= 0)
    ratio_s = np.divide(gained_C, mean_A, out=np.zeros(mean_A.size), where=counted)
    usual_s = _middle(ratio_s[counted], mean_A[counted]) or np.inf
    lost = counted & (gained_C > LOST_MAH * MAH_C) & (ratio_s > LOST_STEPS * usual_s)
    whole = counted & ~lost
    if gained_C[whole].sum() < MIN_CHARGE_MAH * MAH_C:
        period_s = ROW_PERIOD_S
        said = "the autopilot's schedule; no charge was drawn that could prove it"
    else:
        proved_s = float(gained_C[whole].sum() / mean_A[whole].sum())
        agrees = abs(proved_s - ROW_PERIOD_S) <= PERIOD_TOLERANCE * ROW_PERIOD_S
        period_s = ROW_PERIOD_S if agrees else proved_s
        said = f"the charge counter says {proved_s:.3f} s"
    steps_s = np.where(lost, ratio_s, period_s)
    if lost.any():
        missing_s = float((steps_s - period_s)[lost].sum())
        said += f", and that {missing_s:.0f} s are missing in {int(lost.sum())} places"
    return np.append(0.0, np.cumsum(steps_s)), f"every {period_s:.3g} s ({said})"


def _middle(values: FloatArray, weights: FloatArray) -> float:
    """Median of (n,) values that count by their (n,) weights; 0 of none."""
    if not values.size:
        return 0.0
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, below[-1] / 2)])
