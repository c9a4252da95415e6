"""The time of each row of a DataFlash log, also where the log does not say."""

from collections.abc import Mapping

import numpy as np

from flightlogs.errors import LogWarning
from flightlogs.log import FloatArray
from flightlogs.measured import MAH_C
from flightlogs.stamps import FileClock, file_clock
from flightlogs.table import RawLog, Table

# label -> unit [s]; TimeMS is the time since boot only where it leads the record: in GPS of 3.x
# it is the time of the week, and `T` is the time since boot
CLOCK_LABELS = {"TimeUS": 1e-6, "TimeMS": 1e-3}
GPS_BOOT, GPS_WEEK_TIME = "T", "Time"
MILLI = 1e-3
NOT_DATA = frozenset(["FMTU", "UNIT", "MULT", "PARM", "MSG", "VER", "FILE"])  # dumped at the start
ROW_PERIOD_S = 1.0  # ArduCopter 3.0 logs CURR in its one-hertz loop
PERIOD_TOLERANCE = 0.05
MIN_CHARGE_MAH = 5.0  # less does not resolve the period to 5 % (the counter starts between rows)

Timed = Mapping[str, tuple[Table, FloatArray]]


def own_stamps(table: Table) -> FloatArray | None:
    """(n,) seconds since boot that the rows themselves carry, or None."""
    first = next(iter(table.types), "")
    if first in CLOCK_LABELS and first in table.numbers:
        return table.numbers[first] * CLOCK_LABELS[first]
    if table.name.startswith("GPS") and GPS_BOOT in table.numbers:
        return table.numbers[GPS_BOOT] * MILLI
    return None


def timed_tables(raw: RawLog) -> tuple[Timed, FileClock, tuple[LogWarning, ...]]:
    """Every table with its times (NaN for a stray stamp), zero at the first data row."""
    stamps = {
        name: (table.offset, own)
        for name, table in raw.tables.items()
        if (own := own_stamps(table)) is not None
    }
    if not stamps:
        return _reconstructed(raw)
    clock = file_clock(stamps)
    times = {
        name: clock.of(table.offset) if name in stamps else clock.at(table.offset)
        for name, table in raw.tables.items()
    }
    return _from_start(raw, times), clock, clock.warnings()


def _from_start(raw: RawLog, times: Mapping[str, FloatArray]) -> Timed:
    first = [np.nanmin(t) for name, t in times.items() if name not in NOT_DATA and _known(t)]
    start_s = min(first, default=0.0)
    return {name: (raw.tables[name], np.maximum(t - start_s, 0.0)) for name, t in times.items()}


def _known(time_s: FloatArray) -> bool:
    return bool(np.isfinite(time_s).any())


def _reconstructed(raw: RawLog) -> tuple[Timed, FileClock, tuple[LogWarning, ...]]:
    """Times of a log without stamps: GPS time of week, else the rhythm of the current rows."""
    gps, current = raw.tables.get("GPS"), raw.tables.get("CURR")
    if gps is not None and GPS_WEEK_TIME in gps.numbers and len(gps) > 1:
        stamps = (gps.offset, gps.numbers[GPS_WEEK_TIME] * MILLI)
        reason = f"the time of week of its {len(gps)} GPS rows"
    elif current is not None and len(current) > 1:
        period_s, evidence = row_period(current)
        stamps = (current.offset, np.arange(len(current)) * period_s)
        reason = f"{len(current)} CURR rows every {period_s:.3g} s ({evidence})"
    else:
        return {}, file_clock({}), ()
    clock = file_clock({"base": stamps})
    times = {name: clock.between(t.offset) for name, t in raw.tables.items()}
    message = f"the log has no time on its rows: taken from {reason}"
    warning = LogWarning("time_base_reconstructed", message, "time")
    return _from_start(raw, times), clock, (warning, *clock.warnings())


def row_period(current: Table) -> tuple[float, str]:
    """Period of CURR rows [s], and the evidence in words.

    The charge counter is the integral of the current, so the charge between the first and the last
    row over the sum of the currents is the period. It decides: 1 s, the autopilot's own schedule,
    if it agrees with that within its error, else what it says.
    """
    amps = current.numbers["Curr"] * 0.01
    drawn_mAh = float(np.ptp(current.numbers["CurrTot"]))
    if drawn_mAh < MIN_CHARGE_MAH or np.sum(amps) <= 0:
        return ROW_PERIOD_S, "the autopilot's schedule; no charge was drawn that could prove it"
    proved_s = drawn_mAh * MAH_C / float(np.trapezoid(amps))
    evidence = f"the charge counter says {proved_s:.3f} s"
    agrees = abs(proved_s - ROW_PERIOD_S) <= PERIOD_TOLERANCE * ROW_PERIOD_S
    return (ROW_PERIOD_S if agrees else proved_s), evidence
