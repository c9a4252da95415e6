"""The recording beside the twin's answer to the same current."""

import numpy as np

from reports import plots
from reports.flight import FlightReport
from reports.quantity import ampere_hours, celsius, fixed, significant
from reports.section import Figure, Notice, Row, Section, Severity
from twin.constants import ZERO_CELSIUS_K
from twin.replay import Replay
from twin.solution import Status


def replay(report: FlightReport) -> Section:
    """Voltage recorded and simulated, their difference, charge and temperature."""
    played = report.replay
    figures = (_figure(report, played),) if played.solution.time_s.size > 1 else ()
    return Section(
        id="replay",
        title="Replay through the twin",
        lead=(_how(report),),
        notices=_status(played),
        rows=_rows(report, played),
        figures=figures,
    )


def _how(report: FlightReport) -> str:
    pack = report.pack
    effects = ", ".join(e.replace("_", " ") for e in pack.effect_ids) or "none"
    return (
        f"The recorded current was drawn from {pack.series}S{pack.parallel}P of the cell "
        f"{pack.cell}, scaled to {ampere_hours(pack.capacity_C, 2)} Ah"
        f"{' and fitted to this flight' if pack.fit else ''}. "
        f"Effects switched on: {effects}."
    )


def _status(played: Replay) -> tuple[Notice, ...]:
    solution = played.solution
    if solution.status is Status.DONE:
        return ()
    text = (
        f"The simulation ended early, at {fixed(solution.stopped_s, 1)} s: "
        f"{solution.status.value}. "
        "What is shown and counted is the time up to there."
    )
    code = solution.status.name.lower()
    return (Notice(text=text, severity=Severity.DOUBT, code=code),)


def _rows(report: FlightReport, played: Replay) -> tuple[Row, ...]:
    solution, pack = played.solution, report.pack
    rmse, worst = played.rmse_V, played.max_error_V
    per_cell = "" if rmse is None else f"{fixed(1000 * rmse / pack.series, 1)} mV a cell"
    compared = f"over {played.judged_residual_V.size} voltage samples of the flight"
    rows = [
        Row(
            label="Voltage error, RMS",
            value=fixed(None if rmse is None else 1000 * rmse, 1),
            unit="mV",
            note="; ".join(filter(None, (per_cell, compared))),
        ),
        Row(
            label="Voltage error, largest",
            value=fixed(None if worst is None else 1000 * worst, 1),
            unit="mV",
        ),
        Row(
            label="State of charge at the start",
            value=fixed(100 * pack.shown_soc, 1),
            unit="%",
            note=pack.origins.get("initial_soc", ""),
        ),
        Row(
            label="Temperature at the start",
            value=celsius(pack.initial_K),
            unit="°C",
            note=pack.origins.get("initial_K", ""),
        ),
    ]
    return (*rows, *_end_rows(played)) if solution.time_s.size else tuple(rows)


def _end_rows(played: Replay) -> tuple[Row, ...]:
    solution = played.solution
    audit = solution.audit
    return (
        Row(label="State of charge at the end", value=fixed(100 * solution.soc[-1], 1), unit="%"),
        Row(
            label="Highest temperature",
            value=celsius(float(np.max(solution.temperature_K))),
            unit="°C",
            note="simulated",
        ),
        Row(
            label="Lithium balance",
            value=significant(audit.relative_error, 2),
            note="relative change of all lithium in the cell; 0 but for rounding",
        ),
    )


def _figure(report: FlightReport, played: Replay) -> Figure:
    solution, m = played.solution, played.solution.time_s.size
    canvas, axes = plots.panels([2.4, 1.6, 1.6])
    plots.shade(axes, report.segments)
    known = np.isfinite(played.recorded_V[:m])  # beside a sensor's current it is not at every one
    known_s = solution.time_s[known]
    plots.line(axes[0], known_s, played.recorded_V[:m][known], plots.MEASURED, "recorded")
    plots.line(axes[0], solution.time_s, solution.voltage_V, plots.SIMULATED, "simulated")
    residual_mV = 1000 * played.residual_V[known]
    plots.line(axes[1], known_s, residual_mV, plots.COMMANDED, "recorded − simulated")
    axes[1].axhline(0.0, color=plots.MEASURED, linewidth=0.6)
    plots.line(axes[2], solution.time_s, 100 * solution.soc, plots.MEASURED, "state of charge")
    warm = plots.second_scale(axes[2])
    plots.line(
        warm,
        solution.time_s,
        solution.temperature_K - ZERO_CELSIUS_K,
        plots.COMMANDED,
        "temperature",
    )
    for ax, label in zip(
        (*axes, warm),
        ("pack voltage [V]", "residual [mV]", "charge [%]", "temperature [°C]"),
        strict=True,
    ):
        ax.set_ylabel(label)
    for ax in axes[:2]:
        plots.legend(ax)
    plots.legend(axes[2], also=warm)
    axes[-1].set_xlabel("time since the start of the log [s]")
    axes[-1].set_xlim(float(solution.time_s[0]), float(solution.time_s[-1]))
    plots.motion_key(canvas, report.segments)
    return Figure(
        caption="Voltage recorded and simulated; their difference; the twin's state.",
        description=_description(played),
        svg=plots.to_svg(canvas, "replay"),
    )


def _description(played: Replay) -> str:
    rmse = played.rmse_V
    if rmse is None:
        return "Simulated voltage over time; no voltage was recorded to compare it with."
    return (
        "Recorded and simulated pack voltage over time, which differ by "
        f"{fixed(1000 * rmse, 1)} millivolts RMS in flight."
    )
