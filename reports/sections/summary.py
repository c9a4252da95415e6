"""What was flown, in a few lines."""

import numpy as np

from flightlogs.holes import holes
from flightlogs.log import Interval
from flightlogs.recording import Recording
from reports.flight import FlightReport
from reports.motions import in_flight_s
from reports.quantity import MISSING, ampere_hours, celsius, fixed, minutes
from reports.section import Notice, Row, Section, Severity
from reports.sections.fit import SHOWN, doubtful_current
from twin.calibrate.answer import Estimate, Verdict
from twin.calibrate.flight import FlightFit, NotFitted

TOLD_S = 1.0  # more of a flight than this, landed or not recorded, is told
MOST_ASKED = ("initial_soc", "capacity_C", "pulse_ohm")

NOT_CALIBRATED = (
    "The twin is not calibrated to this pack: it uses the built-in cell {cell}, scaled to this "
    "pack's capacity. Read the replay as what a pack of such cells would do, not as a diagnosis."
)
FITTED = (
    "The twin is fitted to this flight, not calibrated to this pack: the built-in cell {cell} was "
    "changed until it answers as the pack did, and the voltage error fell from {before} to {after} "
    "mV. {told}What remains uncertain stands under “Fitted to this flight”; a good fit is no "
    "diagnosis."
)
NOT_FITTED = " It was not fitted to this flight either: {reason}."


def summary(report: FlightReport) -> Section:
    """Vehicle, date, pack and the flight that was chosen."""
    return Section(
        id="summary",
        title="What was flown",
        notices=_notices(report),
        rows=(*_vehicle(report), *_pack(report), *_flight(report)),
    )


def _notices(report: FlightReport) -> tuple[Notice, ...]:
    out = []
    if report.pack.fit is not None:
        severity = Severity.DOUBT if doubtful_current(report) else Severity.NOTE
        text = _fitted(report, report.pack.fit)
        out.append(Notice(text=text, severity=severity, code="fitted_to_this_flight"))
    elif not report.pack.calibrated:
        text = NOT_CALIBRATED.format(cell=report.pack.cell) + _why_not(report)
        out.append(Notice(text=text, severity=Severity.DOUBT, code="not_calibrated"))
    if report.log.simulated:
        text = "This is the log of a simulated flight: its current was computed, not measured."
        out.append(Notice(text=text, severity=Severity.DOUBT, code="simulated"))
    return tuple(out)


def _fitted(report: FlightReport, fit: FlightFit) -> str:
    before_V = report.pack.fitting.before_V if report.pack.fitting else None
    after_V = report.replay.rmse_V
    before, after = (fixed(None if v is None else 1000 * v, 0) for v in (before_V, after_V))
    known = [e for e in (*fit.estimates, fit.pulse) if e.verdict is Verdict.IDENTIFIED]
    told = "; ".join(_in_words(e) for e in known if e.name in MOST_ASKED)
    told = f"This flight tells {told}. " if told else ""
    if told and doubtful_current(report):
        told += "The log's current is doubtful, and so are capacity and resistance. "
    return FITTED.format(cell=report.pack.cell, before=before, after=after, told=told)


def _in_words(estimate: Estimate) -> str:
    shown = SHOWN[estimate.name]
    value, std = shown.texts(estimate.value, std=estimate.std)
    return f"{shown.label.lower()}: {value} ± {std} {shown.unit}"


def _why_not(report: FlightReport) -> str:
    fitting = report.pack.fitting
    if fitting is None or not isinstance(fitting.outcome, NotFitted):
        return ""
    return NOT_FITTED.format(reason=fitting.outcome.reason)


