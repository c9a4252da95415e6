"""The flight over time, so that a person can judge the cut."""

from typing import TYPE_CHECKING

import numpy as np

from reports import plots
from reports.flight import FlightReport
from reports.quantity import ampere_hours, fixed
from reports.section import Cell, Column, Figure, Section, Table
from segment.segment import Basis, Segment

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BASIS = {
    Basis.SETPOINT: "commanded velocity",
    Basis.POSITION_SETPOINT: "commanded position, differentiated",
    Basis.STICKS: "sticks, by flight mode",
    Basis.VELOCITY: "measured velocity",
    Basis.NONE: "neither velocity nor command",
}
COLUMNS = (
    Column(title="motion", numeric=False),
    Column(title="from [s]"),
    Column(title="to [s]"),
    Column(title="duration [s]"),
    Column(title="decided by", numeric=False),
    Column(title="charge [Ah]"),
    Column(title="mean [A]"),
)


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
    shares = {b: sum(s.duration_s for s in segments if s.basis is b) / total for b in Basis}
    named = [
        f"{BASIS[b]} ({fixed(100 * share, 0)} % of the time)"
        for b, share in shares.items()
        if share
    ]
    return f"The cut was decided by {', '.join(named)}."


def _figure(report: FlightReport) -> Figure:
    recording = report.recording
    has_velocity = recording.velocity_m_s is not None
    canvas, axes = plots.panels([2.4, 1.7, 1.7] if has_velocity else [2.6])
    plots.shade(axes, report.segments)
    plots.line(
        axes[0], recording.time_s, recording.current_A, plots.MEASURED, recording.current_source
    )
    axes[0].set_ylabel("current [A]")
    if has_velocity:
        _velocities(axes[1], axes[2], report)
    axes[-1].set_xlabel("time since the start of the log [s]")
    axes[-1].set_xlim(float(recording.time_s[0]), float(recording.time_s[-1]))
    for ax in axes:
        plots.legend(ax)
    plots.motion_key(canvas, report.segments)
    command = f" Commands: {recording.setpoint_source}." if recording.setpoint_source else ""
    none = "" if has_velocity else " The log has no credible velocity."
    return Figure(
        caption=f"Current and velocity; the background is the motion.{command}{none}",
        description=_description(report),
        svg=plots.to_svg(canvas, "course"),
    )


def _velocities(climb: "Axes", ground: "Axes", report: FlightReport) -> None:
    recording = report.recording
    lines = (
        (recording.velocity_m_s, plots.MEASURED, "measured"),
        (recording.velocity_setpoint_m_s, plots.COMMANDED, "commanded"),
    )
    for values, colour, label in lines:
        if values is not None:
            plots.line(climb, recording.time_s, -values[:, 2], colour, label)
            speed = np.hypot(values[:, 0], values[:, 1])
            plots.line(ground, recording.time_s, speed, colour, label)
    climb.set_ylabel("climb [m/s]")
    ground.set_ylabel("ground speed [m/s]")


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
                    BASIS[s.basis],
                    ampere_hours(s.load.charge_C, 4),
                    fixed(s.load.mean_A, 2),
                )
            )
            for s in segments
        ),
    )
