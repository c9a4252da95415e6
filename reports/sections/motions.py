"""What each motion drew."""

import math

from reports import plots
from reports.flight import FlightReport, PackUse
from reports.motions import MotionLoad, motion_loads
from reports.quantity import MISSING, ampere_hours, fixed
from reports.section import Cell, Column, Section, Table

COLUMNS = (
    Column(title="motion", numeric=False),
    Column(title="segments"),
    Column(title="time [s]"),
    Column(title="charge [Ah]"),
    Column(title="energy [Wh]"),
    Column(title="mean [A]"),
    Column(title="RMS [A]"),
    Column(title="99th percentile [A]"),
    Column(title="ripple [A]"),
    Column(title="mean [C]"),
)
NO_ENERGY = (
    f"Energy {MISSING}: the log has no voltage there, or not all through the motion. A sensor that "
    "was on before or after the autopilot's log has current alone."
)


def motions(report: FlightReport) -> Section | None:
    """One row a motion; None if nothing was cut."""
    loads = motion_loads(report.recording, report.segments)
    if not loads:
        return None
    table = Table(
        caption="Load by motion",
        columns=COLUMNS,
        rows=tuple(_row(load, report.pack) for load in loads.values()),
    )
    return Section(
        id="motions",
        title="What each motion drew",
        tables=(table,),
        notes=(
            "Ripple is the standard deviation about the moving average. C is the current over the "
            "capacity in an hour, where that is known. The figures carry no uncertainty of their "
            "own: that of the current sensor is not in the log.",
            *((NO_ENERGY,) if any(math.isnan(m.load.energy_J) for m in loads.values()) else ()),
        ),
    )


def _row(motion: MotionLoad, pack: PackUse) -> tuple[Cell, ...]:
    load = motion.load
    rate = load.mean_A / (pack.capacity_C / 3600) if pack.capacity_known else None
    texts = (
        plots.motion_name(motion.motion),
        str(motion.segments),
        fixed(motion.time_s, 1),
        ampere_hours(load.charge_C, 4),
        fixed(load.energy_J / 3600, 3),
        fixed(load.mean_A, 2),
        fixed(load.rms_A, 2),
        fixed(load.p99_A, 2),
        fixed(load.ripple_A, 2),
        fixed(rate, 2),
    )
    return tuple(Cell(text=text) for text in texts)