def _vehicle(report: FlightReport) -> tuple[Row, ...]:
    log = report.log
    start = f"{log.start_utc:%Y-%m-%d %H:%M:%S} UTC" if log.start_utc else MISSING
    return (
        Row(label="Log", value=log.name, note=f"format {log.format}"),
        Row(label="Vehicle", value=log.vehicle.value.replace("_", " "), note=log.vehicle_label),
        Row(label="Autopilot", value=log.firmware or MISSING, note=log.hardware),
        Row(label="Start of the log", value=start),
    )


def _pack(report: FlightReport) -> tuple[Row, ...]:
    pack, recording = report.pack, report.recording
    layout = f"{pack.series}S{pack.parallel}P"
    others = ", ".join(recording.other_batteries)
    return (
        Row(label="Battery", value=recording.battery, note=f"not used: {others}" if others else ""),
        Row(
            label="Pack",
            value=" ".join(filter(None, (pack.name, layout))),
            note=pack.origins.get("series", ""),
        ),
        Row(
            label="Capacity",
            value=ampere_hours(pack.capacity_C, 2),
            unit="Ah",
            note=pack.origins.get("capacity_C", ""),
        ),
        *((Row(label="Serial number", value=pack.serial),) if pack.serial else ()),
    )


def _flight(report: FlightReport) -> tuple[Row, ...]:
    recording, flight = report.recording, report.recording.flight
    flown = (recording.time_s >= flight.start_s) & (recording.time_s <= flight.stop_s)
    charge_C = sum(s.load.charge_C for s in report.segments)
    in_air_s = in_flight_s(report.segments)
    voltage = recording.voltage_V[flown]
    lowest = float(np.nanmin(voltage)) if np.isfinite(voltage).any() else None
    peak = float(np.max(recording.current_A[flown])) if flown.any() else None
    share = f"{fixed(100 * charge_C / report.pack.capacity_C, 0)} % of the capacity; "
    return (
        Row(
            label="Time in flight",
            value=minutes(in_air_s),
            unit="min:s",
            note=_where(flight, in_air_s),
        ),
        Row(
            label="Charge drawn in the log",
            value=ampere_hours(charge_C),
            unit="Ah",
            note=(
                f"{share if report.pack.capacity_known else ''}{recording.current_source} current"
                f"{_unknown(recording)}"
            ),
        ),
        Row(label="Highest current", value=fixed(peak, 1), unit="A"),
        Row(
            label="Lowest voltage", value=fixed(lowest, 2), unit="V", note=_per_cell(report, lowest)
        ),
        *_temperature(report),
        *_other_flights(report),
    )


def _unknown(recording: Recording) -> str:
    found = holes(recording.time_s, recording.flight)
    missing_s = sum(hole.duration_s for hole in found)
    return f", not known for {fixed(missing_s, 1)} s of the flight" if found else ""


def _where(flight: Interval, in_air_s: float) -> str:
    span = f"from {fixed(flight.start_s, 1)} s to {fixed(flight.stop_s, 1)} s of the log"
    less_s = flight.duration_s - in_air_s
    return span if less_s < TOLD_S else f"{span}, less {fixed(less_s, 1)} s landed or not recorded"


def _per_cell(report: FlightReport, voltage_V: float | None) -> str:
    return "" if voltage_V is None else f"{fixed(voltage_V / report.pack.series, 2)} V a cell"


def _temperature(report: FlightReport) -> tuple[Row, ...]:
    measured = report.recording.temperature_K
    if measured is None or not np.isfinite(measured).any():
        return (Row(label="Pack temperature", value="not measured"),)
    low, high = celsius(float(np.nanmin(measured))), celsius(float(np.nanmax(measured)))
    return (Row(label="Pack temperature", value=f"{low} to {high}", unit="°C", note="as logged"),)


def _other_flights(report: FlightReport) -> tuple[Row, ...]:
    others = report.recording.other_flights
    if not others:
        return ()
    spans = ", ".join(f"{fixed(o.start_s, 0)}–{fixed(o.stop_s, 0)} s" for o in others)
    return (Row(label="Other armed spans", value=spans, note="not analysed"),)
