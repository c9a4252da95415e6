"""The flight over time, so that a person can judge the cut."""

from typing import NamedTuple

import numpy as np

from flightlogs.recording import Recording
from reports import plots
from reports.flight import FlightReport
from reports.quantity import ampere_hours, fixed
from reports.section import Cell, Column, Figure, Section, Table
from segment import MotionDetector
from segment.command import BASES, commanded
from segment.segment import Basis, Motion, Segment

BASIS = {
    Basis.SETPOINT: "commanded velocity",
    Basis.POSITION_SETPOINT: "commanded position, differentiated",
    Basis.STICKS: "sticks, by flight mode",
    Basis.VELOCITY: "measured velocity",
    Basis.NONE: "neither velocity nor command",
}
GROUND = "signs of flight: autopilot, height, current"
MEASURED_RANK = BASES.index(Basis.VELOCITY)  # what ranks before it is a command
COLUMNS = (
    Column(title="motion", numeric=False),
    Column(title="from [s]"),
    Column(title="to [s]"),
    Column(title="duration [s]"),
    Column(title="decided by", numeric=False),
    Column(title="charge [Ah]"),
    Column(title="mean [A]"),
)


class Panel(NamedTuple):
    """One of the drawings below each other: the label of its axis and (values, colour, name)."""

    label: str
    lines: tuple[tuple[plots.FloatArray, str, str], ...]


def course(report: FlightReport) -> Section:
    """Current, climb and ground speed, commanded and measured, coloured by motion."""
    return Section(
        id="course",
        title="The flight and its motions",
        lead=(_decided(report.segments),),
        figures=(_figure(report),),
        tables=(_table(report.segments),),
    )


def _decided(segments: tuple[Segment, ...]) -> str:
    if not segments:
        return "No segment was found."
    total = sum(s.duration_s for s in segments)
    shares = {
        by: sum(s.duration_s for s in segments if decided_by(s) == by) / total
        for by in (*BASIS.values(), GROUND)
    }
    named = [
        f"{by} ({fixed(100 * share, 0)} % of the time)" for by, share in shares.items() if share
    ]
    return f"The cut was decided by {'; '.join(named)}."


def decided_by(segment: Segment) -> str:
    """What told its motion, in words."""
    return GROUND if segment.motion is Motion.GROUND else BASIS[segment.basis]


def _figure(report: FlightReport) -> Figure:
    recording = report.recording
    current = Panel(
        "current [A]", ((recording.current_A, plots.MEASURED, recording.current_source),)
    )
    drawn = (current, *(p for p in _speeds(recording) if p.lines))
    canvas, axes = plots.panels([2.4, *(1.7 for _ in drawn[1:])])
    plots.shade(axes, report.segments)
    for ax, panel in zip(axes, drawn, strict=True):
        for values, colour, label in panel.lines:
            plots.line(ax, recording.time_s, values, colour, label)
        ax.set_ylabel(panel.label)
        plots.legend(ax)
    axes[-1].set_xlabel("time since the start of the log [s]")
    axes[-1].set_xlim(float(recording.time_s[0]), float(recording.time_s[-1]))
    plots.motion_key(canvas, report.segments)
    command = (
        f" Velocity setpoints: {recording.setpoint_source}." if recording.setpoint_source else ""
    )
    none = " The log has no credible velocity." if recording.velocity_m_s is None else ""
    return Figure(
        caption=f"Current and velocity; the background is the motion.{command}{none}",
        description=_description(report),
        svg=plots.to_svg(canvas, "course"),
    )


def _speeds(recording: Recording) -> tuple[Panel, Panel]:
    """Climb and ground speed: measured, and commanded as the cut understood it."""
    command = commanded(recording, MotionDetector().sticks)
    given = command.velocity_m_s.copy()
    given[command.horizontal_basis >= MEASURED_RANK, :2] = np.nan
    given[command.vertical_basis >= MEASURED_RANK, 2] = np.nan
    measured = recording.velocity_m_s
    both = [(given, plots.COMMANDED, "commanded")]
    if measured is not None:
        both.insert(0, (measured, plots.MEASURED, "measured"))
    climb = [(-v[:, 2], colour, label) for v, colour, label in both]
    ground = [(np.hypot(v[:, 0], v[:, 1]), colour, label) for v, colour, label in both]
    return (
        Panel("climb [m/s]", tuple(x for x in climb if np.isfinite(x[0]).any())),
        Panel("ground speed [m/s]", tuple(x for x in ground if np.isfinite(x[0]).any())),
    )


def _description(report: FlightReport) -> str:
    spans = ", ".join(
        f"{plots.motion_name(s.motion)} from {fixed(s.start_s, 0)} to {fixed(s.stop_s, 0)} seconds"
        for s in report.segments
    )
    return f"Current, climb rate and ground speed over time. Motions: {spans or 'none'}."


def _table(segments: tuple[Segment, ...]) -> Table:
    return Table(
        caption=f"The {len(segments)} segments",
        columns=COLUMNS,
        folded=True,
        rows=tuple(
            tuple(
                Cell(text=text)
                for text in (
                    plots.motion_name(s.motion),
                    fixed(s.start_s, 1),
                    fixed(s.stop_s, 1),
                    fixed(s.duration_s, 1),
                    decided_by(s),
                    ampere_hours(s.load.charge_C, 4),
                    fixed(s.load.mean_A, 2),
                )
            )
            for s in segments
        ),
    )
